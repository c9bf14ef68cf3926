"""Imports damaged files and bombs as the service does, and counts what a client would be answered.

    python -m tests.service.damaged_imports [--each 1000] [--seed 1] [--format PNG] [--bombs] [--json]

The files are read by copies of this process, AT_ONCE by each, with the bounds of an importing process: a start for each
file would take a second. The status is that of the service for the outcome of the process, or for its end. The longest
time is of the wall clock; the most memory is that of the process with its libraries. A whole file is imported after the
damaged ones.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import resource
import sys
import tempfile
import time
import traceback
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from service import problems
from service.compute import import_process
from synth.errors import RidgewaveError
from tests.synth.surfaces.readers.bombs import bombs
from tests.synth.surfaces.readers.damage import damaged, whole_files
from tests.synth.surfaces.readers.usual_files import UsualFile

PATIENCE = 600.0  # s; a copy is stopped after 90 s of processor time
AT_ONCE = 50  # files that one copy imports
STATUSES = (200, 413, 422, 500, 503)


@dataclass
class Found:
    """What was answered for the files of one format."""

    statuses: Counter[int] = field(default_factory=Counter)
    seconds: float = 0.0
    megabytes: float = 0.0
    slowest: str = ""
    wrong: list[str] = field(default_factory=list)

    def add(self, name: str, status: int, told: str, seconds: float, megabytes: float) -> None:
        """Count one answer. `wrong` lists those that are neither an import nor a refusal in words."""
        self.statuses[status] += 1
        if seconds > self.seconds:
            self.seconds, self.slowest = seconds, name
        self.megabytes = max(self.megabytes, megabytes)
        if status not in (200, 413, 422) or (status != 200 and not told):
            self.wrong.append(f"{name}: {status} {told[-2000:]}")


def load_libraries() -> None:
    """Import what an import needs, before the copies are made."""
    import PIL.Image  # noqa: F401
    import scipy.io  # noqa: F401
    import tifffile  # noqa: F401

    import synth.surfaces.measurement.importing
    import synth.surfaces.measurement.missing_points
    import synth.surfaces.measurement.relief_picture  # noqa: F401

    with suppress(ImportError):
        import h5py  # noqa: F401
        import SurfaceTopography.IO  # noqa: F401


class Request:
    """One file to import, and what its import came to."""

    def __init__(self, name: str, content: bytes, options: dict[str, str]) -> None:
        self.name, self.content, self.options = name, content, options
        self.code, self.outcome, self.messages, self.seconds, self.megabytes = 0, b"", b"", 0.0, 0.0


def import_in_copies(requests: list[Request], folder: Path) -> None:
    """Import files one after another in a copy of this process; after a crash, the rest in a new copy."""
    left = list(requests)
    while left:
        log = folder / "log"
        began = time.perf_counter()
        copy = os.fork()
        if copy == 0:
            _import_all(left, folder, log)
        ended, state, use = 0, 0, None
        while not ended and time.perf_counter() < began + PATIENCE:
            ended, state, use = os.wait4(copy, os.WNOHANG)
            time.sleep(0 if ended else 0.005)
        if not ended:
            os.kill(copy, 9)
            _, state, use = os.wait4(copy, 0)
        done = [pickle.loads(bytes.fromhex(line)) for line in log.read_text().splitlines()] if log.exists() else []
        for request, values in zip(left, done, strict=False):
            request.code, request.outcome, request.messages, request.seconds, request.megabytes = values
        left = left[len(done) :]
        if left:  # the copy ended on the first of these
            assert use is not None
            crashed, left = left[0], left[1:]
            crashed.code = os.waitstatus_to_exitcode(state)
            crashed.seconds = time.perf_counter() - began - sum(values[3] for values in done)
            crashed.megabytes = use.ru_maxrss / 1024
        log.unlink(missing_ok=True)


def _import_all(requests: list[Request], folder: Path, log: Path) -> None:
    """Import in this copy, which ends with them."""
    try:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        import_process.set_bounds()
        with log.open("w") as done:
            for request in requests:
                values = (*_imported(request, folder), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
                done.write(pickle.dumps(values).hex() + "\n")
                done.flush()
    finally:
        os._exit(0)


def _imported(request: Request, folder: Path) -> tuple[int, bytes, bytes, float]:
    """Return the code, the outcome and the messages of an importing process, and the seconds."""
    path = folder / request.name
    path.write_bytes(request.content)
    asked = {"path": str(path), "file": path.name, "options": request.options, "heights": str(folder / "heights")}
    began, code, outcome, messages = time.perf_counter(), 0, b"", b""
    try:
        outcome = import_process.encoded(import_process.outcome_of(asked))
    except BaseException:
        code, messages = 1, traceback.format_exc().encode()
    seconds = time.perf_counter() - began
    path.unlink()
    return code, outcome, messages, seconds


def _status(code: int, outcome: bytes, messages: bytes) -> tuple[int, str]:
    """Return the status of the service's answer, and its words or the traceback of the bug."""
    try:
        answer = import_process.answer_of(code, outcome, messages)
        json.dumps(answer["report"], ensure_ascii=False, allow_nan=False).encode()
    except RidgewaveError as error:
        problem = problems.of(error)
        whole = all(fault.value and fault.allowed and fault.hint for fault in problem.faults)
        document = json.dumps(problem.document(), ensure_ascii=False, allow_nan=False).encode()
        return problems.TYPES[problem.kind].status, document.decode() if whole else ""
    except Exception as error:
        return 500, f"{error!r}\n{messages.decode(errors='replace')}"
    return 200, ""


def files_of(name: str, several: list[UsualFile], each: int, seed: int) -> Iterator[Request]:
    """Yield `each` damaged files of the format `name`. Their names have the numbers of which each is made again."""
    for number in range(each):
        rng = np.random.default_rng([seed, number, zlib.crc32(name.encode())])
        whole = several[number % len(several)]
        yield Request(f"{number}-{whole.name}", damaged(whole.content, rng), whole.options)


def imports_of(requests: Iterable[Request], folder: Path) -> Found:
    """Import the files, and after each AT_ONCE of them a whole one."""
    found, waiting = Found(), list(requests)
    while waiting:
        some, waiting = waiting[:AT_ONCE], waiting[AT_ONCE:]
        whole = Request("next.csv", b"1\n2\n3\n2\n", {"unit": "um", "pixel": "5 um"})
        import_in_copies([*some, whole], folder)
        for request in some:
            status, told = _status(request.code, request.outcome, request.messages)
            found.add(request.name, status, told, request.seconds, request.megabytes)
        if _status(whole.code, whole.outcome, whole.messages)[0] != 200:
            found.wrong.append(f"the import after {some[-1].name} was not served")
    return found


def all_imports(asked: argparse.Namespace, folder: Path) -> Iterator[tuple[str, Found]]:
    """Yield each format and each bomb with its figures."""
    for name, several in whole_files().items():
        if asked.format is None or name in asked.format:
            yield name, imports_of(files_of(name, several, asked.each, asked.seed), folder)
    if asked.bombs:
        for name, content in bombs():
            yield name, imports_of([Request(name, content, {"unit": "um", "pixel": "5 um"})], folder)


def line_of(name: str, one: Found) -> str:
    """Return the figures of a format as a line of the table."""
    counts = "".join(f"{one.statuses[status]:7}" for status in STATUSES)
    return f"{name:26}{counts}{one.seconds:11.2f}{one.megabytes:9.0f}  {one.slowest}"


def main(arguments: list[str]) -> None:
    """Import, and print the table or the figures as JSON."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--each", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--format", action="append")
    parser.add_argument("--bombs", action="store_true")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args(arguments)
    load_libraries()
    every: dict[str, Found] = {}
    if not asked.json:
        print(f"{'format':26}" + "".join(f"{status:>7}" for status in STATUSES) + f"{'longest s':>11}{'most MB':>9}")
    with tempfile.TemporaryDirectory() as folder:
        for name, found in all_imports(asked, Path(folder)):
            every[name] = found
            if not asked.json:
                print(line_of(name, found), *found.wrong, sep="\n  ", flush=True)
    if asked.json:
        print(json.dumps({name: vars(one) for name, one in every.items()}))


if __name__ == "__main__":
    main(sys.argv[1:])
