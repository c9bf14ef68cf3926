"""Compiled kernels: Python calls only those that it can call."""

from __future__ import annotations

import ast
from pathlib import Path

import synth

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
