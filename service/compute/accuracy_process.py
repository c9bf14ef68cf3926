"""Measures what accuracy costs, in a process of its own.

    python -m service.compute.accuracy_process

It reads {"scene", "quantity", "textures", "live"} from standard input, and prints the outcome.

Model: a measurement computes for up to a minute, much of it in Python. In a thread it would delay every stream of this
    process, its timings would be those of a busy interpreter, and a shutdown would have to wait for it. A process can
    be killed, and runs at the lowest priority. Its outcome is one JSON object with "document", "faults"
    (InvalidRequest) or "reason" (CannotRender). Any other outcome is a bug.
Limits: the process shares the processors with the renders of the service, so timings are reliable on an idle machine
    only. If the service is killed, the process continues to its end.
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

from service.store.store import Store
from synth.errors import CannotRender, Fault, InvalidRequest, SceneError
from synth.scene.scene import Scene, parse_scene, scene_document
from synth.scene.text import json_text, object_from_text
from synth.surfaces.surface_data import add_source

LONGEST = 300.0  # s; several times what any scene takes on an idle machine
POLL_SECONDS = 0.1  # between checks of `given_up`; a shutdown waits this long
LOWEST_PRIORITY = 19
KILLED = -9  # exit code of a process that the system killed
ROOT = Path(__file__).resolve().parents[2]  # import path of the process


def measure_apart(
    scene: Scene,
    quantity: str | None,
    given_up: threading.Event,
    textures: Path | None = None,
    *,
    live: bool = False,
) -> dict[str, Any]:
    """Return the document of `measure_accuracy`. Blocks for up to a minute: call it from a thread.

    given_up: when set, the process is killed and CannotRender is raised.
    textures: folder of the imported textures, one of which the scene may have.
    live: measure a live voice, behind a hand.
    Raises InvalidRequest and CannotRender as the measurement does, and CannotRender if it took longer than LONGEST or
    the system killed it.
    """
    folder = None if textures is None else str(textures.absolute())
    request = json_text({"scene": scene_document(scene), "quantity": quantity, "textures": folder, "live": live})
    code, outcome, messages = _answer_of_process(request, given_up)
    if code == KILLED:
        raise CannotRender("The system ended the measurement, most likely because the memory of this machine is full.")
    if code != 0:
        raise RuntimeError(f"the measuring process ended with {code}:\n{messages.decode(errors='replace')}")
    answer: dict[str, Any] = object_from_text(outcome)
    if "faults" in answer:
        kind = SceneError if answer["of_scene"] else InvalidRequest
        raise kind([Fault(**fault) for fault in answer["faults"]])
    if "reason" in answer:
        raise CannotRender(answer["reason"])
    document: dict[str, Any] = answer["document"]
    return document


def _answer_of_process(request: bytes, given_up: threading.Event) -> tuple[int, bytes, bytes]:
    """Return exit code, standard output and standard error; raises CannotRender if the process was stopped."""
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    deadline = time.monotonic() + LONGEST
    with subprocess.Popen(
        [sys.executable, "-Pm", "service.compute.accuracy_process"],
        env={**os.environ, "PYTHONPATH": path},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        given: bytes | None = request
        try:
            while not given_up.is_set() and time.monotonic() < deadline:
                try:
                    outcome, messages = process.communicate(given, timeout=POLL_SECONDS)
                    return process.returncode, outcome, messages
                except subprocess.TimeoutExpired:
                    given = None  # already passed on
        finally:
            process.kill()
    raise CannotRender(
        "The measurement was given up."
        if given_up.is_set()
        else f"The measurement took longer than {LONGEST:g} s and was stopped: this machine is too busy."
    )


def main() -> None:
    """Read the request, measure, and print the outcome."""
    if hasattr(os, "nice"):
        os.nice(LOWEST_PRIORITY)
    from synth.accuracy.report import measure_accuracy

    request = json.load(sys.stdin)
    if request["textures"] is not None:
        add_source(Store(Path(request["textures"])).surface)
    scene = parse_scene(request["scene"])
    outcome: dict[str, Any]
    try:
        outcome = {"document": measure_accuracy(scene, quantity=request["quantity"], live=request["live"]).document()}
    except InvalidRequest as error:
        names = ("pointer", "value", "allowed", "hint")
        faults = [{name: getattr(fault, name) for name in names} for fault in error.faults]
        outcome = {"faults": faults, "of_scene": isinstance(error, SceneError)}
    except CannotRender as error:
        outcome = {"reason": error.reason}
    print(json.dumps(outcome, allow_nan=False))


if __name__ == "__main__":
    main()
