"""Compiled kernels: kernels older than their sources are deleted, and Python calls only those that it can call."""

from __future__ import annotations

import ast
import os
from pathlib import Path

import synth
from synth.kernels import forget_stale_kernels


def made(folder: Path, stamps: dict[str, float]) -> None:
    """Make empty files in `folder` with the given modification times (s)."""
    for name, stamp in stamps.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
        os.utime(path, (stamp, stamp))


def left(folder: Path) -> set[str]:
    forget_stale_kernels(folder, ("contact", "voice", "absent"))
    return {index.name for index in folder.rglob("*.nbi")}


def test_kernels_older_than_the_newest_source_that_they_may_call_are_forgotten(tmp_path: Path) -> None:
    indexes = {f"{folder}__pycache__/{age}-{folder[:-1]}.nbi": stamp
               for folder in ("", "contact/", "voice/") for age, stamp in (("old", 2000), ("new", 4000))}  # fmt: skip
    made(tmp_path, {"contact/one.py": 1000, "voice/two.py": 3000, **indexes})
    assert left(tmp_path) == {"new-.nbi", "new-contact.nbi", "new-voice.nbi"}


def test_sources_without_kernels_are_no_fault(tmp_path: Path) -> None:
    made(tmp_path, {"contact/one.py": 1000})
    assert left(tmp_path) == set()


def test_sources_from_the_future_say_nothing(tmp_path: Path) -> None:
    made(tmp_path, {"contact/one.py": 1e11, "contact/__pycache__/one.nbi": 1000})
    assert left(tmp_path) == {"one.nbi"}


INNER = {"inner", "inlined", "summing", "unfused"}
COMPILED = INNER | {"kernel", "signed_kernel", "overload"}


def decorators(function: ast.FunctionDef) -> set[str]:
    """Return the names that decorate a function."""
    called = (one.func if isinstance(one, ast.Call) else one for one in function.decorator_list)
    return {one.id for one in called if isinstance(one, ast.Name)}


def functions_of(nodes: list[ast.AST]) -> list[ast.FunctionDef]:
    return [node for node in nodes if isinstance(node, ast.FunctionDef)]


def test_python_calls_no_inner_function() -> None:
    """An inner function has no wrapper for Python: a call from Python would end the process."""
    paths = Path(synth.__path__[0]).rglob("*.py")
    trees = {path: list(ast.walk(ast.parse(path.read_text("utf-8")))) for path in paths}
    inner = {
        f"synth.{'.'.join(path.relative_to(synth.__path__[0]).with_suffix('').parts)}": {
            function.name for function in functions_of(nodes) if decorators(function) & INNER
        }
        for path, nodes in trees.items()
    }
    assert "newton" in inner["synth.contact.exact_solver"]
    for path, nodes in trees.items():
        known = set(inner[f"synth.{'.'.join(path.relative_to(synth.__path__[0]).with_suffix('').parts)}"])
        for node in nodes:
            if isinstance(node, ast.ImportFrom) and node.module in inner:
                known |= {one.name for one in node.names} & inner[node.module]
        for function in functions_of(nodes) if known else ():
            if not decorators(function) & COMPILED:
                names = {node.func.id for node in ast.walk(function)
                         if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}  # fmt: skip
                assert not names & known, f"{path.name}: {function.name} calls {names & known}"
