"""The exception tree of ridgewave.

    RidgewaveError
    ├── InvalidRequest  the request is at fault: it names each field, its value, what is allowed and what to write
    │   └── SceneError  the same, for a scene
    └── CannotRender    the request is fine but cannot be carried out here; `reason` is a sentence for the user
        └── NameTaken   there is something under that name already, and it is not overwritten

What is neither is our bug: an AssertionError or any other exception. A peer learns only that it is ours.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing that is wrong in a request.

    pointer: RFC 6901 JSON pointer of the field, such as "/texture/period"; "" is the whole document.
    value: what was given, as text that is safe to print (shortened, NaN and infinities spelt out).
    allowed: what is allowed, with its unit, such as "0.000001 m to 1 m".
    hint: what to write instead.
    """

    pointer: str
    value: str
    allowed: str
    hint: str

    def sentence(self) -> str:
        """Return the fault as one sentence for a person."""
        field = self.pointer.lstrip("/").replace("/", ".") or "the request"
        return f"{field}: got {self.value}; allowed: {self.allowed}. {self.hint}"


class RidgewaveError(Exception):
    """Base of everything that ridgewave raises on purpose."""


class InvalidRequest(RidgewaveError):
    """The request is at fault. `faults` lists every fault found, not only the first."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(fault.sentence() for fault in self.faults))


class SceneError(InvalidRequest):
    """The scene is at fault."""


class CannotRender(RidgewaveError):
    """A sound request that cannot be carried out; `reason` says why and what to do."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(reason)


class NameTaken(CannotRender):
    """There is something under that name already, and it is not overwritten."""


def shown(value: Any, limit: int = 60) -> str:
    """Return `value` as short printable text for a `Fault`; `limit` is the largest number of characters.

    However large the value, no more of it is looked at than is shown.
    """
    text = ""
    for piece in _pieces(value, limit):
        text += piece
        if len(text) > limit:
            return text[: limit - 3] + "..."
    return text


def _pieces(value: Any, limit: int) -> Iterator[str]:
    """Yield the parts of `repr(value)`; of a longer string than `limit`, that much."""
    if type(value) is str:
        yield repr(value[: limit + 1])
    elif isinstance(value, dict):
        yield "{"
        for number, (key, item) in enumerate(value.items()):
            yield ", " if number else ""
            yield from _pieces(key, limit)
            yield ": "
            yield from _pieces(item, limit)
        yield "}"
    elif type(value) is list:
        yield "["
        for number, item in enumerate(value):
            yield ", " if number else ""
            yield from _pieces(item, limit)
        yield "]"
    else:
        yield repr(value)
