"""Every error that ridgewave raises passes between processes whole: its message and its fields."""

from __future__ import annotations

import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from typing import Any

import numpy as np
import pytest

import clients
import ridgewave as rw
from clients.client_errors import Problem
from synth.errors import Fault, InvalidRequest, RidgewaveError
from tests.test_layers import ROOMS, module_name, sources

FAULT = Fault("/texture/period", "-1 m", "1 um to 1 m", "Write at least 1 um.")
PROBLEM = Problem("about:blank#problem-full", "Full", 503, "No room.", (FAULT,), "/v1/render")
REFUSED: list[Any] = [{"scan": {"load": -1}}, {"texture": {"kind": "no-such"}}, {}, {"finger": 3}]


def kinds_below(kind: type[RidgewaveError]) -> list[type[RidgewaveError]]:
    return [kind, *(one for below in kind.__subclasses__() for one in kinds_below(below))]


def every_kind() -> list[type[RidgewaveError]]:
    """Return every subclass in the source, after the modules that define one are loaded."""
    for room in ROOMS:
        for path in sources(room):
            if "Error" in path.read_text("utf-8") or "CannotRender" in path.read_text("utf-8"):
                name = module_name(path)
                if "__main__" not in name and not name.startswith("clients.commands.import"):
                    import_module(name)
    return sorted({kind for kind in kinds_below(RidgewaveError) if kind.__module__.split(".")[0] in ROOMS}, key=str)


def made(kind: type[RidgewaveError]) -> RidgewaveError:
    """Return an error of `kind` with arguments of the form that it takes."""
    samples = np.ones((3, 2), np.float32)
    forms: list[tuple[Any, ...]] = [
        ("slow reader", 17, PROBLEM, samples),
        (PROBLEM, 2.5),
        ([FAULT, FAULT],),
        ("a reason",),
        ("closing", "a detail"),
    ]
    if issubclass(kind, clients.StreamEnded):
        return kind(*forms[0])
    if issubclass(kind, clients.ProblemError):
        return kind(*forms[1])
    if issubclass(kind, InvalidRequest):
        return kind(*forms[2])
    return kind(*forms[3])


@pytest.mark.parametrize("kind", every_kind(), ids=lambda kind: kind.__name__)
def test_an_error_is_the_same_after_a_pickle(kind: type[RidgewaveError]) -> None:
    error = made(kind)
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
        again = pickle.loads(pickle.dumps(error, protocol))
        assert type(again) is kind and str(again) == str(error) and again.args == error.args
        assert again.__dict__.keys() == error.__dict__.keys()
        for name, value in error.__dict__.items():
            np.testing.assert_equal(again.__dict__[name], value)


def test_every_public_error_is_among_them() -> None:
    public = {value for name in rw.__all__ if isinstance(value := getattr(rw, name), type)}
    assert {kind for kind in public if issubclass(kind, BaseException)} - {rw.RenderWarning} <= set(every_kind())


@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_a_sweep_with_refused_scenes_gives_its_errors(start: str) -> None:
    context = multiprocessing.get_context(start)
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        futures = [pool.submit(rw.parse_scene, scene) for scene in REFUSED]
        errors = [future.exception(timeout=120) for future in futures]
    assert [type(error) for error in errors] == [rw.SceneError, rw.SceneError, type(None), rw.SceneError]
    assert isinstance(errors[0], rw.SceneError) and errors[0].faults[0].pointer == "/scan/load"
    with context.Pool(1) as plain, pytest.raises(rw.SceneError, match=r"scan\.load"):
        plain.map_async(rw.parse_scene, REFUSED).get(timeout=120)
