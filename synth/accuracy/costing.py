"""Measure the cost of a plan on this machine: set-up time, time per frame, memory.

Stage   no stage. It adds the cost to the plan of a scene, as `ridgewave explain` shows it.
Model   The scene is prepared, and a voice renders blocks of it. The time per frame is that of the fastest of REPEATS
        blocks, or of one chunk of solved frames. If the tolerance is "imperceptible", the same is measured at the
        tolerance UNFELT_AGAINST, to report what "imperceptible" saves.
        The times that a process needs once (start, imports, kernels) are reported separately.
        The plan's response also gets figures of the contact:
        - stiffness k of eqs 4-5, or as given, and the groups of eqs 6-7, at the scan's load;
        - contact fraction: mean length that touches, over PHASES phases of a period, over `finger.contact_length`;
        - rms of each quantity about its mean;
        - sensation level: 20 log10 of the strongest harmonic of the motion over the detection threshold at its
          frequency (`perception.threshold`).
Source  Fagiani & Barbieri (2016), eqs 4-7.
Limits  The cost is that of this machine at this moment. With a warm cache the set-up takes almost no time. For a
        recording, the saving is not measured, because that would take minutes. Stiffness, groups, rms and level are
        those of the scan's own speed and load. Rms and level are None if a simulation replaces the response.
"""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from time import perf_counter
from typing import Any

import numpy as np

from synth.contact.groups import Groups
from synth.perception.threshold import threshold_displacement
from synth.plan.plan import Cost, Plan, plan_of
from synth.plan.preparation import Preparation
from synth.plan.prepare import prepare
from synth.plan.process_start import compile_seconds, kernel_seconds, process_seconds
from synth.response_cache import ResponseCache
from synth.scene.scene import Scene, SceneLike, scene_from
from synth.voice.voice import Voice

TIMED_FRAMES = 1 << 14
REPEATS = 5
TRIED_FRAMES, SLOW = 1 << 10, 0.05  # frames of a first block, and its time (s) above which only as many are timed
UNFELT_AGAINST = 1e-6  # the tolerance with which "imperceptible" is compared
PHASES = 256  # phases of a period; they give the mean length that touches to some thousandths
SAVED = ("setup_seconds", "ns_per_frame", "memory_bytes")  # fields of `Cost` that "imperceptible" can save


def explain(scene: SceneLike, *, cache: ResponseCache | None = None) -> Plan:
    """Return the plan of `scene`, with its cost measured on this machine.

    scene: a Scene, a mapping, the path of a JSON file, or a name of the catalogue.
    cache: responses solved before; by default none, so that the whole set-up is measured.
    Raises SceneError for an invalid scene, and for one whose contact cannot be solved.

    Example: synth.explain({"effects": {"inertia": {}}}).document()["simulated"]
    """
    scene = scene_from(scene)
    plan = _measured(scene, cache)
    if scene.accuracy.tolerance != "imperceptible" or plan.response["method"] == "silence":
        return plan
    unfelt = _unfelt(scene, plan)
    parts = (replace(plan.simulated[0], reason=f"{plan.simulated[0].reason} {unfelt['sentence']}"), *plan.simulated[1:])
    return replace(plan, simulated=parts, response=plan.response | {"imperceptible": unfelt})


def _measured(scene: Scene, cache: ResponseCache | None) -> Plan:
    started, kernels = perf_counter(), kernel_seconds()
    kept = ResponseCache() if cache is None else cache
    voice = Voice(prepare(scene, kept), cache=kept)
    setup = max(0.0, perf_counter() - started - (kernel_seconds() - kernels))
    per_frame = _seconds_a_frame(voice)
    cost = Cost(
        setup_seconds=setup,
        ns_per_frame=1e9 * per_frame,
        times_real_time=1.0 / (per_frame * voice.sample_rate),
        memory_bytes=voice.memory_bytes,
        process_seconds=process_seconds(),
        compile_seconds=compile_seconds(),
    )
    return replace(plan_with_contact(voice.solved), cost=cost)


def plan_with_contact(solved: Preparation) -> Plan:
    """Return the plan of a prepared scene with the figures of its contact, without its cost."""
    plan = plan_of(solved)
    return replace(plan, response=plan.response | _contact_summary(solved))


def _seconds_a_frame(voice: Voice) -> float:
    """Return the time per frame (s) of the fastest of several blocks, or of one chunk of solved frames."""
    frames, repeats = voice.frames_together, 1
    if not frames:
        tried = _seconds_of(voice, TRIED_FRAMES)
        frames, repeats = (TRIED_FRAMES, 1) if tried > SLOW else (TIMED_FRAMES, REPEATS)
    # after a seek, a simulation also computes a time before the frame, so it is timed without seeking
    goes_on = repeats == 1 or (voice.solved.effects is not None and voice.scene.scan.trajectory is None)
    times = []
    for _ in range(repeats):
        if not goes_on:
            voice.seek(0)
        times.append(_seconds_of(voice, frames))
    return min(times) / frames


def _seconds_of(voice: Voice, frames: int) -> float:
    started = perf_counter()
    voice.render(frames)
    return perf_counter() - started


def _unfelt(scene: Scene, plan: Plan) -> dict[str, Any]:
    """Return the tolerance of "imperceptible", and what it saves compared with UNFELT_AGAINST."""
    tolerance, threshold = plan.response["tolerance"], scene.accuracy.threshold
    unfelt: dict[str, Any] = {"threshold": threshold, "tolerance": tolerance, "against": UNFELT_AGAINST, "saved": None}
    unfelt["sentence"] = f'An error 6 dB below the threshold "{threshold}" needs a tolerance of {tolerance:.2g}.'
    if scene.scan.trajectory is not None:
        return unfelt
    accuracy = scene.accuracy.model_copy(update={"tolerance": UNFELT_AGAINST})
    plan, tight = _measured(scene, None), _measured(scene.model_copy(update={"accuracy": accuracy}), None)
    unfelt["saved"] = saved = {
        "phases_solved": tight.response["phases_solved"] - plan.response["phases_solved"],
        **{name: getattr(tight.cost, name) - getattr(plan.cost, name) for name in SAVED},
    }
    words = (
        f"{saved['phases_solved']} solved phases",
        f"{1e3 * saved['setup_seconds']:.3g} ms of set-up",
        f"{saved['ns_per_frame']:.3g} ns per frame",
        f"{saved['memory_bytes'] / 1024:.3g} KiB",
    )
    listed = ", ".join(text for text, amount in zip(words, saved.values(), strict=True) if amount > 0)
    unfelt["sentence"] += f" Compared with {UNFELT_AGAINST:g} it saves {listed or 'nothing'}."
    return unfelt


def _contact_summary(solved: Preparation) -> dict[str, Any]:
    """Return stiffness (N/m), contact_fraction, rms (SI, per quantity), sensation_level_db and groups.

    The stiffness is k of eqs 4-5; of a round finger it is dw/dz. A value that is not known is None, as rms and level of
    a motion that is not along x.
    """
    summary: dict[str, Any] = dict.fromkeys(("stiffness", "contact_fraction", "rms", "sensation_level_db", "groups"))
    contact, load = solved.contact, solved.scene.scan.load
    if contact is None or load <= 0.0:
        return summary
    turns = np.arange(PHASES) / PHASES
    height, falls = contact.approach(turns, load)
    _depth, touching = contact.measure(turns, height, load)
    length = float(np.mean(touching)) * contact.geometry_at(load).contact_length
    # a round finger is solved over a length beyond its contact: k over that length is no property of the finger
    spanned = contact.dome > 0.0
    summary["stiffness"] = -1.0 / float(np.mean(falls)) if spanned else contact.stiffness_at(load)
    whole = contact.width_at(load) if spanned else max(solved.scene.finger.contact_length, length)
    summary["contact_fraction"] = min(1.0, length / whole)
    groups = Groups.of_contact(contact.geometry, contact.stiffness, load)
    summary["groups"] = None if groups is None else asdict(groups)
    if solved.spectrum is not None and solved.turns and solved.scene.scan.along_x:
        lines = [2.0 * np.abs(solved.series(order)[1:]) for order in range(3)]
        summary["rms"] = {
            one.quantity: math.hypot(one.level, math.sqrt(0.5 * float(np.sum(lines[one.order] ** 2))))
            for one in solved.channels
        }
        felt = threshold_displacement(
            abs(solved.turns) * np.arange(1, len(lines[0]) + 1), solved.scene.accuracy.threshold
        )
        strongest = float(np.max(lines[0] / felt, initial=0.0))
        summary["sensation_level_db"] = 20.0 * math.log10(strongest) if strongest > 0.0 else None
    return summary
