"""The error that the changes of a discretisation predict, beside that of columns many times finer."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import ridgewave as rw
from synth.contact.fingertip import FingertipContact
from synth.contact.scene_contact import contact_of
from synth.response.demand import GOLDEN, Demand, curves, harmonics_of, points_for
from synth.response.discretisation import AFTER_FIRST, EARLIER, remaining
from tests.few import thorough
from tests.synth.contact.fingertip_study import random_scene

ORDERS, PHASES, HIGHEST = (0, 1, 2), 384, 32
HALVINGS, JUDGED = 5, 3  # of the columns in all, of which the last ones only give the true error
SMALLEST = 1e-7  # error below which the finest columns are no oracle
LIGHT = 5  # every so many scenes are light, where the changes fall by chance
MORE = [2, 3, 5, *range(7, 60), 105]  # 105 is a whorl that touches with its core


@pytest.mark.parametrize("seed", [0, 1, 4, 6, *(thorough(seed) for seed in MORE)])
def test_the_error_is_at_most_what_the_changes_predict(seed: int) -> None:
    asked = random_scene(seed)
    if seed % LIGHT == 0:
        asked["scan"]["load"] = float(10.0 ** np.random.default_rng(seed).uniform(-1.7, -0.7))
    scene = rw.parse_scene(asked)
    contact = contact_of(scene)
    assert isinstance(contact, FingertipContact)
    phases, series, z = (np.arange(PHASES) + GOLDEN) / PHASES, [], None
    for level in range(HALVINGS + 1):
        z = replace(contact, coarser=0.5**level).approach(phases, scene.scan.load, z)[0]
        series.append(harmonics_of(z, HIGHEST))
    demand = Demand(HIGHEST, ORDERS, 1e-3)
    extents = [float(np.ptp(curves(series[-1], order, points_for(HIGHEST)))) for order in ORDERS]

    def between(one: Any, other: Any) -> tuple[float, ...]:
        return tuple(demand.largest(one - other, order) / size for order, size in zip(ORDERS, extents, strict=True))

    changed = [between(after, before) for before, after in itertools.pairwise(series)]
    for level in range(1, JUDGED + 1):
        earlier = changed[level - 2] if level > 1 else None
        told = remaining(changed[level - 1], earlier, contact.settles, AFTER_FIRST if level == 2 else EARLIER)
        true = between(series[-1], series[level])
        assert all(error <= most + SMALLEST for error, most in zip(true, told, strict=True)), (
            level,
            true,
            told,
        )
