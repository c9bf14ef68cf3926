"""Arrays in scenes: NumPy arrays, and objects that turn into them (pandas, xarray, PyTorch), become numbers and lists.

Stage: before 1 (SCENE), which reads every list of numbers with `listed` and every number with `real_array`.
Model: a scene holds copies, so that an array that changes later does not change the scene. A masked number becomes NaN,
    which the field then refuses with its index. An array that states a unit must state the SI unit of its field,
    because NumPy would drop the unit in silence.
Limits: real numbers, and text, which its field then reads. NumPy is imported when the first array is read.
"""

from __future__ import annotations

from numbers import Real
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

MOST_NUMBERS = 1 << 24  # more than any field takes; a larger array would only cost memory before it is refused
LONG_UNITS = {"m": ("meter", "metre", "meters", "metres"), "rad": ("radian", "radians"), "": ("dimensionless", "1")}
PLAIN = (float, int, str, list, tuple, dict, bool, type(None))


class ArrayError(ValueError):
    """The array holds no real numbers in SI.

    reason: what it is.
    hint: what to write instead.
    """

    def __init__(self, reason: str, hint: str) -> None:
        self.reason, self.hint = reason, hint
        super().__init__(f"{reason}. {hint}")

    @property
    def sentence(self) -> str:
        """The reason as a sentence."""
        return f"It is {self.reason}."


def is_array(value: object) -> bool:
    """Return whether `value` is an array, or an object that turns into one."""
    return type(value) not in PLAIN and not isinstance(value, Real | str | type) and hasattr(value, "__array__")


def real_array(value: Any, unit: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return a copy of the numbers of an array, float64, in its shape.

    unit: SI unit of the numbers. Raises ArrayError.
    """
    import numpy as np

    _check_unit(value, unit)
    try:
        found = value if isinstance(value, np.ma.MaskedArray) else np.asarray(value)
    except Exception as error:  # the object's own code; PyTorch refuses a tensor with a gradient, for one
        reason = f"an object of type {type(value).__name__} that does not turn into an array"
        raise ArrayError(reason, "Write numpy.asarray(...) of its numbers.") from error
    if found.dtype.names:
        columns = ", ".join(f"r.{name}" for name in found.dtype.names)
        raise ArrayError("an array of records", f"Write its columns as numbers, such as np.c_[{columns}].")
    if found.dtype.kind not in "iuf":
        kind = {"c": "complex numbers", "b": "truth values", "U": "text", "S": "text", "O": "Python objects"}
        what = f"an array of {kind.get(found.dtype.kind, str(found.dtype))}"
        raise ArrayError(what, "Write real numbers in SI, such as values.astype(float).")
    if found.size > MOST_NUMBERS:
        raise ArrayError(f"an array of {found.size} numbers", f"Write at most {MOST_NUMBERS}.")
    if isinstance(found, np.ma.MaskedArray):
        return np.array(np.ma.filled(found.astype(np.float64), np.nan), np.float64)
    return np.array(found, np.float64)


def text_of_array(value: Any) -> str | None:
    """Return the text of a NumPy array of one text, or None."""
    if getattr(getattr(value, "dtype", None), "kind", "") in ("U", "T") and getattr(value, "size", 0) == 1:
        return str(value.reshape(-1)[0])
    return None


def texts_as_lists(value: Any) -> Any:
    """Return a NumPy array of text as text, or as lists of it; anything else unchanged."""
    return value.tolist() if getattr(getattr(value, "dtype", None), "kind", "") in ("U", "T") else value


def listed(value: Any, unit: str) -> Any:
    """Return `value` with lists in place of arrays, also of those within a list. Raises ArrayError."""
    value = texts_as_lists(value)
    if is_array(value):
        return real_array(value, unit).tolist()
    if isinstance(value, range) or type(value).__module__ == "array":  # Python's own array, which has no __array__
        return list(value) if len(value) <= MOST_NUMBERS else value
    if isinstance(value, list | tuple) and any(type(item) not in PLAIN for item in value):
        return [listed(item, unit) for item in value]
    return value


def _check_unit(value: Any, unit: str) -> None:
    """Raise ArrayError if an array states a unit that is not `unit` (astropy, pint, or an attribute of xarray)."""
    stated = getattr(value, "units", None) or getattr(value, "unit", None)
    attributes = getattr(value, "attrs", None)
    if stated is None and isinstance(attributes, dict):
        stated = attributes.get("units")
    if stated is None or callable(stated):
        return
    if not str(stated).strip():  # xarray writes it where nobody has stated one
        return
    if str(stated) not in (unit, *LONG_UNITS.get(unit, ())):
        wanted = f"Convert it to {unit}" if unit else "Convert it to SI"
        raise ArrayError(f"an array in {stated}", f"{wanted} and write its numbers.")
