"""SOUND: the result of a render: samples with their physical full scale, the scene, and its plan.

Stage   after STAGE 4 (encode), with which it writes files.
Model   `frames` holds value / full scale in float32, as in a float file. `values` holds SI units.
Limits  The whole sound is in memory: 4 bytes per frame and channel, and 8 more if `values` is used. A voice
        (`synth.open_voice`) renders longer sounds block by block.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from synth.encode.scaled_frames import UNSCALED, Real, ScaledFrames
from synth.errors import CannotRender, Fault, InvalidRequest, shown

if TYPE_CHECKING:
    from synth.plan.plan import Plan
    from synth.plan.preparation import Preparation
    from synth.response_cache import ResponseCache
    from synth.scene.scene import Scene, SceneLike

PLOTTED_SECONDS = 0.05  # s shown in a plot: several periods of a usual texture
HEADROOM = 0.8  # of full scale: the largest peak of a series, as of an automatic full scale
SERIES = "a list of one Sound or more, all of the same quantities"
NO_SCALE = "Multiply its frames by the scale that you know."
BLOCK = 1 << 18  # frames rendered at a time
NO_PLOTS = "cannot plot: matplotlib is not installed. Run: pip install 'ridgewave[plots]'."


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Sound(ScaledFrames):
    """A finite sound. `numpy.asarray(sound)` is its `values`.

    Attributes:
        frames: samples in units of `full_scale`, float32 [frames, channels]. They are not limited and may exceed 1.
        sample_rate: frames per second.
        full_scale: SI value of a sample of 1.0, one per channel.
        quantities: quantity of each channel, such as "acceleration".
        asked: the rendered scene, as it was given; None for another program's file.
        warnings: sentences that a user should read before listening.
        planned: the plan, or what makes it when it is first read; None for a file, or a sound from a service.
        recording: the recording of a live session that was rendered, or None.

    Example:
        import ridgewave as rw
        sound = rw.render({"texture": {"period": "0.6 mm"}, "output": {"duration": "0.1 s"}})
        print(sound, sound.peak[0], sound.units[0])
        sound.save("fine.wav")
    """

    asked: SceneLike | None
    warnings: tuple[str, ...] = ()
    planned: Plan | Callable[[], Plan] | None = None
    recording: Mapping[str, Any] | None = None

    @property
    def scene(self) -> Scene:
        """The scene of the sound. Raises CannotRender for a file without one."""
        from synth.scene.scene import scene_from

        if self.asked is None:
            raise CannotRender("this sound has no scene: its file is of another program, or has lost what was in it.")
        return scene_from(self.asked)

    @property
    def plan(self) -> Plan | None:
        """What was simulated, with its error; None for a sound that was not rendered here."""
        if callable(self.planned):
            object.__setattr__(self, "planned", self.planned())
        assert not callable(self.planned)
        return self.planned

    def __reduce__(self) -> tuple[Any, ...]:
        scale = self.full_scale, self.quantities
        return Sound, (self.frames, self.sample_rate, *scale, self.asked, self.warnings, self.plan, self.recording)

    def with_full_scale(self, full_scale: float | str | Sequence[float | str] | Real) -> Sound:
        """Return the same values with another full scale, such as one for a series (`common_full_scale`).

        full_scale: value of a sample of 1.0, in SI or as text with its unit ("10 m/s^2"), for all channels or one per
            channel. The range is that of `output.full_scale`.
        The scene of the returned sound has the full scale, and its recording too: a saved file is rendered at it again.
        Where a limiter acted on a live session, the file is then rendered without it. The plan is that of the render.
        Raises InvalidRequest for any other value, and for a sound without a scale.

        Example:
            import ridgewave as rw
            soft, firm = (rw.render({"scan": {"load": load}, "output": {"duration": 0.1}}) for load in (0.1, 1.0))
            scale = rw.common_full_scale([soft, firm])
            soft.with_full_scale(scale).save("soft.wav")
        """
        from synth.scene.full_scales import read_full_scales

        if UNSCALED in self.quantities:
            raise InvalidRequest(
                [Fault("/full_scale", shown(full_scale), "nothing: this sound has no scale", NO_SCALE)]
            )
        scales = read_full_scales(full_scale, self.quantities)
        frames = (self.values / np.asarray(scales)).astype(np.float32)
        recording = None if self.recording is None else {**self.recording, "full_scale": list(scales)}
        return replace(self, frames=frames, full_scale=scales, asked=self._asked_at(scales), recording=recording)

    def _asked_at(self, full_scale: tuple[float, ...]) -> SceneLike | None:
        """Return what was asked with these full scales (SI) in it."""
        from synth.scene.full_scales import with_full_scales
        from synth.scene.scene import parse_scene

        if self.asked is None:
            return None
        if isinstance(self.asked, Mapping):  # of a service or a file: its surface may be unknown here
            return with_full_scales(self.asked, self.quantities, full_scale)
        return parse_scene(with_full_scales(self.scene.document(), self.quantities, full_scale))

    def save(self, path: str | os.PathLike[str], subtype: str | None = None) -> Path:
        """Write a sound file that contains the full scale and the scene, or a table of values; return its path.

        path: ends in .wav, .flac, .raw, .f32, .pcm or .l16 for sound; in .npy for `values` as a NumPy array; or in .csv
            for the times (s) and the values (SI), under a line of names with units. An existing file is replaced.
        subtype: "float", "pcm16" or "pcm24", if the ending allows several. For integers the sound first passes the
            safety limiter, because integers clip. If it acts, a RenderWarning tells by how much, and the file has
            `gain_reduction_db`.
        Raises InvalidRequest for another ending or subtype, and for frames that are NaN or infinite; CannotRender if
        the file cannot be written.

        Example: rw.render({"output": {"duration": 0.1}}).save("values.csv")
        """
        from synth.encode.formats import Metadata
        from synth.encode.sound_saving import save_frames
        from synth.scene.scene import scene_document

        if not isinstance(path, str | os.PathLike):
            hint = 'Write a path, such as "out.wav". For bytes in memory, save a file and read it.'
            raise InvalidRequest([Fault("/path", shown(path), "the path of a file", hint)])
        metadata = None
        if self.asked is not None:
            scene = scene_document(self.scene)
            metadata = Metadata(self.full_scale, self.quantities, scene, recording=self.recording)
        return save_frames(self, metadata, Path(path), subtype)

    def to_xarray(self) -> Any:
        """Return an xarray.DataArray [time], or a Dataset of several quantities, with units.

        Needs the extra `xarray`. Its attributes have the full scale and the scene as JSON text.
        """
        from synth.encode.sound_views import to_xarray

        return to_xarray(self, None if self.asked is None else self.scene.json_text())

    def _repr_html_(self) -> str:
        """Return what a notebook shows: a player, the waveform, and level and scale in words."""
        from synth.encode.sound_views import notebook_view

        return notebook_view(self, self.warnings)

    def plot(self) -> Any:
        """Return a matplotlib figure: the first 50 ms of each channel, and its spectrum. Needs the extra `plots`.

        A notebook shows the figure. In a script, save it: sound.plot().savefig("sound.png").
        """
        try:
            from matplotlib.figure import Figure
        except ImportError as error:
            raise CannotRender(NO_PLOTS) from error

        class ShownFigure(Figure):
            """A figure that a notebook shows without `%matplotlib`, and that no window keeps in memory."""

            def _repr_png_(self) -> bytes:
                picture = io.BytesIO()
                self.savefig(picture, format="png")
                return picture.getvalue()

        figure = ShownFigure(figsize=(9.0, 2.6 * len(self.quantities)), layout="constrained")
        axes = figure.subplots(len(self.quantities), 2, squeeze=False)
        shown = min(len(self.frames), round(PLOTTED_SECONDS * self.sample_rate))
        times, values = 1e3 * np.arange(shown) / self.sample_rate, self.values[:shown]
        frequencies, amplitudes = self.spectrum()
        for channel, (quantity, unit) in enumerate(zip(self.quantities, self.units, strict=True)):
            wave, lines = axes[channel]
            wave.plot(times, values[:, channel])
            wave.set(xlabel="time (ms)", ylabel=f"{quantity} ({unit})")
            lines.loglog(frequencies[1:], np.maximum(amplitudes[1:, channel], 1e-300))
            lines.set(xlabel="frequency (Hz)", ylabel=f"peak amplitude ({unit})")
            if (largest := float(amplitudes[1:, channel].max(initial=0.0))) > 0.0:
                lines.set_ylim(1e-6 * largest, 2.0 * largest)
        return figure

    def __repr__(self) -> str:
        channels = [
            f"{quantity} peak {peak:.3g} {unit} (full scale {scale:.3g})"
            for quantity, peak, unit, scale in zip(self.quantities, self.peak, self.units, self.full_scale, strict=True)
        ]
        count = len(self.warnings)
        warned = f"; {count} warning{'s' if count > 1 else ''}" if count else ""
        return f"<Sound of {self.seconds:.6g} s at {self.sample_rate} Hz: {', '.join(channels)}{warned}>"


def common_full_scale(sounds: Iterable[Sound]) -> tuple[float, ...]:
    """Return the full scale of a series, per channel: the largest peak of all sounds is at HEADROOM of it.

    Raises InvalidRequest for anything but a list of sounds, for sounds of different quantities, and for a series that
    is silent.

    Example:
        import ridgewave as rw
        series = [rw.render({"scan": {"load": load}, "output": {"duration": 0.1}}) for load in (0.1, 0.3, 1.0)]
        scale = rw.common_full_scale(series)
        for number, sound in enumerate(series):
            sound.with_full_scale(scale).save(f"load-{number}.wav")
    """
    series = [] if isinstance(sounds, Sound) or not isinstance(sounds, Iterable) else list(sounds)
    if not series or not all(isinstance(sound, Sound) for sound in series):
        hint = "Write a list such as [rw.render(...), rw.load(...)], also of one sound."
        raise InvalidRequest([Fault("/sounds", shown(sounds), SERIES, hint)])
    kinds = {sound.quantities for sound in series}
    if len(kinds) != 1 or UNSCALED in next(iter(kinds)):
        value = f"{len(series)} sounds of {shown(sorted(kinds))}"
        hint = "Render them with the same output.quantity or output.channels."
        raise InvalidRequest([Fault("/sounds", value, SERIES, hint)])
    peaks = np.max([sound.peak for sound in series], axis=0)
    if not np.all(peaks > 0.0):
        hint = "Leave the silent channel out, or write a full scale."
        raise InvalidRequest([Fault("/sounds", "a channel that is silent in every sound", "sounds with a peak", hint)])
    return tuple(float(peak) / HEADROOM for peak in peaks)


def render(
    scene: SceneLike,
    *,
    cache: ResponseCache | None = None,
    plan_as: Callable[[Preparation], Plan] | None = None,
) -> Sound:
    """Render the whole duration of a scene, or the recording of a live session, and return a `Sound`.

    scene: a Scene, a mapping, the path of a JSON file, or a name of the catalogue.
    cache: responses solved before; by default those of this process.
    plan_as: makes the plan of the sound when it is first read; None: `plan_of`.
    Source: Fagiani & Barbieri (2016), eqs 1-5.
    Raises SceneError for an invalid scene, and for one whose contact cannot be solved.
    """
    from synth.plan.plan import plan_of, warnings_of
    from synth.scene.line_scan import as_written
    from synth.scene.scene import scene_from
    from synth.voice.voice import blocks, open_voice

    voice = open_voice(scene_from(scene), cache=cache)
    frames = [np.empty((0, voice.channels), np.float32), *blocks(voice, BLOCK)]
    solved = voice.solved
    return Sound(
        frames=np.concatenate(frames),
        sample_rate=voice.sample_rate,
        full_scale=voice.full_scale,
        quantities=voice.quantities,
        asked=as_written(voice.scene),
        warnings=warnings_of(solved),
        planned=lambda: (plan_as or plan_of)(solved),
    )


def rendered_recording(document: Mapping[str, Any]) -> Sound:
    """Return the sound of the recording of a live session, with the samples that were sent. Raises SceneError."""
    from synth.voice.recording import Recording

    replay = Recording(document).open()
    counts = [BLOCK] * (replay.frames // BLOCK) + [replay.frames % BLOCK]
    frames = [replay.render(count) for count in counts]
    return Sound(
        frames=np.concatenate(frames),
        sample_rate=replay.sample_rate,
        full_scale=replay.full_scale,
        quantities=replay.quantities,
        asked=replay.scene,
        warnings=replay.warnings,
        recording=document,
    )
