""" "auto" is right: it leaves out the effects that change little, and simulates those that change much.

Random scenes, six of them, or forty in a thorough run, each with one effect on "auto". An effect that is left
out changes the output by less than the tolerance when it is forced in. An effect that is simulated changes it by more
than a tenth of the tolerance. Changes are relative to the peak-to-peak without the effect.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from synth import Voice, parse_scene
from synth.plan.prepare import prepare
from synth.scene.effects_section import AUTO, declaration, effect_names
from synth.scene.scene import Scene
from tests.few import thorough
from tests.synth.engine_cases import physical, spread

LEFT_TO_US = [name for name in effect_names() if not declaration(name).without_auto]
SCENES, SOME = 40, (1, 2, 3, 9, 14, 15)  # some: every effect, left out and simulated
RATE = 8000
LONGEST = 8000  # frames: a period of the slowest scan


def random_scene(random: np.random.Generator, name: str) -> dict[str, Any]:
    """Return a scene in which the effect may matter or not: slow or fast, light or heavy, coarse or fine."""
    period = spread(random, 0.2e-3, 4e-3)
    fundamental = spread(random, 1.0, 400.0)
    loads = [1.0, spread(random, 0.02, 3.0), spread(random, 0.02, 3.0)]  # N; at 1 N contact_growth changes nothing
    load = float(random.choice(loads))
    return {
        "finger": {"contact_length": spread(random, 2e-3, 1e-2)},
        "texture": {"period": period, "amplitude": spread(random, 2e-6, 6e-5)},
        "scan": {"speed": fundamental * period * float(random.choice([-1.0, 1.0])), "load": load},
        "output": {
            "quantity": str(random.choice(["displacement", "velocity", "acceleration"])),
            "sample_rate": RATE,
            "bandwidth": float(random.choice([200.0, 1000.0, 3000.0])),
            "full_scale": None,
        },
        "accuracy": {"tolerance": spread(random, 1e-4, 3e-2)},
        "effects": {name: AUTO},
    }


def paced(scene: Scene) -> Voice:
    """Return a voice with the steps of a live voice: a file takes minutes for the tightest tolerances."""
    return Voice(prepare(scene, paced=True), paced=True)


@pytest.mark.parametrize("number", [number if number in SOME else thorough(number) for number in range(SCENES)])
def test_what_is_left_out_would_not_be_missed_and_what_is_put_in_would(number: int) -> None:
    random = np.random.default_rng(1000 + number)
    name = LEFT_TO_US[number % len(LEFT_TO_US)]
    document = random_scene(random, name)
    scene = parse_scene(document)
    frames = min(LONGEST, max(800, round(2.2 * RATE * scene.texture.period / abs(scene.scan.speed))))
    plan = paced(scene).plan.document()
    without = physical(paced(parse_scene(document | {"effects": {}})), frames)
    forced = physical(paced(parse_scene(document | {"effects": {name: {}}})), frames)
    extent = float(np.ptp(without))
    change = float(np.max(np.abs(forced - without))) / extent if extent > 0.0 else float(np.max(np.abs(forced)))
    tolerance = scene.accuracy.tolerance
    assert isinstance(tolerance, float)
    left_out = {part["name"]: part for part in plan["left_out"]}
    if name in left_out:
        assert change < tolerance, plan
        assert left_out[name]["effect_on_output"] < tolerance
        assert plan["response"]["method"] == "silence" or "tolerance" in left_out[name]["reason"]
    else:
        assert name in [part["name"] for part in plan["simulated"]]
        assert change > 0.1 * tolerance, plan
