"""The house's rule: imports go upstream only, between the rooms and between the stages of `synth`.

Reads the source with `ast`, so imports inside functions and under TYPE_CHECKING count too: knowing a type is knowing.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

ROOMS = ("synth", "service", "clients", "ridgewave")
"""From upstream to downstream: a room imports itself and the rooms before it."""

STAGES: tuple[tuple[str, ...], ...] = (
    (
        "errors",
        "arrays",
        "linear_algebra",
        "kernel_folders",
        "kernel_cache",
        "kernels",
        "kept_files",
        "held_memory",
        "response_cache",
    ),
    ("scene", "scene.*"),
    ("surfaces", "surfaces.*"),
    ("contact", "contact.*"),
    ("response", "response.*"),
    ("motion", "motion.*"),
    ("sampling", "sampling.*"),
    ("perception", "perception.*"),
    ("effects", "effects.effect", "effects.simulation", "effects.simulation.*"),
    ("plan", "plan.*"),
    ("voice", "voice.*"),
    ("effects.*",),
    ("encode", "encode.*"),
    ("accuracy", "accuracy.*"),
    ("study", "study.*"),
)
"""The stages of `synth`, in the order the data meets them: a module imports its own stage and those before it."""

KEPT_OUT = {
    "synth": {"fastapi", "starlette", "uvicorn", "sounddevice", "httpx", "rich", "argparse"},
    "service": {"rich", "argparse"},
    "clients": {"fastapi", "starlette", "uvicorn", "sounddevice", "numba", "scipy"},
    "ridgewave": {"fastapi", "starlette", "uvicorn", "sounddevice", "numba", "scipy", "rich", "argparse"},
}
"""What a room has no business with: the network and devices are the service's, terminals are the clients'."""

START_UP = (
    "clients/__init__.py",
    "clients/__main__.py",
    "clients/command_line/__init__.py",
    "clients/command_line/command_arguments.py",
    "clients/command_line/help_examples.py",
    "clients/command_line/parser.py",
    "clients/command_line/shared_arguments.py",
)
"""What every run of the command line reads, `ridgewave --help` too: at module level, argparse and the like only."""
START_UP_IMPORTS = {"__future__", "argparse", "collections", "gc", "os", "textwrap", "typing", "clients"}


def sources(room: str) -> list[Path]:
    return sorted(path for path in (ROOT / room).rglob("*.py") if "__pycache__" not in path.parts)


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Yield what `tree` imports, with line numbers; `from a import b` counts as a.b, which may be a module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno}: write the import in full, from the room down"
            yield from ((f"{node.module}.{alias.name}", node.lineno) for alias in node.names)


@cache
def imports_of(path: Path) -> list[tuple[str, int]]:
    return list(imported(ast.parse(path.read_text("utf-8"), str(path))))


def stage_of(name: str) -> int | None:
    """Return the place in STAGES of `name`, dotted and without "synth."; None where no stage has it."""
    for place, patterns in enumerate(STAGES):
        if any(fnmatchcase(name, pattern) for pattern in patterns):
            return place
    return None


def stage_of_import(name: str) -> int | None:
    """Return the stage of an imported "a.b", where b may be a module or a name in the module a."""
    path = ROOT / "synth" / name.replace(".", "/")
    return stage_of(name if path.is_dir() or path.with_suffix(".py").is_file() else name.rpartition(".")[0])


def test_every_room_is_there() -> None:
    assert all(sources(room) for room in ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_import_upstream_only(room: str) -> None:
    downstream = ROOMS[ROOMS.index(room) + 1 :]
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {name}"
        for path in sources(room)
        for name, line in imports_of(path)
        if name.split(".")[0] in (*downstream, "tests")
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_keeps_out_of_what_is_not_its_business(room: str) -> None:
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {name}"
        for path in sources(room)
        for name, line in imports_of(path)
        if name.split(".")[0] in KEPT_OUT[room]
    ]
    assert not wrong, "\n".join(wrong)


def test_every_module_of_synth_has_a_stage() -> None:
    names = [module_name(path).removeprefix("synth").lstrip(".") for path in sources("synth")]
    strays = [name for name in names if name and stage_of(name) is None]
    assert not strays, f"give these a place in STAGES of tests/test_layers.py: {', '.join(strays)}"


def test_stages_of_synth_import_earlier_stages_only() -> None:
    wrong = []
    for path in sources("synth"):
        own = module_name(path).removeprefix("synth").lstrip(".")
        if not own:
            continue  # synth/__init__.py is the front door: it names the stages and passes them on
        for name, line in imports_of(path):
            if name.split(".")[0] != "synth":
                continue
            theirs, mine = stage_of_import(name.removeprefix("synth").lstrip(".")), stage_of(own)
            assert mine is not None
            if theirs is None or theirs > mine:
                wrong.append(f"{path.relative_to(ROOT)}:{line} imports {name}, a later stage")
    assert not wrong, "\n".join(wrong)


def test_modules_of_a_stage_do_not_import_in_a_circle() -> None:
    modules = {module_name(path): path for room in ROOMS for path in sources(room)}
    edges: dict[str, set[str]] = {name: set() for name in modules}
    for name, path in modules.items():
        for target, _ in imports_of(path):
            owner = target if target in modules else target.rpartition(".")[0]
            if owner in modules and owner != name:
                edges[name].add(owner)
    settled: set[str] = set()
    while ready := {name for name, targets in edges.items() if name not in settled and targets <= settled}:
        settled |= ready
    assert settled == set(edges), f"a circle among {sorted(set(edges) - settled)}"


@pytest.mark.parametrize("name", START_UP)
def test_start_up_imports_nothing_heavy_at_module_level(name: str) -> None:
    tree = ast.parse((ROOT / name).read_text("utf-8"))
    heavy = [
        f"line {line}: {module}"
        for node in tree.body
        for module, line in imported(ast.Module([node], []))
        if isinstance(node, ast.Import | ast.ImportFrom) and module.split(".")[0] not in START_UP_IMPORTS
    ]
    assert not heavy, heavy
