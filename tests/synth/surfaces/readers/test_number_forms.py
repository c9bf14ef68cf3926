"""The numbers of a line are those of its cells, one by one, whether the line is plain or not."""

from __future__ import annotations

import random
from dataclasses import replace

import numpy as np
import pytest

from synth.surfaces.readers.number_forms import FORMS, Form, NotANumber

USUAL = ["1", "-2.5", "+3.25", ".5", "5.", "1e-3", "1D+03", "7d2", "12345.678901234567", "0"]
MISSING = ["", "nan", "NaN", "-nan", "-", "---", "**", "??", "--?", "no data", "#N/A", "inf", "nan(1)"]
OTHERS = ["1'000", "1 000", "1.234,5", "1,234.5", "1,234", "−5", "1_0", "1e12345", "--5", "1e", "o", "٣", "\x1a", "=5"]
PADS = ["", "", "", " ", "  ", "\t", "\u00a0"]


def one_by_one(form: Form, line: str) -> list[str] | str:
    try:
        return [form.number(cell) for cell in form.cells(line)]
    except NotANumber as error:
        return f"not a number: {error}"


def at_once(form: Form, line: str) -> list[str] | str:
    try:
        return form.row(line)
    except NotANumber as error:
        return f"not a number: {error}"


@pytest.mark.parametrize("form", FORMS, ids=lambda form: f"{form.separator!r} {form.decimal}")
def test_the_numbers_of_a_line_are_those_of_its_cells(form: Form) -> None:
    chance, read = random.Random(1), 0
    for _ in range(4000):
        written = chance.choice([USUAL, USUAL + MISSING, USUAL + MISSING + OTHERS])
        cells = [chance.choice(written).replace(".", form.decimal) for _ in range(chance.randint(1, 6))]
        pads = chance.choice([PADS[:1], PADS])
        padded = [chance.choice(pads) + cell + chance.choice(pads) for cell in cells]
        line = form.separator.join(padded) + chance.choice(["", "", form.separator]) + chance.choice(["\n", "", "\r\n"])
        quoted = form.separator == form.decimal or chance.random() < 0.1
        one = replace(form, empty=chance.choice([0, 0, 1, 2]), quoted=quoted)
        assert at_once(one, line) == one_by_one(one, line), (one, line)
        read += isinstance(at_once(one, line), list)
    assert read > 1000


def test_the_numbers_of_a_line_are_as_python_writes_them() -> None:
    form = Form(";", ",", empty=1)
    assert form.row("1,5;-2D3; ---;;+,5;nan;\n") == ["1.5", "-2e3", "nan", "nan", "+.5", "nan"]
    assert np.isfinite([float(cell) for cell in form.row("1,5;2;7d-2;")]).all()
