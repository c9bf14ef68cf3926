"""Many scenes at once (`sweep`), what is felt of one (`analyze`), and measurements beside the model (`compare`)."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ridgewave.scenes import parse_scene
from service.store.own_textures import study_with_imported
from synth.errors import Fault, InvalidRequest, shown
from synth.scene.scene import scene_document

if TYPE_CHECKING:
    import numpy.typing as npt
    from xarray import Dataset

    from ridgewave.scenes import SceneSource
    from synth.encode.sound import Sound
    from synth.study.comparison import Comparison


def sweep(
    scene: SceneSource,
    axes: Mapping[str, Any],
    *,
    sample: Mapping[str, Any] | None = None,
    phases: int = 256,
    lines: int = 32,
    skin: bool = False,
    most_scenes: int | None = None,
    textures: Mapping[str, Any] | None = None,
    parts: str | os.PathLike[str] | None = None,
    workers: int | None = 1,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Dataset:
    """Return the vibration of many steady scenes as one labelled dataset (docs/study.md).

    scene: as `parse_scene`; the axes change it.
    axes: values of fields ("texture.period", "scan.load") or of groups ("groups.period_ratio"): lists, arrays, or
        ranges {"from": "0.1 mm", "to": "10 mm", "count": 50, "spacing": "log"}.
    sample: None for every combination; {"kind": "latin_hypercube" or "sobol", "count": n, "seed": 0};
        {"kind": "saltelli", "count": n}: n (axes + 2) scenes for Sobol indices; or {"kind": "points"}: scene n has the
        nth value of every axis.
    phases: solutions per period, a power of two; the error that they leave is in the dataset.
    lines: recorded lines of the spectrum.
    skin: whether what the receptors of the skin feel is recorded, too.
    most_scenes: largest number of scenes; None for 200,000.
    textures: textures with names of this study, for an axis "texture.kind".
    parts: folder that keeps finished chunks, from which an interrupted sweep goes on; None keeps none.
    workers: processes; None for one a processor. With more than 1, a script needs `if __name__ == "__main__"`.
    scheduler: address of a Dask scheduler, in place of processes.
    progress: called with the number of scenes done, and of all.
    Raises SceneError for a study that is invalid, with every fault; CannotRender without the extra `study`.

    Example: rw.sweep({}, {"texture.period": ["0.4 mm", "0.8 mm"], "scan.load": [0.1, 0.3]}).rms
    """
    from synth.study.dataset import dataset_of, needed, numbers_of
    from synth.study.running import run
    from synth.study.spec import read_spec

    if workers is not None and workers < 1:
        hint = "Write 1 for this process, or None for one a processor."
        raise InvalidRequest([Fault("/workers", shown(workers), "a whole number from 1, or None", hint)])
    needed("xarray")
    document = {"scene": scene_document(parse_scene(scene)), "axes": axes, "sample": sample, "textures": textures}
    asked = {"phases": phases, "lines": lines, "skin": skin, "most_scenes": most_scenes}
    spec = read_spec(study_with_imported(document | asked))
    with tempfile.TemporaryDirectory(prefix="ridgewave-study-") as own:
        folder = Path(own if parts is None else parts)
        run(spec, folder, workers=workers, scheduler=scheduler, progress=progress)
        return dataset_of(spec, numbers_of(spec, folder))


def analyze(
    source: SceneSource | Sound | npt.NDArray[Any],
    *,
    quantity: str | None = None,
    rate: float | None = None,
    scale: float | None = None,
    column: str | None = None,
    channel: int | None = None,
    **fields: Any,
) -> dict[str, Any]:
    """Return what is felt of a steady scene, by the whole finger and by the skin under its ridges, or of a vibration.

    source, fields: a scene, as `parse_scene`; or a vibration, as a recording of `compare` (docs/study.md).
    quantity, rate, scale, column, channel: of a vibration, as of `compare`; its scale must be known.
    The result has `whole_finger_level` (dB over the detection threshold, None where nothing moves), `receptors` (SA1,
    RA, PC: depth in m, strain, drive in 1/s, power, level in dB, frequency in Hz, of SA1 the wavelength in m, and the
    number of components that are felt), `pacinian_power`, `intensity` and `spatial_variation` (in thresholds) and
    `felt_by`. Of a vibration there is no SA1 and no spatial variation.
    Raises SceneError for a scan that is not steady, a texture over an area, effects that are simulated, and some
    thousand periods of the finer surface under the finger; InvalidRequest for a vibration that cannot be read, or
    whose scale or quantity is unknown.

    Example: rw.analyze("grating-1mm-31um", finger={"kind": "fingertip"})["felt_by"]
    """
    import numpy as np

    from synth.encode.sound import Sound
    from synth.study.recordings import is_recording, recording_of
    from synth.study.skin_outcome import skin_felt
    from synth.study.sound_outcome import sound_felt

    if isinstance(source, Sound | np.ndarray) or (isinstance(source, str | os.PathLike) and is_recording(source)):
        if fields:
            hint = "Leave it out: a recording is as it is."
            raise InvalidRequest([Fault(f"/{next(iter(fields))}", "set", "nothing with a recording", hint)])
        known = recording_of(source, "sound", column=column, channel=channel, rate=rate, scale=scale)
        return sound_felt(known, quantity)
    told = {"quantity": quantity, "rate": rate, "scale": scale, "column": column}
    for name in (name for name, value in told.items() if value is not None):
        raise InvalidRequest([Fault(f"/{name}", shown(told[name]), "nothing with a scene", "Leave it out.")])
    return skin_felt(parse_scene(source, **fields))


def told_apart(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, Any]:
    """Return whether two results of `analyze` are told apart, by just-noticeable differences (docs/study.md).

    The result has `verdict` ("told apart", "not told apart" or "open"), `level_db` (intensity of the second over the
    first) and `frequency` (of the strongest line, second over first, less 1); None where one does not vibrate.

    Example: rw.told_apart(rw.analyze("grating-1mm-31um"), rw.analyze("grating-800um-40um"))["verdict"]
    """
    from synth.perception.discrimination import beside

    return beside(dict(first), dict(second))


def compare(
    scene: SceneSource,
    *recordings: str | os.PathLike[str] | Sound | npt.ArrayLike,
    quantity: str | None = None,
    rate: float | None = None,
    scale: float | None = None,
    column: str | None = None,
    channel: int | None = None,
) -> list[Comparison]:
    """Return measured vibrations beside the model's, line by line (docs/compare.md).

    scene: as `parse_scene`, with the speed and the load of the measurement.
    recordings: WAV, FLAC, CSV or Parquet files, sounds, or arrays of one channel.
    quantity: displacement, velocity or acceleration, where a recording does not say it.
    rate: Hz, of an array or of a table without times.
    scale: SI value of a sample of 1; None: that of the file, or unknown, and then one gain is fitted. An array is SI.
    column, channel: of a table, and of a sound; of several channels 0 is read, with a warning, where none is named.
    Each result has `speed` (the one that fits, m/s), `gain` (dB or None), `lines`, `warnings` and `document()`.
    Raises InvalidRequest for what cannot be compared, SceneError for the scene.

    Example: rw.compare({}, rw.render({}, output={"duration": "1 s"}))[0].speed
    """
    from synth.study.comparison import compared
    from synth.study.recordings import quantity_of, recording_of

    checked, found = parse_scene(scene), []
    for number, one in enumerate(recordings):
        name = f"recording {number + 1}"
        known = recording_of(one, name, column=column, channel=channel, rate=rate, scale=scale)
        said = quantity_of(known, quantity)
        values, told = known.values, known.warnings
        found.append(compared(checked, values, known.rate, said, known.name, scaled=known.scaled, told=told))
    return found
