"""A folder of small files in the forms that spreadsheets, styluses, microscopes and material libraries write.

`python -m tests.synth.surfaces.readers.usual_files FOLDER` writes them, and prints what each is.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

STEP = 125e-6  # m
X = tuple(0.125 * place for place in range(8))  # mm
Z = (1.5, -2.25, 0.5, 3.75, -1.0, 0.0, 2.5, -0.25)  # um
GRID = ((1.5, -2.25, 0.5, 3.75), (-1.0, 0.0, 2.5, -0.25), (4.0, 1.25, -3.5, 0.75))  # um, rows along x


@dataclass(frozen=True)
class UsualFile:
    """A file that a program writes, and what an import has to make of it.

    name: of the file.
    writer: the program or the standard with this form.
    content: the whole file.
    options: of the import, beside those that the file states.
    heights: um, by the arithmetic of this table; None where the file is refused.
    spacing: m, along x, then along y.
    shows: words of the printed report.
    refusal: words of the message of a file that is refused.
    within: permitted difference of the heights, relative to their range.
    step_within: permitted difference of the spacing, relative to it.
    """

    name: str
    writer: str
    content: bytes
    heights: Any = None
    spacing: tuple[float, ...] = (STEP,)
    options: dict[str, str] = field(default_factory=dict)
    shows: tuple[str, ...] = ()
    refusal: str = ""
    within: float = 1e-9
    step_within: float = 1e-9

    @property
    def wanted(self) -> np.ndarray[Any, Any]:
        """The heights about their mean, m."""
        values = np.asarray(self.heights, float)
        return np.asarray(1e-6 * (values - values.mean()))


def usual_files() -> list[UsualFile]:
    """Return every file, in groups: profiles and grids as text, pictures, arrays, and files that are refused."""
    from tests.synth.surfaces.readers.refused_files import REFUSED
    from tests.synth.surfaces.readers.refused_headers import REFUSED_HEADERS
    from tests.synth.surfaces.readers.usual_arrays import ARRAYS
    from tests.synth.surfaces.readers.usual_grids import GRIDS
    from tests.synth.surfaces.readers.usual_headers import HEADERS
    from tests.synth.surfaces.readers.usual_numbers import NUMBERS
    from tests.synth.surfaces.readers.usual_pictures import PICTURES
    from tests.synth.surfaces.readers.usual_profiles import PROFILES
    from tests.synth.surfaces.readers.usual_spreadsheets import SPREADSHEETS

    return [*SPREADSHEETS, *PROFILES, *NUMBERS, *GRIDS, *HEADERS, *PICTURES, *ARRAYS, *REFUSED, *REFUSED_HEADERS]


def main(folder: Path) -> None:
    """Write every file into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    for one in usual_files():
        (folder / one.name).write_bytes(one.content)
        print(f"{one.name:40} {'refused' if one.refusal else 'read':8} {one.writer}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
