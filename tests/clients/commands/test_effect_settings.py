"""Invalid settings of effects on the command line: exit code 2, one message with field, value, range and hint."""

from __future__ import annotations

import pytest

from tests.conftest import RunsRidgewave


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("effects.inertia.mass=2 kg", ("effects.inertia.mass", "2 kg", "1 kg")),
        ("effects.viscous_skin.time_constant=5 mm", ("effects.viscous_skin.time_constant", "5 mm")),
        ('effects.tangential="auto"', ("effects.tangential", "auto", "null")),
        ("effects.adhesive={}", ("effects.adhesive", "adhesion")),
    ],
)
def test_a_bad_setting_ends_with_2_and_one_message(
    ridgewave: RunsRidgewave, setting: str, words: tuple[str, ...]
) -> None:
    done = ridgewave("render", "-", "-o", "out.wav", "--set", setting, input=b"{}")
    told = done.stderr.decode()
    assert done.returncode == 2, told
    assert all(word in told for word in words), told
    assert "Traceback" not in told and not done.stdout
