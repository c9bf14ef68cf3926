"""The rules of scene fields. Each field has one rule, which reads, checks and describes its values.

Stage: 1 (SCENE).
Model: a rule converts the written value to the value that the engine uses. For an invalid value it raises a refusal
with what is allowed and what to write instead.
"""

from __future__ import annotations

import difflib
import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError, ValidationInfo
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError, core_schema

from synth.scene.array_values import texts_as_lists
from synth.scene.quantity import (
    LONGEST_TEXT,
    SMALLEST_NORMAL,
    Dimension,
    QuantityError,
    parse_quantity,
    show_quantity,
    text_pattern,
)

MOST_FAULTS = 100
"""Largest number of faults in one answer. The check of a list or an object stops at the next fault, so that a large
invalid document costs little time."""

GAP = "It must be finite. Fill the gap in the numbers first, as with np.interp."
"""What to do about a number in a list that is NaN or masked."""

LONGEST_KEY = 64
"""Number of characters of an unknown field's name that are compared with the known names. Comparing costs time."""

Fields = dict[str, object]
Refusal = InitErrorDetails


def refused(allowed: str, hint: str) -> PydanticCustomError:
    """Return the error that a rule raises.

    allowed: what is allowed, with its unit.
    hint: what to write instead.
    """
    return PydanticCustomError("refused", "refused", {"allowed": allowed, "hint": hint})


def refusal(location: Iterable[str | int], value: object, allowed: str, hint: str) -> Refusal:
    """Return a refusal of the field at `location`, for a list of refusals."""
    return InitErrorDetails(type=refused(allowed, hint), loc=tuple(location), input=value)


def words_of(error: PydanticCustomError) -> dict[str, str]:
    """Return the `allowed` and `hint` of a rule's error."""
    context = error.context or {}
    return {"allowed": str(context["allowed"]), "hint": str(context["hint"])}


def item_refusal(location: Iterable[str | int], value: object, error: PydanticCustomError) -> Refusal:
    """Return the refusal of a number in a list, from the error of its rule. NaN is a gap, to be filled."""
    words = words_of(error)
    gap = isinstance(value, float) and math.isnan(value)
    return refusal(location, value, words["allowed"], GAP if gap else words["hint"])


def refusals_of(error: ValidationError, *above: str | int) -> list[Refusal]:
    """Return the refusals in `error`, with `above` put before each location."""
    return [
        refusal((*above, *line["loc"]), line["input"], line["ctx"]["allowed"], line["ctx"]["hint"])
        for line in error.errors(include_url=False)
    ]


def refuse(title: str, refusals: list[Refusal]) -> None:
    """Raise all `refusals` as one error. Do nothing if there are none."""
    if refusals:
        raise ValidationError.from_exception_data(title, refusals)


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the name in `known` that is most similar to `name`, or None if none is similar."""
    shortened = name[:LONGEST_KEY].lower()
    near = difflib.get_close_matches(shortened, list(known), n=1, cutoff=0.5)
    return near[0] if near else None


class Rule(ABC):
    """The allowed values of one field.

    allowed: the allowed values as text, with the unit.
    unit: SI unit of a number without a unit, or "".
    takes_lists: whether a value is a list of numbers, or of lists of numbers. It may then be an array.
    """

    allowed: str
    unit = ""
    takes_lists = False

    def arranged(self, value: object) -> object:
        """Return an array as the rule reads it: a table with named columns may be in another order."""
        return value

    @abstractmethod
    def read(self, value: object) -> object:
        """Return the value that the engine uses. Raises the error of `refused`."""

    @abstractmethod
    def schema(self) -> dict[str, Any]:
        """Return the JSON Schema of the allowed values, without null."""

    def show(self, value: Any) -> str:
        """Return `value` as a person would write it."""
        return str(value)

    def read_in(self, value: object, _found: ValidationInfo) -> object:
        """Return the value that the engine uses, given the fields of the section read so far."""
        return self.read(value)

    def __get_pydantic_core_schema__(self, _source: object, _handler: object) -> CoreSchema:
        """Make pydantic read the field with this rule only."""
        return core_schema.with_info_plain_validator_function(self.read_in)


@dataclass(eq=False)
class Quantity(Rule):
    """A number in SI, or text with its unit, within a range.

    dimension: dimension of the value.
    low, high: ends of the range, in SI. Both are allowed.
    whole: whether the value must be a whole number.
    usual: magnitude above which the plan has a warning (`doubtful_values`).
    """

    dimension: Dimension
    low: float
    high: float
    whole: bool = False
    usual: float = math.inf

    def __post_init__(self) -> None:
        self.unit = self.dimension.unit
        self.allowed = f"{self.show(self.low)} to {self.show(self.high)}{', a whole number' if self.whole else ''}"

    def show(self, value: Any) -> str:
        """Return the SI `value` as text with a convenient unit."""
        return show_quantity(value, self.dimension)

    def read(self, value: object) -> float:
        """Return the value in SI."""
        if type(value) is float and abs(value) >= SMALLEST_NORMAL and self.low <= value <= self.high and not self.whole:
            return value
        try:
            number = parse_quantity(value, self.dimension)
        except QuantityError as error:
            raise refused(self.allowed, error.hint) from None
        if not self.low <= number <= self.high:
            raise refused(self.allowed, self._range_hint(value, number))
        if self.whole and not number.is_integer():
            raise refused(self.allowed, f"Write a whole number such as {round(number)}.")
        return int(number) if self.whole else number

    def schema(self) -> dict[str, Any]:
        """Return the schema of a number with its range, and of text with its unit."""
        number = {"type": "integer" if self.whole else "number", "minimum": self.low, "maximum": self.high}
        if self.dimension is Dimension.NONE:
            return {"anyOf": [number]}
        text = {"type": "string", "maxLength": LONGEST_TEXT, "pattern": text_pattern(self.dimension)}
        return {"anyOf": [number, text]}

    def _range_hint(self, value: object, number: float) -> str:
        bound = f"at least {self.show(self.low)}" if number < self.low else f"at most {self.show(self.high)}"
        if isinstance(value, str) or not self.unit:
            return f"Write {bound}."
        return f'Write {bound}. A number without a unit is in {self.unit}; "{self.dimension.example}" has a unit.'


@dataclass(eq=False)
class QuantityList(Rule):
    """A list of `fewest` to `most` values of one quantity."""

    item: Quantity
    fewest: int
    most: int
    takes_lists = True

    def __post_init__(self) -> None:
        self.unit = self.item.unit
        self.allowed = f"a list of {self.fewest} to {self.most} numbers, each {self.item.allowed}"

    def show(self, value: Any) -> str:
        """Return the list as text with units."""
        return f"[{', '.join(self.item.show(number) for number in value)}]"

    def read(self, value: object) -> tuple[float, ...]:
        """Return the values in SI. Every invalid value is refused, with its index."""
        if not isinstance(value, list | tuple):
            raise refused(self.allowed, f"Write a list, such as [{self.item.dimension.example!r}].".replace("'", '"'))
        if not self.fewest <= len(value) <= self.most:
            raise refused(self.allowed, self.length_hint(len(value)))
        refusals: list[Refusal] = []
        values: list[float] = []
        for index, number in enumerate(value):
            try:
                values.append(self.item.read(number))
            except PydanticCustomError as error:
                refusals.append(item_refusal([index], number, error))
            if len(refusals) > MOST_FAULTS:
                break
        refuse("list", refusals)
        return tuple(values)

    def length_hint(self, count: int) -> str:
        """Return what to write instead of a list of `count` values."""
        return f"The list has {count}: write {self.fewest} to {self.most}."

    def schema(self) -> dict[str, Any]:
        """Return the schema of the list."""
        bounds = {"minItems": self.fewest, "maxItems": self.most}
        return {"anyOf": [{"type": "array", "items": self.item.schema(), **bounds}]}


@dataclass(eq=False)
class Choice(Rule):
    """One of a few names.

    names: the names that are listed where the rule is shown.
    others: further names, too many for a list. others_word: what they are, such as "a name from the catalogue".
    """

    names: tuple[str, ...]
    others: tuple[str, ...] = ()
    others_word: str = ""

    def __post_init__(self) -> None:
        listed = [f'"{name}"' for name in self.names]
        self.allowed = ", ".join([*listed, self.others_word] if self.others else listed)

    def read(self, value: object) -> str:
        """Return the name."""
        value = texts_as_lists(value)
        every = (*self.names, *self.others)
        if isinstance(value, str) and value in every:
            return value
        near = nearest(value, every) if isinstance(value, str) else None
        raise refused(self.allowed, f'Write "{near or self.names[0]}".')

    def schema(self) -> dict[str, Any]:
        """Return the schema of the names."""
        return {"anyOf": [{"enum": [*self.names, *self.others]}]}


@dataclass(eq=False)
class QuantityOrName(Rule):
    """A quantity, or one of a few names."""

    quantity: Quantity
    names: Choice

    def __post_init__(self) -> None:
        self.unit = self.quantity.unit
        self.allowed = f"{self.quantity.allowed}, {self.names.allowed}"

    def read(self, value: object) -> float | str:
        """Return the number in SI, or the name."""
        if isinstance(value, str) and value in self.names.names:
            return value
        try:
            return self.quantity.read(value)
        except PydanticCustomError as error:
            raise refused(self.allowed, self._hint(value, words_of(error)["hint"])) from error

    def schema(self) -> dict[str, Any]:
        """Return the schema of the number and of the names."""
        return {"anyOf": [*self.quantity.schema()["anyOf"], *self.names.schema()["anyOf"]]}

    def show(self, value: Any) -> str:
        """Return a name unchanged, or an SI number as text with a convenient unit."""
        return value if isinstance(value, str) else self.quantity.show(value)

    def _hint(self, value: object, of_quantity: str) -> str:
        if not isinstance(value, str):
            return of_quantity
        near = nearest(value, self.names.names)
        if near:
            return f'Write "{near}".'
        return of_quantity if self.unit else "Write a plain JSON number, without quotes, or one of the names."
