"""The figures of `ridgewave study`, each drawn from the dataset alone. Needs the extras `plots` and `study`.

curves        rms and level over the longest axis: the usual figure
period_ratio  response over Lambda, beside the sinc law
collapse      dimensional scenes, and the same on the groups
sensitivity   Sobol indices of a study with the sample `saltelli`
duplex        by what each period is felt
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from synth.encode.part_file import check_folder
from synth.errors import CannotRender, Fault, InvalidRequest

if TYPE_CHECKING:
    from collections.abc import Sequence

    from xarray import Dataset

    from synth.study.spec import StudySpec

FIGURES, USUAL = ("curves", "period-ratio", "collapse", "sensitivity", "duplex"), "curves"
ENDINGS = (".svg", ".png", ".pdf")


def check_figure(name: str | None, paths: Sequence[str]) -> None:
    """Raise InvalidRequest for an unknown figure or ending, CannotRender where `paths` need the extra `plots`."""
    if name is not None and name not in FIGURES:
        raise InvalidRequest([Fault("/figure", name, f"one of {', '.join(FIGURES)}", "Check the spelling.")])
    for path in paths:
        if Path(path).suffix.lower() not in ENDINGS:
            allowed = f"a name that ends in {', '.join(ENDINGS)}"
            raise InvalidRequest([Fault("/figure", path, allowed, "Write map.svg.")])
        check_folder(Path(path), "/figure")
    try:
        if paths:
            import_module("matplotlib")
    except ModuleNotFoundError:
        raise CannotRender("A figure needs matplotlib: pip install 'ridgewave[plots]'.") from None


def draw(found: Dataset, paths: Sequence[str]) -> None:
    """Draw the figure that the dataset names, or the usual one. Raises InvalidRequest where it lacks what is drawn."""
    import matplotlib

    from clients.figure_look import LOOK, save

    module = _checked(found)
    with matplotlib.rc_context(LOOK):
        figure = module.drawn(found)
    for path in paths:
        save(figure, Path(path))


def check_study(spec: StudySpec) -> None:
    """Raise InvalidRequest where the figure of a study cannot be drawn, before anything is solved."""
    from synth.study.dataset import blank

    _checked(blank(spec))


def _checked(found: Dataset) -> Any:
    """Return the module that draws a dataset."""
    name = str(found.attrs.get("figure", USUAL))
    check_figure(name, ())
    module = import_module(f"clients.study_figures.{name.replace('-', '_')}")
    module.check(found)
    return module


def cannot_draw(name: str, needs: str) -> NoReturn:
    """Raise InvalidRequest: the study has not what the figure `name` needs."""
    ready = f"See `ridgewave study {name} --print`, or leave `figure` out of the spec."
    hint = "Write another axis, or leave --figure out." if name == USUAL else ready
    raise InvalidRequest([Fault("/figure", name, f"a study with {needs}", hint)])
