"""Run the chunks of a study: in this process, in processes of this machine, or on a Dask cluster.

Stage   STUDY.
Model   Every task solves one whole chunk. A process of this machine writes it, too: an answer of a few bytes goes
        through its pipe at once, so that one who dies does not leave half an answer, for which others would wait. A
        worker of a cluster returns its numbers, and this process writes them. A worker that dies takes its chunk with
        it: the chunk is solved again, up to TRIES times. What is finished stays in the folder of parts, also after an
        interrupt, so the same study goes on where it ended.
Limits  A short study runs in this process, since another takes a second to start.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path
from threading import Thread
from time import perf_counter, sleep
from typing import Any

from synth.errors import CannotRender
from synth.linear_algebra import use_one_thread
from synth.study.chunks import Chunk, chunk_of_some, chunks_of, read, solved, write
from synth.study.spec import StudySpec

TRIES = 3
AHEAD = 2  # chunks that wait for each worker
TRIED, START = 4, 2.0  # scenes by which the time is foreseen; s until processes have begun
Progress = Callable[[int, int], None]
"""Called with the number of scenes done, and of all scenes."""
Work = Callable[[Chunk, Path], int]
"""What is done for a chunk, in a process that can import it; returns its number of scenes."""


def is_solved(chunk: Chunk, folder: Path) -> bool:
    """Return whether `folder` has the numbers of a chunk."""
    return read(chunk, folder) is not None


def finish(chunk: Chunk, folder: Path) -> int:
    """Solve a chunk, keep it in `folder`, and return its number of scenes."""
    write(chunk, solved(chunk), folder)
    return len(chunk.values)


def run(
    spec: StudySpec, folder: Path, *, workers: int | None = None, scheduler: str | None = None,
    progress: Progress | None = None, work: Work = finish, is_done: Callable[[Chunk, Path], bool] = is_solved,
) -> None:  # fmt: skip
    """Carry out `work` for every chunk of `spec` of which `is_done` is false: solve it, and keep it in `folder`.

    workers: processes; None for one a processor; 1 for this process.
    scheduler: address of a Dask scheduler, in place of processes; it solves chunks and does no other work.
    Raises CannotRender where workers die again and again, and OSError where a chunk cannot be written.
    """
    done, todo = 0, []
    for chunk in chunks_of(spec):
        if is_done(chunk, folder):
            done += len(chunk.values)
        else:
            todo.append(chunk)
    if progress is not None:
        progress(done, spec.count)
    several = min(workers or os.cpu_count() or 1, len(todo))
    if scheduler is not None:
        finished = _on_cluster(todo, folder, scheduler)
    elif several > 1:
        finished = _in_processes(todo, folder, several, work)
    else:
        finished = (work(chunk, folder) for chunk in todo)
    for scenes in finished:
        done += scenes
        if progress is not None:
            progress(done, spec.count)


def foreseen(spec: StudySpec, workers: int | None = None) -> float:
    """Return how long the whole study would take, s, from a few of its scenes that are solved now."""
    chunk = next(chunks_of(spec))
    tried = chunk_of_some(spec, range(spec.count // (2 * TRIED), spec.count, max(1, spec.count // TRIED)))
    solved(replace(tried, values=tried.values[:1]))  # kernels and the finger are prepared
    started = perf_counter()
    solved(tried)
    seconds = (perf_counter() - started) / len(tried.values) * spec.count
    several = min(workers or os.cpu_count() or 1, -(-spec.count // len(chunk.values)))
    return seconds / several + (START if several > 1 else 0.0)


def _end_with(parent: int) -> None:
    """Let this process end when its parent has ended: it would wait for work for ever."""

    def watch() -> None:
        while os.getppid() == parent:
            sleep(1.0)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


def _in_processes(todo: list[Chunk], folder: Path, workers: int, work: Work) -> Iterator[int]:
    """Yield the scenes of each chunk that a process has finished. Chunks of a process that died are solved again."""
    use_one_thread()
    left, tried = {chunk.first: chunk for chunk in todo}, dict.fromkeys((chunk.first for chunk in todo), 0)
    while left:
        try:
            context, parent = get_context("spawn"), (os.getpid(),)
            with ProcessPoolExecutor(workers, context, initializer=_end_with, initargs=parent) as pool:
                waiting: dict[Future[Any], Chunk] = {}
                coming = iter(list(left.values()))
                try:
                    while left:
                        for chunk in coming:
                            tried[chunk.first] += 1
                            waiting[pool.submit(work, chunk, folder)] = chunk
                            if len(waiting) >= AHEAD * workers:
                                break
                        for future in wait(waiting, return_when="FIRST_COMPLETED").done:
                            chunk = waiting.pop(future)
                            scenes = future.result()
                            del left[chunk.first]
                            yield scenes
                except BaseException:
                    pool.shutdown(wait=False, cancel_futures=True)
                    raise
        except BrokenProcessPool:
            worst = max(tried[first] for first in left)
            if worst >= TRIES:
                reason = f"A process of the study ended {TRIES} times; the chunks that are finished are kept."
                raise CannotRender(f"{reason} Give it more memory, or fewer workers.") from None


def _on_cluster(todo: list[Chunk], folder: Path, address: str) -> Iterator[int]:
    """Yield the scenes of each chunk that a worker of a Dask cluster has solved, and that is kept in `folder`."""
    try:
        distributed: Any = import_module("distributed")
    except ModuleNotFoundError:
        raise CannotRender("A cluster needs the extra `cluster`: pip install 'ridgewave[cluster]'.") from None
    try:
        client = distributed.Client(address, timeout=10)
    except (OSError, ValueError, TimeoutError) as error:
        raise CannotRender(f"The scheduler at {address} does not answer. Check its address.") from error
    with client:
        futures = client.map(solved, todo, pure=False, retries=TRIES)
        by_key = {future.key: chunk for future, chunk in zip(futures, todo, strict=True)}
        for future in distributed.as_completed(futures):
            try:
                numbers = future.result()
            except Exception as error:
                reason = f"A worker of the cluster could not solve a chunk ({type(error).__name__}). Others are kept."
                raise CannotRender(reason) from error
            write(by_key[future.key], numbers, folder)
            yield len(by_key[future.key].values)
            future.release()
