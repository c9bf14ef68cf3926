"""Numbers with units: which are read, to which float, which are refused, and with which hint."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from decimal import Decimal
from fractions import Fraction

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from synth.scene.quantity import Dimension, QuantityError, parse_quantity, show_quantity, text_pattern

NO_BREAK_SPACE = "\u00a0"
MEASURED = [dimension for dimension in Dimension if dimension is not Dimension.NONE]


@pytest.mark.parametrize(
    ("written", "dimension", "read"),
    [
        ("0.8 mm", Dimension.LENGTH, 0.0008),
        ("0.8mm", Dimension.LENGTH, 0.0008),
        ("  0.8   mm ", Dimension.LENGTH, 0.0008),
        (f"0.8{NO_BREAK_SPACE}mm", Dimension.LENGTH, 0.0008),
        ("40 um", Dimension.LENGTH, 40e-6),
        ("40 \u00b5m", Dimension.LENGTH, 40e-6),
        ("40 \u03bcm", Dimension.LENGTH, 40e-6),
        ("1 cm", Dimension.LENGTH, 0.01),
        ("250 nm", Dimension.LENGTH, 250e-9),
        ("+.5 m", Dimension.LENGTH, 0.5),
        ("5. m", Dimension.LENGTH, 5.0),
        ("1e3um", Dimension.LENGTH, 1e-3),
        ("1.5E-2 m", Dimension.LENGTH, 0.015),
        ("-80 mm/s", Dimension.SPEED, -0.08),
        ("\u221280 mm/s", Dimension.SPEED, -0.08),
        ("8 cm/s", Dimension.SPEED, 0.08),
        ("300 mN", Dimension.LOAD, 0.3),
        ("5 \u00b5N", Dimension.LOAD, 5e-6),
        ("101.2 kPa", Dimension.PRESSURE, 101200.0),
        ("1.54 MPa", Dimension.PRESSURE, 1.54e6),
        ("200 GPa", Dimension.PRESSURE, 200e9),
        ("44.1 kHz", Dimension.FREQUENCY, 44100.0),
        ("2 min", Dimension.TIME, 120.0),
        ("24 h", Dimension.TIME, 86400.0),
        ("4 ms", Dimension.TIME, 0.004),
        ("2 m/s^2", Dimension.ACCELERATION, 2.0),
        ("2 m/s2", Dimension.ACCELERATION, 2.0),
        ("2 m/s\u00b2", Dimension.ACCELERATION, 2.0),
        ("1 g", Dimension.ACCELERATION, 9.80665),
        ("180 deg", Dimension.ANGLE, math.pi),
        (3, Dimension.LENGTH, 3.0),
        (0.0008, Dimension.LENGTH, 0.0008),
        (0.5, Dimension.NONE, 0.5),
        (Fraction(1, 4), Dimension.NONE, 0.25),
    ],
)
def test_a_quantity_is_read_to_the_nearest_float(written: object, dimension: Dimension, read: float) -> None:
    assert parse_quantity(written, dimension) == read


@pytest.mark.parametrize(
    ("written", "dimension", "advice"),
    [
        ("0.8", Dimension.LENGTH, 'Add a unit, such as "0.8 mm"'),
        ("0.8 kg", Dimension.LENGTH, "units: m, cm, mm, um, nm"),
        ("0.8 MM", Dimension.LENGTH, "units: m, cm, mm, um, nm"),
        ("0,8 mm", Dimension.LENGTH, '"0.8 mm"'),
        ("1 2 mm", Dimension.LENGTH, '"0.8 mm"'),
        ("mm", Dimension.LENGTH, '"0.8 mm"'),
        ("", Dimension.LENGTH, '"0.8 mm"'),
        ("nan mm", Dimension.LENGTH, '"0.8 mm"'),
        ("inf m", Dimension.LENGTH, '"0.8 mm"'),
        ("1e9999 m", Dimension.LENGTH, "finite"),
        ("1e99999 m", Dimension.LENGTH, '"0.8 mm"'),
        ("\u0661 mm", Dimension.LENGTH, '"0.8 mm"'),  # an Arabic-Indic digit
        ("9" * 100 + " mm", Dimension.LENGTH, '"0.8 mm"'),
        ("0x10 mm", Dimension.LENGTH, '"0.8 mm"'),
        ("1_000 mm", Dimension.LENGTH, '"0.8 mm"'),
        ("80 mm", Dimension.SPEED, '"80 mm/s"'),
        ("101.2 mPa", Dimension.PRESSURE, '"101.2 kPa"'),
        ("0.5", Dimension.NONE, "without quotes"),
        ("0.5 m", Dimension.NONE, "without quotes"),
        (math.nan, Dimension.LENGTH, "finite"),
        (math.inf, Dimension.LENGTH, "finite"),
        (-math.inf, Dimension.SPEED, "finite"),
        (10**400, Dimension.LENGTH, "finite"),
        (True, Dimension.LENGTH, '"0.8 mm"'),
        (False, Dimension.NONE, "0.5"),
        (None, Dimension.LENGTH, '"0.8 mm"'),
        ([1], Dimension.LENGTH, '"0.8 mm"'),
        ({}, Dimension.LENGTH, '"0.8 mm"'),
        (1j, Dimension.LENGTH, '"0.8 mm"'),
        (b"1 m", Dimension.LENGTH, '"0.8 mm"'),
    ],
)
def test_what_is_no_quantity_is_refused_with_what_to_write(written: object, dimension: Dimension, advice: str) -> None:
    with pytest.raises(QuantityError) as refused:
        parse_quantity(written, dimension)
    assert advice in refused.value.hint
    assert refused.value.reason in str(refused.value)


@pytest.mark.parametrize("tiny", [5e-324, -5e-324, 2.2e-308, -0.0, "1e-320 m", "-0 m", "1e-9999 m"])
def test_denormal_numbers_and_negative_zero_are_plain_zero(tiny: object) -> None:
    number = parse_quantity(tiny, Dimension.LENGTH)
    assert number == 0.0
    assert math.copysign(1.0, number) == 1.0


def test_the_smallest_normal_number_is_kept() -> None:
    assert parse_quantity(sys.float_info.min, Dimension.LENGTH) == sys.float_info.min


@given(st.sampled_from(MEASURED), st.floats(allow_nan=False, allow_infinity=False))
@example(Dimension.LENGTH, 0.0)
@example(Dimension.LENGTH, sys.float_info.max)
@example(Dimension.LENGTH, sys.float_info.min)
def test_what_is_shown_is_read_back_to_the_same_float(dimension: Dimension, number: float) -> None:
    if abs(number) < sys.float_info.min:
        number = 0.0
    assert parse_quantity(show_quantity(number, dimension), dimension) == number


@given(st.sampled_from(MEASURED), st.data(), st.decimals(-1000000, 1000000, places=7))
def test_units_are_exact_powers(dimension: Dimension, data: st.DataObject, number: Decimal) -> None:
    unit = data.draw(st.sampled_from(sorted(dimension.units)))
    exact = float(Fraction(number) * Fraction(dimension.units[unit]))
    assert parse_quantity(f"{number:f} {unit}", dimension) == (exact if abs(exact) >= sys.float_info.min else 0.0)


@given(
    st.sampled_from(list(Dimension)),
    st.text(alphabet="0123456789.eE+- mu\u00b5\u03bcnskPaNHzg/^2\u00b2dr", max_size=20),
)
def test_the_pattern_for_json_schema_takes_the_text_that_is_read(dimension: Dimension, text: str) -> None:
    if dimension is Dimension.NONE:
        return
    fits = re.fullmatch(text_pattern(dimension), text) is not None
    try:
        parse_quantity(text, dimension)
        read = True
    except QuantityError as refused:
        read = refused.reason == "the number is not finite"
    assert fits == read


@pytest.mark.parametrize(
    ("number", "dimension", "text"),
    [
        (0.0008, Dimension.LENGTH, "800 um"),
        (1e-6, Dimension.LENGTH, "1 um"),
        (0.1, Dimension.LENGTH, "100 mm"),
        (0.0, Dimension.LENGTH, "0 m"),
        (1000.0, Dimension.LOAD, "1000 N"),
        (-0.08, Dimension.SPEED, "-80 mm/s"),
        (101200.0, Dimension.PRESSURE, "101.2 kPa"),
        (1e-24, Dimension.ACCELERATION, "1e-24 m/s^2"),
        (1e-7, Dimension.NONE, "1e-7"),
    ],
)
def test_numbers_are_shown_in_handy_units(number: float, dimension: Dimension, text: str) -> None:
    assert show_quantity(number, dimension) == text


def test_reading_quantities_imports_nothing_but_the_standard_library(environment: dict[str, str]) -> None:
    code = "import sys, synth.scene.quantity; print(sorted({'pydantic', 'numpy', 'scipy', 'numba'} & set(sys.modules)))"
    command = [sys.executable, "-c", code]
    ran = subprocess.run(command, capture_output=True, text=True, check=True, env=environment, timeout=60)
    assert ran.stdout.strip() == "[]"
