"""The tables of `ridgewave explain`: effects with settings, units and prices, and no JSON."""

from __future__ import annotations

from typing import Any

import pytest

from clients.commands.explain import print_plan

PLAN: dict[str, Any] = {
    "simulated": [
        {"name": "simulation", "reason": "z is simulated 2 steps a frame."},
        {
            "name": "inertia",
            "reason": "The finger moves as 5 g on the contact.",
            "settings": {"mass": 5e-3, "damping": 3.0},
            "price": {"ns_per_frame": 340.0, "memory_bytes": 6_100_000},
        },
        {
            "name": "tangential",
            "reason": "The force on the slopes.",
            "settings": {"pressure_exponent": 1.0 / 3.0, "full_scale": None},
            "price": {"ns_per_frame": 14.0, "memory_bytes": 110_000},
        },
    ],
    "left_out": [{"name": "viscous_skin", "reason": "It moves little.", "effect_on_output": 1.2e-4}],
    "response": {
        "method": "simulation",
        "fundamental_hz": 100.0,
        "channels": [{"quantity": "acceleration", "full_scale": 5.1}, {"quantity": "velocity", "full_scale": 0.2}],
        "simulation": {"takes_the_place_of_the_response": True, "changes": {"acceleration": 0.84}},
    },
    "estimated_error": {"acceleration": 1e-4},
    "cost": {"setup_seconds": 1.5, "times_real_time": 18610.4},
    "warnings": ["It misses the tolerance."],
}


@pytest.fixture
def lines(capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Return what is printed of PLAN, each line with single spaces."""
    print_plan(PLAN)
    return [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]


def test_an_effect_has_its_settings_with_units_and_its_price(lines: list[str]) -> None:
    assert "name reason settings price, alone" in lines
    assert "inertia The finger moves as 5 g on the contact. mass 5 g 340 ns per frame" in lines
    assert "damping 3 N s/m 6.1 MB" in lines
    assert "tangential The force on the slopes. pressure exponent 0.3333 14 ns per frame" in lines
    assert "full scale - 110 kB" in lines


def test_each_omitted_part_says_what_it_would_change(lines: list[str]) -> None:
    assert "viscous_skin It moves little. 0.00012" in lines


def test_parts_omitted_for_one_reason_share_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    reason = "The scene does not call for it."
    parts = [{"name": name, "reason": reason, "effect_on_output": None} for name in ("adhesion", "inertia")]
    print_plan(PLAN | {"left_out": [*PLAN["left_out"], *parts]})
    shown = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert f"adhesion, inertia {reason} -" in shown and "viscous_skin It moves little. 0.00012" in shown


def test_nested_values_have_their_own_table(lines: list[str]) -> None:
    assert lines[lines.index("Channels") + 1] == "quantity full scale"
    assert "velocity 0.2" in lines
    assert "takes the place of the response yes" in lines
    assert "changes: acceleration 0.84" in lines


def test_numbers_have_units_and_nothing_is_printed_as_json(lines: list[str]) -> None:
    assert {"fundamental (Hz) 100", "setup (s) 1.5", "times real time 18610"} <= set(lines)
    assert not any(sign in line for line in lines for sign in '{}[]"')
    assert lines[-1] == "Warning: It misses the tolerance."


def test_a_plan_of_nothing_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    print_plan({"simulated": [], "left_out": [], "response": {}, "estimated_error": {}, "cost": {}, "warnings": []})
    shown = capsys.readouterr().out
    assert "Simulated, in order: nothing" in shown and "Left out: nothing" in shown
