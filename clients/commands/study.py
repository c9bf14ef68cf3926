"""`ridgewave study SPEC -o OUT`: solves many steady scenes and writes their vibration as one labelled dataset.

Finished chunks are kept in OUT.parts, from which the same command goes on after an interrupt; they are deleted when OUT
is complete.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from clients.command_line.exit_codes import DONE, invalid_request
from clients.command_line.printing import print_json, print_table, say, warn
from clients.command_line.progress import Progress, Waiting
from service.store.own_textures import with_imported
from synth.scene.text import object_from_text
from synth.scene.texture_registry import with_files


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    from synth.study.dataset import checked_path, numbers_of, write_result
    from synth.study.running import foreseen
    from synth.study.running import run as solve
    from synth.study.spec import read_spec

    path = Path(arguments.output)
    checked_path(path, overwrite=arguments.overwrite)
    if arguments.workers is not None and arguments.workers < 1:
        invalid_request("--workers", str(arguments.workers), "a whole number from 1", "Write 1 for one process.")
    document = _document(arguments.spec)
    if isinstance(document.get("scene"), dict):
        document["scene"] = with_imported(with_files(document["scene"]))
    spec = read_spec(document)
    with Waiting("trying some scenes", arguments.progress):
        seconds = foreseen(spec, arguments.workers)
    say(f"{spec.count} scenes, some {seconds:.2g} s")
    parts = path.with_name(f"{path.name}.parts")
    try:
        with Progress("solving", spec.count, "scenes", arguments.progress) as bar:
            reported = 0

            def progress(done: int, _all: int) -> None:
                nonlocal reported
                bar.advance(done - reported)
                reported = done

            solve(spec, parts, workers=arguments.workers, scheduler=arguments.scheduler, progress=progress)
    except (KeyboardInterrupt, OSError):
        warn(f"finished scenes are kept in {parts}; the same command goes on from there")
        raise
    numbers = numbers_of(spec, parts)
    write_result(spec, numbers, path)
    shutil.rmtree(parts, ignore_errors=True)
    failed = [reason for reason in numbers["reason"].tolist() if reason]
    result = {"path": str(path), "scenes": spec.count, "not_solved": len(failed), "reasons": sorted(set(failed))[:10]}
    if arguments.json:
        print_json(result)
        return DONE
    rows = [("file", str(path)), ("scenes", str(spec.count)), ("not solved", str(len(failed)))]
    print_table("", ("study", "value"), rows)
    for reason in sorted(set(failed))[:10]:
        warn(f"not solved: {reason}")
    return DONE


def _document(source: str) -> dict[str, object]:
    """Return the spec in a JSON file, or from standard input."""
    if source == "-":
        return object_from_text(sys.stdin.buffer.read())
    try:
        return object_from_text(Path(source).read_bytes())
    except (FileNotFoundError, IsADirectoryError):
        invalid_request("SPEC", source, "a JSON file that exists, or -", "Check the path; docs/study.md has examples.")
