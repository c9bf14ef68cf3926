"""Solves the textures of the catalogue and imported ones before they are requested, in a process of its own.

    python -m service.compute.texture_preparation FOLDER LOCK    the data folder, and the descriptor of its lock file

Model: the textures are opened one by one, as the page and `/vr` open them: the newest imported ones first, then each
    kind without fields, with which the page begins, then the catalogue. The solved responses are kept as files
    (`synth.kept_files`), which every process with the same data folder reads. A mark among these files shows that a
    texture is done. The process looks for the next texture after each one, so it includes textures that are imported
    meanwhile and skips deleted ones. It has one thread and the lowest priority: on Linux it runs only while a processor
    has nothing else to do. One process at a time works for a data folder. It begins after the start of the service and
    after an import. It ends when all textures are done, with the service, or when the service has gone.
Limits: it uses processor time of a quota, such as that of a container. Of the imported textures of all keys together,
    it solves the newest MOST_IMPORTED of each kind. An import by another program does not start it:
    its next run finds the texture.
"""

from __future__ import annotations

import json
import logging
import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.store.data_folder import tables_folder
from service.store.store import Store
from synth.errors import CannotRender, RidgewaveError
from synth.linear_algebra import ONE_THREAD
from synth.scene.catalogue import FINGER, catalogue
from synth.scene.texture_registry import default_textures

if TYPE_CHECKING:
    from synth.kept_files import FileEntry, KeptFiles

LOCK = "preparing.lock"  # in the data folder; locked by the process that works for it
MOST_IMPORTED = {"profile": 20, "heightmap": 4}  # with 5 and 67 MB of files each: more would displace the catalogue's
SCANS: tuple[dict[str, Any], ...] = ({}, {"scan": {"speed": 0, "load": 0}})  # of the page, and of `/vr`
LOWEST = 19  # nice value
END_SECONDS = 1.0  # for the process to end without a half-written file; on a busy machine it may not run in this time
ROOT = Path(__file__).resolve().parents[2]  # import path of the process

log = logging.getLogger("ridgewave.service")


class TexturePreparation:
    """The process that prepares textures, of one process of the service."""

    def __init__(self, folder: Path) -> None:
        """Prepare for the data folder `folder`, once `begin` is called."""
        self.folder = folder
        self._process: subprocess.Popen[bytes] | None = None
        self._closed = False

    def begin(self) -> None:
        """Start the process, unless one works for the data folder: it also finds new textures. From any thread."""
        if self._closed:
            return
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with (self.folder / LOCK).open("wb") as lock:
            if not _locked(lock.fileno()):
                return
            path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
            module, number = "service.compute.texture_preparation", lock.fileno()
            self._process = subprocess.Popen(
                [sys.executable, "-Pm", module, str(self.folder), str(number)],
                env={**os.environ, **ONE_THREAD, "PYTHONPATH": path},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=[number],  # the process inherits the lock
            )
        threading.Thread(target=self._reap, args=(self._process,), name="preparation", daemon=True).start()
        log.info("preparing textures at the lowest priority, in process %d", self._process.pid)
        if self._closed:
            self.close()

    def _reap(self, process: subprocess.Popen[bytes]) -> None:
        """Wait for the end of `process`, so that it leaves no entry in the table of processes if it is killed."""
        code = process.wait()
        if code != 0 and not self._closed:
            log.warning("the process that prepares textures ended with %d; the next start or import begins it", code)

    def close(self) -> None:
        """Ask the process to end; the next start solves what it has not finished. Further calls do no harm."""
        self._closed = True
        if self._process is not None:
            self._process.terminate()

    def finish(self) -> None:
        """End the process. Call it from a thread, after `close`."""
        if self._process is None:
            return
        try:
            self._process.wait(END_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def solve_ahead(texture: dict[str, Any], folder: Path) -> None:
    """Solve what a hand on `texture`, a partial scene, needs first, and keep it in the data folder `folder`.

    Raises SceneError, CannotRender.
    """
    from synth.kept_files import KeptFiles
    from synth.response_cache import ResponseCache
    from synth.scene.scene import parse_scene
    from synth.voice.hand_voice import HandVoice

    files = KeptFiles(tables_folder(folder))
    cache = ResponseCache(files=files)
    for scan in SCANS:
        HandVoice(parse_scene({"finger": FINGER, **texture, **scan}), cache=cache)
    files.get(_mark(texture), dict)


def _mark(texture: dict[str, Any]) -> FileEntry[dict[str, Any]]:
    """Return the mark that `texture` is done. A check is not a use, so it is deleted soon after unused files."""
    from synth.kept_files import FileEntry, json_form

    return FileEntry(f"prepared {json.dumps(texture, sort_keys=True)}", json_form(dict, dict))


def _next(store: Store, files: KeptFiles, tried: list[dict[str, Any]]) -> dict[str, Any] | None:
    """Return the next texture to solve, as a partial scene; None if none is left."""
    every: list[dict[str, Any]] = []
    with suppress(CannotRender):
        every = [one.document for kind, most in MOST_IMPORTED.items() for one in store.newest(kind, most)]
    every += [*default_textures(), *(entry.document for entry in catalogue())]
    return next((one for one in every if one not in tried and not files.has(_mark(one))), None)


def _locked(lock: int) -> bool:
    """Lock the file with the descriptor `lock`; return False if another process has it."""
    import fcntl

    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def step_back() -> None:
    """Give this process the lowest priority."""
    os.nice(LOWEST)
    if sys.platform == "linux":
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


def main(folder: Path, lock: int) -> None:
    """Solve the textures for the data folder `folder`. lock: descriptor of its lock file, locked by the caller."""
    import fcntl

    from synth.kept_files import KeptFiles
    from synth.surfaces.surface_data import add_source

    service = os.getppid()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    step_back()
    store, files, tried = Store(folder), KeptFiles(tables_folder(folder)), list[dict[str, Any]]()
    add_source(store.surface)
    while _locked(lock):
        while (found := _next(store, files, tried)) is not None:
            if os.getppid() != service:
                return
            tried.append(found)
            with suppress(RidgewaveError):
                solve_ahead(found, folder)
        fcntl.flock(lock, fcntl.LOCK_UN)
        if _next(store, files, tried) is None:  # an import while the file was locked has started no process
            return


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
