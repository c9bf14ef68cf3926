"""Measures what accuracy costs in a process of its own, which can be stopped and takes nothing from the streams.

    python -m service.compute.accuracy_process    {"scene", "quantity"} on standard input; outcome on standard output

Model: the measuring computes for up to a minute and much of it in Python. In a thread it would hold up whoever renders
    in this interpreter, its timings would be those of a busy interpreter, and a shutdown would have to wait for it. The
    process runs at the lowest priority, so that on a full machine sound comes first. Its outcome is one JSON object:
    "document", or "faults" (InvalidRequest), or "reason" (CannotRender); anything else is our bug.
Limits: it shares the processors with what the service renders meanwhile, so its timings are those of an idle machine
    only on one. A service that is killed outright leaves it to its end.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

from synth.errors import CannotRender, Fault, InvalidRequest
from synth.scene.scene import Scene, parse_scene, scene_document

LONGEST = 300.0  # s; several times what any scene should take: beyond it the machine is too busy to measure anything
GLANCE = 0.1  # s between looks at whether it is still wanted; a shutdown waits this long
LOWEST_PRIORITY = 19
KILLED = -9  # the exit code of a process that the system has killed
ROOT = Path(__file__).resolve().parents[2]  # what the process imports, wherever it is started


def measure_apart(scene: Scene, quantity: str | None, given_up: threading.Event) -> dict[str, Any]:
    """Return the document of `measure_accuracy`; for a thread.

    given_up: set by whoever does not want it any more; the process is ended. Raises InvalidRequest and CannotRender as
    the measuring does, CannotRender where it was given up, took longer than LONGEST, or was killed.
    """
    asked = json.dumps({"scene": scene_document(scene), "quantity": quantity}).encode()
    code, outcome, told = _answer_of_process(asked, given_up)
    if code == KILLED:
        raise CannotRender("The measuring was ended by the system: as a rule, the memory of this machine is full.")
    if code != 0:
        raise RuntimeError(f"the measuring process ended with {code}:\n{told.decode(errors='replace')}")
    answer: dict[str, Any] = json.loads(outcome)
    if "faults" in answer:
        raise InvalidRequest([Fault(**fault) for fault in answer["faults"]])
    if "reason" in answer:
        raise CannotRender(answer["reason"])
    document: dict[str, Any] = answer["document"]
    return document


def _answer_of_process(asked: bytes, given_up: threading.Event) -> tuple[int, bytes, bytes]:
    """Return exit code, standard output and standard error of the process; raises CannotRender where it was ended."""
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    ends = time.monotonic() + LONGEST
    with subprocess.Popen(
        [sys.executable, "-m", "service.compute.accuracy_process"],
        env={**os.environ, "PYTHONPATH": path},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        given: bytes | None = asked
        try:
            while not given_up.is_set() and time.monotonic() < ends:
                try:
                    outcome, told = process.communicate(given, timeout=GLANCE)
                    return process.returncode, outcome, told
                except subprocess.TimeoutExpired:
                    given = None  # it has been sent, or still is
        finally:
            process.kill()
    raise CannotRender(
        "The measuring was given up."
        if given_up.is_set()
        else f"The measuring took longer than {LONGEST:g} s and was stopped: this machine is too busy."
    )


def main() -> None:
    """Read what is asked, measure, and print the outcome."""
    if hasattr(os, "nice"):
        os.nice(LOWEST_PRIORITY)
    from synth.accuracy.report import measure_accuracy

    asked = json.load(sys.stdin)
    scene = parse_scene(asked["scene"])
    outcome: dict[str, Any]
    try:
        outcome = {"document": measure_accuracy(scene, quantity=asked["quantity"]).document()}
    except InvalidRequest as error:
        names = ("pointer", "value", "allowed", "hint")
        outcome = {"faults": [{name: getattr(fault, name) for name in names} for fault in error.faults]}
    except CannotRender as error:
        outcome = {"reason": error.reason}
    print(json.dumps(outcome, allow_nan=False))


if __name__ == "__main__":
    main()
