"""Which methods a report compares along the motion of a scene.

Stage   after STAGE 3.
"""

from __future__ import annotations

from collections.abc import Sequence

from synth.accuracy.hand import chosen_of, hand_methods
from synth.accuracy.method import LeftOutMethod, Method, Subject
from synth.accuracy.motion import FrameReference, MotionCase, solved_reference
from synth.accuracy.motion_baseline import baseline_along, without_baseline
from synth.accuracy.motion_methods import chosen_name, file_methods, missing_methods
from synth.accuracy.simulated import Simulated, simulated_methods, simulated_reference, step_name, without_methods
from synth.plan.preparation import Preparation


def moving_subject(solved: Preparation, channel: int, setup: float) -> Subject:
    """Return how channel number `channel` of a scene is measured along its own motion.

    solved: the scene, solved as a file in `setup` (s).
    """
    case = MotionCase(solved, channel, setup)
    if solved.simulated:
        scene = Simulated.of(case)
        reference, finest, usual = simulated_reference(scene)
        methods = list(simulated_methods(scene, finest, usual))
        return _subject(case, reference, methods, step_name(scene, 1.0), list(without_methods(scene)))
    reference, finest = solved_reference(case)
    methods = [*baseline_along(case), *file_methods(case, finest)]
    return _subject(case, reference, methods, chosen_name(case), [*without_baseline(case), *missing_methods(case)])


def live_subject(solved: Preparation, channel: int, hand: Preparation, setup: float) -> Subject:
    """Return how channel number `channel` of a live voice is measured.

    solved: the motion of the hand, solved as a file.
    hand: the scene prepared for a hand, which took `setup` (s).
    """
    case = MotionCase(solved, channel, 0.0)
    reference, _finest = solved_reference(case)
    methods = [*baseline_along(case), *hand_methods(case, hand, setup)]
    return _subject(case, reference, methods, chosen_of(case, hand), list(without_baseline(case)), "A live voice. ")


def _subject(
    case: MotionCase,
    reference: FrameReference,
    methods: Sequence[Method],
    chosen: str,
    left_out: Sequence[LeftOutMethod],
    before: str = "",
) -> Subject:
    return Subject(
        quantity=case.planned.quantity,
        extent=reference.extent,
        measured=before + case.words,
        reference_error=reference.error,
        chosen=chosen,
        methods=tuple(methods),
        left_out=tuple(left_out),
        errors=reference.errors,
    )
