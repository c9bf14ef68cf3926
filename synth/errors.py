"""The exception tree of ridgewave.

    RidgewaveError
    ├── InvalidRequest  the request is invalid; lists each field, its value, what is allowed and what to write
    │   └── SceneError  the scene is invalid
    └── CannotRender    the request is valid but cannot be carried out; `reason` is a sentence for the user
        └── NameTaken   the name exists already and is not overwritten

They can be pickled, so that they pass between processes. RenderWarning is a warning, not an error.

Any other exception, such as an AssertionError, is a bug in ridgewave. A remote client learns only that it is a bug.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault of a request.

    pointer: JSON pointer (RFC 6901) of the field, such as "/texture/period"; "" is the whole document.
    value: the given value, as text that is safe to print (shortened, NaN and infinities spelt out).
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
    """Base class of all errors that ridgewave raises on purpose."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make the error again from its message and its fields, whatever arguments its class takes."""
        return _made_again, (type(self), self.args), self.__dict__


def _made_again(kind: type[RidgewaveError], message: tuple[Any, ...]) -> RidgewaveError:
    """Return an error of `kind` with `message`, without its fields, which pickle adds."""
    error = kind.__new__(kind)
    error.args = message
    return error


class RenderWarning(UserWarning):
    """A doubt about a sound or a file that a person should read before using it."""


class InvalidRequest(RidgewaveError):
    """The request is invalid. `faults` lists every fault, not only the first."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(fault.sentence() for fault in self.faults))


class SceneError(InvalidRequest):
    """The scene is invalid."""


class CannotRender(RidgewaveError):
    """A valid request cannot be carried out. `reason` states why and what to do."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(reason)


class NameTaken(CannotRender):
    """The name exists already and is not overwritten."""


def shown(value: Any, limit: int = 60) -> str:
    """Return `value` as printable text of at most `limit` characters, for a `Fault`.

    Only the part that is shown is converted to text, so that a large value costs little time.
    """
    text = ""
    for piece in _pieces(value, limit):
        text += piece
        if len(text) > limit:
            return text[: limit - 3] + "..."
    return text


def _pieces(value: Any, limit: int) -> Iterator[str]:
    """Yield the parts of `repr(value)`, with null, true and false as a scene has them. A long string is cut."""
    if value is None or isinstance(value, bool):
        yield {None: "null", True: "true", False: "false"}[value]
    elif type(value) is str:
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
        yield " ".join(repr(value).split())  # an array has lines
