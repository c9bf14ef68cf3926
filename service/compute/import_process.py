"""Reads an uploaded surface, or a file of the command line, in a process of its own.

    python -m service.compute.import_process    {"path", "file", "options", "heights"} on standard input

Model: many parsers may read a file from anywhere, and some belong to other packages. A process bounds their memory
    and time, and a fault of a parser ends that process only. Its outcome is one JSON object with "report", "spacing"
    and "picture" (PNG, base64), and the heights as NPY in the file "heights"; or with "faults" (InvalidRequest), and
    the "cause" of a reader that failed; or with "reason" (CannotRender). AT_A_TIME imports run at a time in each
    process of the service. Others wait; clients take turns, and one client has half of the places at most. An import
    that is cancelled kills its process.
Limits: the bound on memory holds on Linux. If the service is killed, the process continues to its end.
"""

from __future__ import annotations

import asyncio
import base64
import json
import logging
import os
import resource
import signal
import sys
import tempfile
import traceback
from collections.abc import AsyncIterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, asynccontextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.compute.resource_bounds import bound
from service.compute.work_places import Places
from service.problems import Problem
from synth.errors import CannotRender, Fault, InvalidRequest
from synth.linear_algebra import ONE_THREAD

if TYPE_CHECKING:
    from synth.surfaces.surface_data import SurfaceData

AT_A_TIME = 2
LOWER = 5  # nice value
LONGEST_CPU = 90  # s of processor time; the largest text takes a minute on a slow machine
LONGEST = 180.0  # s; a busy machine gives an import half of a processor or more
MOST_MEMORY = 3 * 2**30  # bytes of address space: the largest surface takes 1.2 GB, and its libraries less than 1 GB
NO_ROOM = (
    "an import needs temporary files, and none can be made or written here: free space, or set TMPDIR to a folder that "
    "can be written."
)
CRASHES = signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL, signal.SIGABRT  # in a library
LONGEST_TRACEBACK = 8000  # characters of what a reader wrote before it crashed that the log keeps
LONGEST_LINE = 200  # characters of the error of a reader
ROOT = Path(__file__).resolve().parents[2]  # import path of the process

log = logging.getLogger("ridgewave.service")


@dataclass(frozen=True)
class Uploaded:
    """An uploaded surface. picture: PNG, base64."""

    surface: SurfaceData
    report: dict[str, Any]
    picture: str


class Imports:
    """The imports of one process of the service."""

    def __init__(self) -> None:
        self._places = Places(0, 0, lambda _seconds: None, AT_A_TIME)
        self._under_way: set[asyncio.subprocess.Process] = set()
        self._closed = False

    def close(self) -> None:
        """End the imports under way, and accept no more."""
        self._closed = True
        for process in self._under_way:
            process.kill()

    @asynccontextmanager
    async def turn(self, client: str) -> AsyncIterator[None]:
        """Wait for the turn of `client`, and hold its place."""
        place = await self._places.enter(client)
        try:
            yield
        finally:
            place.leave()

    async def read(self, path: Path, file: str, options: Mapping[str, Any], folder: Path) -> Uploaded:
        """Return the surface in the file at `path`. In the service, call it within a `turn`.

        file: name that the user's file has.
        folder: private, for the heights.
        Raises InvalidRequest, CannotRender, and Problem (closing) at a shutdown.
        """
        request = {"path": str(path), "file": file, "options": options, "heights": str(folder / "heights")}
        code, outcome, messages = await self._outcome(json.dumps(request).encode())
        if self._closed:
            raise Problem("closing", "The service is shutting down.")
        answer = answer_of(code, outcome, messages)
        surface = await asyncio.to_thread(_surface, folder / "heights", answer["spacing"])
        return Uploaded(surface, answer["report"], answer["picture"])

    async def _outcome(self, request: bytes) -> tuple[int, bytes, bytes]:
        if self._closed:
            raise Problem("closing", "The service is shutting down.")
        path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-Pm",
            "service.compute.import_process",
            env={**os.environ, **ONE_THREAD, "PYTHONPATH": path},
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
        )
        self._under_way.add(process)
        try:
            async with asyncio.timeout(LONGEST):
                outcome, messages = await process.communicate(request)
        except TimeoutError:
            return -1, b"", b""
        finally:
            self._under_way.discard(process)
            if process.returncode is None:
                process.kill()
                await process.wait()
        return process.returncode or 0, outcome, messages


def answer_of(code: int, outcome: bytes, messages: bytes) -> dict[str, Any]:
    """Return the answer of a process that ended with `code`; negative: by that signal.

    outcome: what it printed.
    messages: what it wrote to standard error.
    Raises InvalidRequest, CannotRender, and RuntimeError for a bug.
    """
    if -code in CRASHES:
        log.info("a reader crashed on a file: signal %d\n%s", -code, _shortened(messages.decode(errors="replace")))
        fault = "a file on which its reader crashes", "a whole file", "Copy it again, or export it as X3P."
        raise InvalidRequest([Fault("/file", *fault)])
    if -code == signal.SIGXCPU or (code > 0 and b"MemoryError" in messages):
        needs = f"{LONGEST_CPU} s of processor time" if code < 0 else f"{MOST_MEMORY} bytes of memory"
        fault = f"a file whose import needs more than {needs}", "a smaller file", "Crop it, or copy it again."
        raise InvalidRequest([Fault("/file", *fault)])
    if code < 0:
        raise CannotRender("The import was stopped: this machine has too little time or memory for it.")
    if code != 0:
        raise RuntimeError(f"the importing process ended with {code}:\n{messages.decode(errors='replace')}")
    answer: dict[str, Any] = json.loads(outcome)
    if "faults" in answer:
        if answer.get("cause"):
            log.info("a reader failed on a file, which was refused: %s", answer["cause"])
        raise InvalidRequest([Fault(**fault) for fault in answer["faults"]])
    if "reason" in answer:
        raise CannotRender(answer["reason"])
    return answer


def _shortened(text: str) -> str:
    """Return the end of a text for the log."""
    return text[-LONGEST_TRACEBACK:]


def read_here(path: Path, options: Mapping[str, Any]) -> Uploaded:
    """Return the surface in a file of this machine's user.

    Raises InvalidRequest, CannotRender, and OSError if the file cannot be opened.
    """
    if path.is_file():
        path.open("rb").close()  # its error names the file

    def read() -> Uploaded:
        with ExitStack() as until_done:
            try:
                folder = until_done.enter_context(tempfile.TemporaryDirectory(prefix="ridgewave-"))
            except OSError as error:
                raise CannotRender(NO_ROOM) from error
            return asyncio.run(Imports().read(path, path.name, options, Path(folder)))

    with ThreadPoolExecutor(1) as own_loop:  # a notebook has an event loop in this thread already
        return own_loop.submit(read).result()


def _surface(path: Path, spacing: list[float]) -> SurfaceData:
    import numpy as np

    from synth.surfaces.surface_data import SurfaceData

    found = SurfaceData(np.load(path), tuple(spacing))
    assert found.address  # computed here, in a thread
    return found


def main() -> None:
    """Read the request, import, and print the outcome."""
    set_bounds()
    os.nice(LOWER)  # streams go first
    request = json.load(sys.stdin)
    with os.fdopen(os.dup(1), "wb") as answer:
        os.dup2(2, 1)  # what a library prints is no part of the answer
        answer.write(encoded(outcome_of(request)))


def set_bounds() -> None:
    """Bound this process, and silence what libraries log about a file."""
    for kind, most in (
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_AS, MOST_MEMORY),
        (resource.RLIMIT_CPU, LONGEST_CPU),
    ):
        bound(kind, most)
    logging.disable()


def encoded(outcome: Mapping[str, Any]) -> bytes:
    """Return an outcome as JSON. Names in a damaged file may be no text: they have question marks then."""
    return json.dumps(outcome, allow_nan=False, ensure_ascii=False).encode("utf-8", "replace")


def outcome_of(request: dict[str, Any]) -> dict[str, Any]:
    """Return the outcome of an import."""
    try:
        return _imported(request)
    except InvalidRequest as error:
        cause = error.__cause__
        return {"faults": [asdict(fault) for fault in error.faults], "cause": "" if cause is None else _line_of(cause)}
    except CannotRender as error:
        return {"reason": error.reason}


def _line_of(error: BaseException) -> str:
    """Return an error and its place, as a line for the log."""
    place = traceback.extract_tb(error.__traceback__)[-1:]
    where = "".join(f" ({Path(one.filename).name}, line {one.lineno})" for one in place)
    return f"{type(error).__name__}: {' '.join(str(error).split())[:LONGEST_LINE]}{where}"


def _imported(request: dict[str, Any]) -> dict[str, Any]:
    import numpy as np

    from synth.surfaces.measurement.import_options import read_options
    from synth.surfaces.measurement.importing import import_surface
    from synth.surfaces.measurement.relief_picture import mark_of, relief_picture

    folder, options = Path(request["heights"]).parent, read_options(request["options"])
    found = import_surface(Path(request["path"]), options, request["file"], folder)
    try:
        with open(request["heights"], "wb") as file:
            np.save(file, found.surface.heights)
    except OSError as error:
        raise CannotRender(NO_ROOM) from error
    picture = base64.b64encode(relief_picture(found.heights, found.spacing, mark_of(found.report))).decode()
    return {"report": found.report, "spacing": list(found.spacing), "picture": picture}


if __name__ == "__main__":
    main()
