"""Read "0.8 mm" or 0.0008 as one SI number, and write SI numbers as text with a convenient unit.

Stage: before 1 (SCENE), which reads every number of a scene with `parse_quantity`.
Model: a number is in SI units. Text is a decimal number, optional spaces, and a unit of the required dimension.
Limits: the result is the float nearest to the decimal value ("40 um" is 4e-05, not 40 * 1e-06). Results too small for a
normal float, and -0.0, become 0.0. Values that are too large, infinite or not a number are refused.
"""

from __future__ import annotations

import math
import re
import sys
from decimal import Context, Decimal
from enum import Enum
from numbers import Real
from typing import Any

from synth.scene.array_values import ArrayError, is_array, real_array, text_of_array

SMALLEST_NORMAL = sys.float_info.min
"""Magnitudes below this (2.2e-308) are read as zero, because denormal numbers slow down every filter."""

LONGEST_TEXT = 80
"""Largest number of characters of a quantity. Longer text is refused at once, because reading it would cost time."""

STANDARD_GRAVITY = "9.80665"
"""m/s^2 in one g, exact by definition (3rd General Conference on Weights and Measures, 1901)."""


class Dimension(Enum):
    """A physical dimension and the units in which its numbers may be written.

    unit: SI unit of a number without a unit, or "" for a dimensionless number.
    units: units allowed in text, each with its exact decimal factor to SI.
    shown_units: units in which numbers are shown, largest first.
    example: a quantity of this dimension as a person would write it.
    """

    LENGTH = (
        "m",
        {"m": "1", "cm": "1e-2", "mm": "1e-3", "um": "1e-6", "nm": "1e-9"},
        ("m", "mm", "um", "nm"),
        "0.8 mm",
    )
    SPEED = (
        "m/s",
        {"m/s": "1", "cm/s": "1e-2", "mm/s": "1e-3", "um/s": "1e-6"},
        ("m/s", "mm/s", "um/s"),
        "80 mm/s",
    )
    LOAD = ("N", {"N": "1", "mN": "1e-3", "uN": "1e-6"}, ("N", "mN", "uN"), "0.3 N")
    PRESSURE = (
        "Pa",
        {"Pa": "1", "kPa": "1e3", "MPa": "1e6", "GPa": "1e9"},
        ("GPa", "MPa", "kPa", "Pa"),
        "101.2 kPa",
    )
    FREQUENCY = ("Hz", {"Hz": "1", "kHz": "1e3"}, ("Hz",), "48 kHz")
    TIME = (
        "s",
        {"s": "1", "ms": "1e-3", "us": "1e-6", "min": "60", "h": "3600"},
        ("s", "ms", "us"),
        "500 ms",
    )
    ACCELERATION = (
        "m/s^2",
        {"m/s^2": "1", "m/s2": "1", "mm/s^2": "1e-3", "mm/s2": "1e-3", "g": STANDARD_GRAVITY},
        ("m/s^2",),
        "20 m/s^2",
    )
    MASS = ("kg", {"kg": "1", "g": "1e-3", "mg": "1e-6"}, ("kg", "g", "mg"), "5 g")
    DAMPING = ("N s/m", {"N s/m": "1", "mN s/m": "1e-3"}, ("N s/m", "mN s/m"), "3 N s/m")
    STIFFNESS = ("N/m", {"N/m": "1", "N/mm": "1e3", "kN/m": "1e3"}, ("N/m",), "36000 N/m")
    ANGLE = ("rad", {"rad": "1", "deg": str(Decimal(math.pi / 180.0))}, ("rad",), "90 deg")
    NONE = ("", dict[str, str](), (), "0.5")

    def __init__(self, unit: str, units: dict[str, str], shown_units: tuple[str, ...], example: str) -> None:
        self.unit, self.units, self.shown_units, self.example = unit, units, shown_units, example


_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(.*?)\s*", re.DOTALL)
_SPELLINGS = str.maketrans({"\u00b5": "u", "\u03bc": "u", "\u00b2": "^2", "\u2212": "-"})
_EXACT = Context(prec=400)


class QuantityError(ValueError):
    """The value is not a quantity of the required dimension.

    reason: why it is refused.
    hint: what to write instead.
    """

    def __init__(self, reason: str, hint: str) -> None:
        self.reason = reason
        self.hint = hint
        super().__init__(f"{reason}. {hint}")


def parse_quantity(value: object, dimension: Dimension) -> float:
    """Return `value` as a finite float in SI.

    value: a number in SI, or text with a unit of `dimension`; also as an array of one of them.
    Raises QuantityError for any other value: a boolean, text without a unit or with a wrong unit, NaN, an infinity.
    """
    if isinstance(value, str):
        number = _from_text(value, dimension)
    elif isinstance(value, Real | Decimal) and not isinstance(value, bool):
        number = _from_number(value)
    elif is_array(value):
        number = _from_array(value, dimension)
    else:
        raise QuantityError(f"{_kind(value)} is not a quantity", _how_to_write(dimension))
    if not math.isfinite(number):
        raise QuantityError("the number is not finite", f"It must be finite. {_how_to_write(dimension)}")
    return number if abs(number) >= SMALLEST_NORMAL else 0.0


def show_quantity(value: float, dimension: Dimension) -> str:
    """Return the finite SI `value` as text with a convenient unit; `parse_quantity` reads it back to the same float."""
    shown_units = dimension.shown_units
    if not shown_units:
        return _decimal_text(Decimal(repr(float(value))))
    exact = Decimal(repr(float(value)))
    unit = dimension.unit
    if exact:
        fitting = [name for name in shown_units if abs(exact) >= Decimal(dimension.units[name])]
        unit = fitting[0] if fitting else shown_units[-1]
    return f"{_decimal_text(_EXACT.divide(exact, Decimal(dimension.units[unit])))} {unit}"


def text_pattern(dimension: Dimension) -> str:
    """Return the regular expression, for JSON Schema, of the text that `parse_quantity` reads."""
    number = _NUMBER.replace("[+-]?", "[+\u2212-]?", 1)
    spellings = [re.escape(unit).replace("\\ ", " ").replace("u", "[u\u00b5\u03bc]") for unit in dimension.units]
    units = "|".join(spellings).replace(r"\^2", r"(?:\^2|\u00b2)")
    return rf"^\s*{number}\s*(?:{units})\s*$"


def _from_array(value: Any, dimension: Dimension) -> float:
    text = text_of_array(value)
    if text is not None:
        return _from_text(text, dimension)
    try:
        numbers = real_array(value, dimension.unit)
    except ArrayError as error:
        raise QuantityError(error.reason, error.hint) from None
    if numbers.size != 1:
        raise QuantityError(f"an array of {numbers.size} numbers is not one number", _how_to_write(dimension))
    return float(numbers.reshape(-1)[0])


def _from_number(value: Real | Decimal) -> float:
    try:
        return float(value)
    except ValueError:  # a signalling NaN of Decimal
        return math.nan
    except OverflowError:
        return math.inf


def _from_text(text: str, dimension: Dimension) -> float:
    if dimension is Dimension.NONE:
        raise QuantityError("text is given for a number without a unit", _how_to_write(dimension))
    plain = text.translate(_SPELLINGS)
    found = _QUANTITY.fullmatch(plain) if len(text) <= LONGEST_TEXT else None
    if found is None:
        raise QuantityError("the text is not a number with a unit", _how_to_write(dimension))
    number, unit = found.groups()
    if not unit:
        with_unit = f"{number} {dimension.example.split(maxsplit=1)[1]}"
        hint = f'Add a unit, such as "{with_unit}". {_how_to_write(dimension)}'
        raise QuantityError("the text has no unit", hint)
    if unit not in dimension.units:
        raise QuantityError(f"{unit!r} is not a unit of {dimension.name.lower()}", _how_to_write(dimension))
    return float(_EXACT.multiply(Decimal(number), Decimal(dimension.units[unit])))


def _how_to_write(dimension: Dimension) -> str:
    if dimension is Dimension.NONE:
        return f"Write a plain JSON number such as {dimension.example}, without quotes."
    names = ", ".join(dimension.units)
    return f'Write a number in {dimension.unit}, or text with its unit such as "{dimension.example}"; units: {names}.'


def _kind(value: object) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "a boolean"
    return f"a {type(value).__name__}"


def _decimal_text(number: Decimal) -> str:
    if not number:
        return "0"
    if -5 <= number.adjusted() < 9:
        text = f"{number:f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    return f"{_EXACT.normalize(number):e}".replace("e+", "e")
