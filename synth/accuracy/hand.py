"""How a live voice is measured: what it reads or solves behind a hand, against the same motion solved as a file.

Stage   after STAGE 3, for a scene that a hand leads.
Model   The hand moves as the scene's own stroke or recording. Where the scene has a constant scan, it lands, rubs to
        and fro up to the speed of the scan with a load that swings about that of the scan, and lifts (`rubbed`). A live
        voice reads its response table, or solves eq. 1 along the motion. Each is measured in several sizes. The frames
        are those of the motion, without the delay of the voice.
Source  design, section 5. The rub: unverified default.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from synth.accuracy.method import Method, Ready, clock
from synth.accuracy.motion import MotionCase
from synth.accuracy.motion_methods import RATIOS, read_live, table_methods, table_name
from synth.motion.recorded_motion import CLOSE_ENDS
from synth.plan.direct_plan import DirectPlan, direct_plan
from synth.plan.preparation import Preparation
from synth.response.table_reader import TableReader
from synth.response_cache import ResponseCache
from synth.sampling.direct_reader import DirectReader
from synth.scene.scene import Scene
from synth.voice.table_reading import TableChannels, reader_of

RUB, LANDING, SWINGS, SWUNG = 1.0, 0.1, 3.0, 0.4  # s; s; Hz of the load, and how much of it
PLANNED = 1e-2  # tolerance to which the same motion is solved as a file; the reference is finer
POINTS_RATE = 200.0  # points of the recording per second, as of a tracker
TWICE = 2.0  # runs of a slow method


def rubbed(scene: Scene) -> Scene:
    """Return `scene` for a reference: with the motion of a hand that rubs to and fro, where its scan is constant."""
    scan, accuracy = scene.scan, scene.accuracy.model_copy(update={"tolerance": PLANNED})
    scene = scene.model_copy(update={"accuracy": accuracy})
    if scan.stroke is not None or scan.trajectory is not None:
        return scene
    seconds = min(RUB, scene.output.duration)
    t = np.linspace(0.0, seconds, math.ceil(seconds * POINTS_RATE) + 1)
    place = 0.5 * scan.speed * RUB / math.pi * (1.0 - np.cos(2.0 * math.pi * t / RUB))
    down = np.minimum(np.minimum(t, seconds - t) / LANDING, 1.0)
    load = scan.load * (1.0 + SWUNG * np.sin(2.0 * math.pi * SWINGS * t)) * down**2 * (3.0 - 2.0 * down)
    points = tuple(zip(t.tolist(), place.tolist(), np.maximum(load, 0.0).tolist(), strict=True))
    moved = scan.model_copy(update={"trajectory": points, "heading": 0.0})
    output = scene.output.model_copy(update={"duration": max(seconds, CLOSE_ENDS)})
    return scene.model_copy(update={"scan": moved, "output": output})


def hand_methods(case: MotionCase, hand: Preparation, setup: float) -> Iterator[Method]:
    """Yield the methods of a live voice.

    hand: the scene prepared for a hand, which took `setup` (s).
    """
    if hand.table is not None:
        for method in table_methods(case):
            chosen = method.name == chosen_of(case, hand)
            yield replace(method, set_up=partial(_table, case, hand, setup)) if chosen else method
    assert hand.contact is not None
    began = clock()
    direct = hand.direct or direct_plan(hand, hand.contact, hand.whole, ResponseCache())
    own = setup if hand.direct is not None else clock() - began
    a_solution, steps = case.seconds_a_solution(direct.contact.heights), set[float]()
    for ratio in RATIOS:
        a_second = _steps(case, hand, direct, ratio * direct.finer)
        if a_second in steps:
            continue
        steps.add(a_second)
        nbytes = direct.contact.grid.nbytes
        made = partial(_direct, case, hand, direct, ratio * direct.finer, setup=own, nbytes=nbytes)
        seconds = TWICE * a_solution * a_second * case.piece[1] / case.rate
        yield Method(direct_name(a_second), "steps", made, seconds)


def direct_name(steps: float) -> str:
    """Return the name of direct solutions at `steps` a second."""
    return f"solved behind a hand, {steps:.0f} solutions a second"


def chosen_of(case: MotionCase, hand: Preparation) -> str:
    """Return the name of the method that a live voice uses."""
    if hand.table is not None:
        return table_name(case, 1.0)
    assert hand.direct is not None
    return direct_name(_steps(case, hand, hand.direct, hand.direct.finer))


def _reader(hand: Preparation, direct: DirectPlan, finer: float, channel: int) -> DirectReader:
    """Return the reader of one channel that solves eq. 1 `finer` times as often as usual."""
    reader = reader_of(replace(hand, table=None, direct=replace(direct, finer=finer)))
    assert isinstance(reader, DirectReader)
    one = slice(channel, channel + 1)
    return replace(reader, filters=reader.filters[one], gains=reader.gains[one], with_mean=reader.with_mean[one])


def _steps(case: MotionCase, hand: Preparation, direct: DirectPlan, finer: float) -> float:
    return case.rate / _reader(hand, direct, finer, case.channel).filters[0].stride


def _direct(
    case: MotionCase, hand: Preparation, direct: DirectPlan, finer: float, *, setup: float, nbytes: int
) -> Ready:
    """Return direct solutions, ready to run."""
    reader = _reader(hand, direct, finer, case.channel)
    own = replace(reader, gains=(1.0 / case.planned.full_scale,))
    return read_live(case, own, nbytes, setup)


def _table(case: MotionCase, hand: Preparation, setup: float) -> Ready:
    """Return the table of the plan, ready to run."""
    table = hand.table
    assert table is not None
    reader = TableReader.of(table, case.planned.quantity, case.rate, 1.0 / case.planned.full_scale)
    return read_live(case, TableChannels((reader,)), table.memory_bytes, setup)
