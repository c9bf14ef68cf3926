"""Many scenes at once (`sweep`), what is felt of one (`analyze`), and measurements beside the model (`compare`)."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ridgewave.scenes import parse_scene
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
    parts: str | os.PathLike[str] | None = None,
    workers: int | None = 1,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Dataset:
    """Return the vibration of many steady scenes as one labelled dataset (docs/study.md).

    scene: as `parse_scene`; the axes change it.
    axes: values of fields ("texture.period", "scan.load") or of groups ("groups.period_ratio"): lists, arrays, or
        ranges {"from": "0.1 mm", "to": "10 mm", "count": 50, "spacing": "log"}.
    sample: None for every combination, or {"kind": "latin_hypercube" or "sobol", "count": n, "seed": 0}.
    phases: solutions per period, a power of two; the error that they leave is in the dataset.
    lines: recorded lines of the spectrum.
    skin: whether what the receptors of the skin feel is recorded, too.
    most_scenes: largest number of scenes; None for 200,000.
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

    needed("xarray")
    document = {"scene": scene_document(parse_scene(scene)), "axes": axes, "sample": sample}
    spec = read_spec({**document, "phases": phases, "lines": lines, "skin": skin, "most_scenes": most_scenes})
    with tempfile.TemporaryDirectory(prefix="ridgewave-study-") as own:
        folder = Path(own if parts is None else parts)
        run(spec, folder, workers=workers, scheduler=scheduler, progress=progress)
        return dataset_of(spec, numbers_of(spec, folder))


def analyze(scene: SceneSource, **fields: Any) -> dict[str, Any]:
    """Return what is felt of a steady scene: by the whole finger, and by the skin under its ridges (docs/study.md).

    scene, fields: as `parse_scene`.
    The result has `whole_finger_level` (dB over the detection threshold, None where nothing moves), `receptors` (SA1,
    RA, PC: depth in m, strain, power, level in dB, and frequency in Hz, of SA1 the wavelength in m), `pacinian_power`,
    `intensity` (in thresholds) and `felt_by`.
    Raises SceneError for a scan that is not steady, a texture over an area, and effects that are simulated.

    Example: rw.analyze("grating-1mm-31um", finger={"kind": "fingertip"})["felt_by"]
    """
    from synth.study.skin_outcome import skin_felt

    return skin_felt(parse_scene(scene, **fields))


def compare(
    scene: SceneSource,
    *recordings: str | os.PathLike[str] | Sound | npt.ArrayLike,
    quantity: str | None = None,
    rate: float | None = None,
    scale: float | None = None,
    column: str | None = None,
    channel: int = 0,
) -> list[Comparison]:
    """Return measured vibrations beside the model's, line by line (docs/compare.md).

    scene: as `parse_scene`, with the speed and the load of the measurement.
    recordings: WAV, FLAC, CSV or Parquet files, sounds, or arrays of one channel.
    quantity: displacement, velocity or acceleration, where a recording does not say it.
    rate: Hz, of an array or of a table without times.
    scale: SI value of a sample of 1; None: that of the file, or unknown, and then one gain is fitted. An array is SI.
    column, channel: of a table, and of a sound.
    Each result has `speed` (the one that fits, m/s), `gain` (dB or None), `lines`, `warnings` and `document()`.
    Raises InvalidRequest for what cannot be compared, SceneError for the scene.

    Example: rw.compare({}, rw.render({}, output={"duration": "1 s"}))[0].speed
    """
    import numpy as np

    from synth.encode.sound import Sound
    from synth.errors import Fault, InvalidRequest
    from synth.study.comparison import compared
    from synth.study.recordings import Recording, read_recording

    checked, found = parse_scene(scene), []
    for number, one in enumerate(recordings):
        if isinstance(one, str | os.PathLike):
            known = read_recording(Path(one), column=column, channel=channel, rate=rate, scale=scale)
        elif isinstance(one, Sound):
            values = np.asarray(one.values[:, channel], np.float64)
            known = Recording(f"sound {number + 1}", values, float(one.sample_rate), one.quantities[channel], True)
        else:
            if rate is None:
                raise InvalidRequest([Fault("/rate", "none", "the rate of an array, Hz", "Write rate=10000.")])
            known = Recording(f"array {number + 1}", np.asarray(one, np.float64) * (scale or 1.0), rate, "", True)
        said = quantity or known.quantity
        found.append(compared(checked, known.values, known.rate, said, known.name, scaled=known.scaled))
    return found
