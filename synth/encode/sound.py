"""SOUND: the result of a render: samples with their physical full scale, the scene, and its plan.

Stage   after STAGE 4 (encode), with which it writes files.
Model   `frames` holds value / full scale in float32, as in a float file. `values` holds SI units.
Limits  The whole sound is in memory: 4 bytes per frame and channel, and 8 more if `values` is used. A voice
        (`synth.open_voice`) renders longer sounds block by block.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from synth.errors import CannotRender
from synth.scene.effects_section import unit_of

if TYPE_CHECKING:
    from synth.plan.plan import Plan
    from synth.response_cache import ResponseCache
    from synth.scene.scene import SceneLike

Real = npt.NDArray[np.float64]
PLOTTED_SECONDS = 0.05  # s shown in a plot: several periods of a usual texture
BLOCK = 1 << 18  # frames rendered at a time
NO_PLOTS = "cannot plot: matplotlib is not installed. Run: pip install 'ridgewave[plots]'."


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Sound:
    """A finite sound.

    Attributes:
        frames: samples in units of `full_scale`, float32 [frames, channels]. They are not limited and may exceed 1.
        sample_rate: frames per second.
        full_scale: SI value of a sample of 1.0, one per channel.
        quantities: quantity of each channel, such as "acceleration".
        scene: the rendered scene.
        warnings: sentences that a user should read before listening.
        plan: what was simulated, with its error; None for a sound from a service.

    Example:
        sound = synth.render({"texture": {"period": "0.6 mm"}})
        print(sound, sound.values[:, 0].max(), sound.units[0])
        sound.save("fine.wav")
    """

    frames: npt.NDArray[np.float32]
    sample_rate: int
    full_scale: tuple[float, ...]
    quantities: tuple[str, ...]
    scene: SceneLike
    warnings: tuple[str, ...] = ()
    plan: Plan | None = None

    @property
    def seconds(self) -> float:
        """The duration, s."""
        return len(self.frames) / self.sample_rate

    @property
    def values(self) -> Real:
        """The samples in SI units, float64 [frames, channels]."""
        return np.multiply(self.frames, np.asarray(self.full_scale, dtype=np.float64))

    @property
    def units(self) -> tuple[str, ...]:
        """The SI unit of each channel."""
        return tuple(unit_of(quantity) for quantity in self.quantities)

    def spectrum(self) -> tuple[Real, Real]:
        """Return the frequencies (Hz, [lines]) and the peak amplitudes (SI, [lines, channels]) of the whole sound.

        The mean is subtracted, and a Hann window is applied. The line of a sinusoid has the sinusoid's amplitude, or up
        to 1.4 dB less if its frequency is between two lines.
        """
        values = self.values - self.values.mean(axis=0) if len(self.frames) else self.values
        window = np.hanning(len(values))
        lines = np.abs(np.fft.rfft(values * window[:, np.newaxis], axis=0)) if len(values) else values
        frequencies = np.fft.rfftfreq(max(1, len(values)), 1.0 / self.sample_rate).astype(np.float64)
        return frequencies, np.asarray(2.0 * lines / max(1.0, float(window.sum())), np.float64)

    def save(self, path: str | Path, subtype: str | None = None) -> Path:
        """Write a sound file that contains the full scale and the scene, and return its path.

        path: ends in .wav, .flac, .raw, .f32, .pcm or .l16. An existing file is replaced.
        subtype: "float", "pcm16" or "pcm24", if the ending allows several. For integers the sound first passes the
            safety limiter, because integers clip.
        Raises InvalidRequest for another ending or subtype, and CannotRender if the file cannot be written.
        """
        from synth.encode.formats import Metadata, choose_format, open_writer
        from synth.scene.scene import scene_document, scene_from
        from synth.voice.limiter import Limiter

        target = Path(path)
        sound_format = choose_format(target, subtype)
        frames = self.frames
        channels = frames.shape[1]
        if not sound_format.is_float:
            frames = Limiter(channels, self.sample_rate).process(frames)
        metadata = Metadata(self.full_scale, self.quantities, scene_document(scene_from(self.scene)))
        with open_writer(target, sound_format, self.sample_rate, channels, metadata, frames=len(frames)) as writer:
            writer.write(frames)
        return target

    def plot(self) -> Any:
        """Return a matplotlib figure: the first 50 ms of each channel, and its spectrum. Needs the extra `plots`."""
        try:
            from matplotlib.figure import Figure
        except ImportError as error:
            raise CannotRender(NO_PLOTS) from error
        figure = Figure(figsize=(9.0, 2.6 * len(self.quantities)), layout="constrained")
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
        values = self.values
        peaks = np.abs(values).max(axis=0, initial=0.0)
        channels = [
            f"{quantity} peak {peak:.3g} {unit} (full scale {scale:.3g})"
            for quantity, peak, unit, scale in zip(self.quantities, peaks, self.units, self.full_scale, strict=True)
        ]
        return f"<Sound of {self.seconds:.6g} s at {self.sample_rate} Hz: {', '.join(channels)}>"


def render(scene: SceneLike, *, cache: ResponseCache | None = None) -> Sound:
    """Render the whole duration of a scene and return a `Sound`.

    scene: a Scene, a mapping, the path of a JSON file, or a name of the catalogue.
    cache: responses solved before; by default those of this process.
    Source: Fagiani & Barbieri (2016), eqs 1-5.
    Raises SceneError for an invalid scene, and for one whose contact cannot be solved.

    Example: synth.render("grating-1mm-31um").save("coarse.wav")
    """
    from synth.scene.scene import scene_from
    from synth.voice.voice import blocks, open_voice

    voice = open_voice(scene_from(scene), cache=cache)
    frames = [np.empty((0, voice.channels), np.float32), *blocks(voice, BLOCK)]
    return Sound(
        frames=np.concatenate(frames),
        sample_rate=voice.sample_rate,
        full_scale=voice.full_scale,
        quantities=voice.quantities,
        scene=voice.scene,
        warnings=voice.warnings,
        plan=voice.plan,
    )
