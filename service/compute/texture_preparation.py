"""Solves the textures of the catalogue before somebody asks for them, in a process of its own.

    python -m service.compute.texture_preparation FOLDER    the data folder

Model: one texture after the other is opened under the finger with which the page begins. What that solves is kept as
    files (`synth.response.kept_files`), which every process with the same data folder reads. Textures that have their
    files are opened from them. The process has one thread and the lowest priority: on Linux it runs only while a
    processor has nothing else to do. One process at a time works for a data folder; another one ends at once. It ends
    when all are solved, with the service, or when the service has gone.
Limits: it takes its share of a quota of processor time, such as that of a container.
"""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from service.store.data_folder import tables_folder
from synth.errors import RidgewaveError

if TYPE_CHECKING:
    from synth.scene.scene import Scene

LOCK = "preparing.lock"  # in the data folder
LOWEST = 19  # nice value
END_SECONDS = 1.0  # for the process to leave no half-written file; on a busy machine it may not get to run
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
        """Start the process. From any thread."""
        if self._closed:
            return
        path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
        one_thread = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        self._process = subprocess.Popen(
            [sys.executable, "-m", "service.compute.texture_preparation", str(self.folder)],
            env={**os.environ, **one_thread, "PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        log.info("preparing the textures of the catalogue at the lowest priority, in process %d", self._process.pid)
        if self._closed:
            self.close()

    def close(self) -> None:
        """Ask the process to end; another start solves what it has not finished. Further calls do no harm."""
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


def solve_ahead(scene: Scene, folder: Path) -> None:
    """Solve what a hand on `scene` needs first, and keep it in the data folder `folder`. Raises SceneError."""
    from synth.response.kept_files import KeptFiles
    from synth.response.response_cache import ResponseCache
    from synth.voice.hand_voice import HandVoice

    HandVoice(scene, cache=ResponseCache(files=KeptFiles(tables_folder(folder))))


def step_back() -> None:
    """Give this process the lowest priority."""
    os.nice(LOWEST)
    if sys.platform == "linux":
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


def main(folder: Path) -> None:
    """Prepare the catalogue for the data folder `folder`, unless another process does."""
    import fcntl

    service = os.getppid()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    step_back()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    with (folder / LOCK).open("wb") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return
        from synth.scene.catalogue import FINGER, catalogue
        from synth.scene.scene import parse_scene

        for entry in catalogue():
            if os.getppid() != service:
                return
            with suppress(RidgewaveError):
                solve_ahead(parse_scene({"finger": FINGER, **entry.document}), folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
