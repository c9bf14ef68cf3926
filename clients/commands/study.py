"""`ridgewave study SPEC -o OUT`: solves many steady scenes and writes their vibration as one labelled dataset.

SPEC is a file, the name of a ready study, or a finished study, which is only drawn. Finished chunks are kept in
OUT.parts, from which the same command goes on after an interrupt; they are deleted when OUT is complete.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clients.command_line.exit_codes import DONE, invalid_request
from clients.command_line.printing import print_json, print_table, say, warn
from clients.command_line.progress import Progress, Waiting
from service.store.own_textures import study_with_imported, texture_named, with_imported
from synth.errors import CannotRender
from synth.scene.text import object_from_text
from synth.scene.texture_registry import with_files
from synth.study.spec import ready_names, ready_text

if TYPE_CHECKING:
    from synth.study.spec import StudySpec

FINISHED = (".nc", ".zarr")
Reports = Callable[[int, int], None]
SHOWN_REASONS = 10


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    if arguments.print:
        if Path(arguments.spec).suffix in FINISHED:
            invalid_request("--print", arguments.spec, "a spec", "Its attribute `spec` has it.")
        text = _text(arguments.spec)
        print(text if isinstance(text, str) else json.dumps(object_from_text(text), indent=2))
        return DONE
    if Path(arguments.spec).suffix in FINISHED:
        return _draw_again(arguments)
    if not (arguments.output or arguments.figure or arguments.accuracy or arguments.dataset):
        invalid_request("--output", "none", "a name that ends in .nc, .zarr, .parquet or .csv", "Write -o map.nc.")
    spec = _checked(arguments)
    if arguments.accuracy:
        return _accuracy(spec, arguments)
    result: dict[str, Any] = {"scenes": spec.count}
    if arguments.dataset:
        result |= _render(spec, arguments)
    if arguments.output or arguments.figure:
        result |= _solve(spec, arguments)
    if arguments.json:
        print_json(result)
    return DONE


def _checked(arguments: argparse.Namespace) -> StudySpec:
    """Return the spec, after everything that can be refused has been checked."""
    from clients.study_figures import check_figure, check_study
    from synth.study.dataset import checked_path, needed
    from synth.study.spec import read_spec

    if arguments.output:
        checked_path(Path(arguments.output), overwrite=arguments.overwrite)
    if arguments.workers is not None and arguments.workers < 1:
        invalid_request("--workers", str(arguments.workers), "a whole number from 1", "Write 1 for one process.")
    document = object_from_text(_text(arguments.spec))
    if isinstance(scene := document.get("scene"), str):
        scene = dict(texture_named(scene).document)
    if isinstance(scene, dict):
        document["scene"] = with_imported(with_files(scene))
    spec = read_spec(study_with_imported(document))
    if arguments.dataset:
        _check_dataset(arguments)
    check_figure(spec.figure, arguments.figure or ())
    if arguments.figure:
        needed("xarray")
        check_study(spec)
    return spec


def _duration(seconds: float) -> str:
    """Return a rough time in words."""
    if seconds < 100.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.0f} h"


def _check_dataset(arguments: argparse.Namespace) -> None:
    from synth.study.waveforms import MANIFEST

    folder = Path(arguments.dataset)
    if arguments.scheduler:
        hint = "Leave it out: the files are written by processes of this machine."
        invalid_request("--scheduler", arguments.scheduler, "nothing with --dataset", hint)
    if folder.exists() and not folder.is_dir():
        invalid_request("--dataset", str(folder), "a folder", "Write another name.")
    if (folder / MANIFEST).exists() and not arguments.overwrite:
        invalid_request("--dataset", str(folder), "a folder without a manifest", "Write another name, or --overwrite.")


def _solve(spec: StudySpec, arguments: argparse.Namespace) -> dict[str, Any]:
    """Solve the study, write what `arguments` ask for, and say so; return it as JSON."""
    from synth.study.dataset import dataset_of, numbers_of, write_result
    from synth.study.running import foreseen
    from synth.study.running import run as solve

    with Waiting("trying some scenes", arguments.progress):
        seconds = foreseen(spec, arguments.workers)
    say(f"{spec.count} scenes, some {_duration(seconds)}")
    path = Path(arguments.output or arguments.figure[0])
    parts = path.with_name(f"{path.name}.parts")
    with _progress("solving", spec.count, parts, arguments) as progress:
        solve(spec, parts, workers=arguments.workers, scheduler=arguments.scheduler, progress=progress)
    numbers = numbers_of(spec, parts)
    failed = [reason for reason in numbers["reason"].tolist() if reason]
    if len(failed) == spec.count:
        shutil.rmtree(parts, ignore_errors=True)
        raise CannotRender(f"None of the scenes can be solved, so nothing is written. The first: {failed[0]}")
    if arguments.output:
        write_result(spec, numbers, path)
    if arguments.figure:
        from clients.study_figures import draw

        draw(dataset_of(spec, numbers), arguments.figure)
    shutil.rmtree(parts, ignore_errors=True)
    reasons = sorted(set(failed))[:SHOWN_REASONS]
    if not arguments.json:
        rows = [("file", one) for one in (arguments.output, *(arguments.figure or ())) if one]
        print_table("", ("study", "value"), [*rows, ("scenes", str(spec.count)), ("not solved", str(len(failed)))])
        for reason in reasons:
            warn(f"not solved: {reason}")
    files = {"path": arguments.output, "figures": arguments.figure or []}
    return files | {"not_solved": len(failed), "reasons": reasons}


def _render(spec: StudySpec, arguments: argparse.Namespace) -> dict[str, Any]:
    """Render every scene into the folder of the dataset, and say so; return it as JSON."""
    from synth.study.chunks import chunks_of
    from synth.study.running import run as carry_out
    from synth.study.waveforms import MANIFEST, is_rendered, render_chunk, write_manifest

    folder = Path(arguments.dataset)
    folder.mkdir(parents=True, exist_ok=True)
    with _progress("rendering", spec.count, folder, arguments) as progress:
        carry_out(
            spec, folder, workers=arguments.workers, progress=progress, work=render_chunk, is_done=is_rendered
        )  # fmt: skip
    missing = write_manifest(list(chunks_of(spec)), folder, arguments.licence)
    manifest = str(folder / MANIFEST)
    if not arguments.json:
        rows = [("manifest", manifest), ("scenes", str(spec.count)), ("not rendered", str(missing))]
        print_table("", ("dataset", "value"), rows)
    return {"manifest": manifest, "not_rendered": missing}


@contextmanager
def _progress(
    what: str, count: int, parts: Path, arguments: argparse.Namespace
) -> Iterator[Callable[[int, int], None]]:
    """Yield what reports the scenes done. Says where finished ones are kept when the work ends early."""
    try:
        with Progress(what, count, "scenes", arguments.progress) as bar:
            reported = 0

            def progress(done: int, _all: int) -> None:
                nonlocal reported
                bar.advance(done - reported)
                reported = done

            yield progress
    except (KeyboardInterrupt, OSError):
        if any(parts.glob("*")):
            warn(f"finished scenes are kept in {parts}; the same command goes on from there")
        raise


def _draw_again(arguments: argparse.Namespace) -> int:
    """Draw a study that is finished."""
    from clients.study_figures import check_figure, draw
    from synth.study.dataset import opened

    if arguments.output or arguments.accuracy or not arguments.figure:
        invalid_request("SPEC", arguments.spec, "--figure alone with a finished study", "Write --figure map.svg.")
    check_figure(None, arguments.figure)
    with opened(Path(arguments.spec)) as found:
        draw(found, arguments.figure)
    return DONE


def _accuracy(spec: StudySpec, arguments: argparse.Namespace) -> int:
    """Print what other numbers of phases would cost, and what they would change."""
    from synth.study.cost_of_accuracy import accuracy_rows

    with Waiting("solving some scenes with more and more phases", arguments.progress):
        rows = accuracy_rows(spec)
    if arguments.json:
        print_json(rows)
        return DONE
    names = (
        "phases", "whole study", "displacement told", "rms off, dB", "acceleration told", "rms off, dB",
        "level off, dB", "other verdicts",
    )  # fmt: skip
    title = f"{spec.count} scenes in one process, beside {rows[-1]['phases']} phases; median and largest"
    print_table(title, names, [_accuracy_row(row) for row in rows])
    return DONE


def _accuracy_row(row: dict[str, Any]) -> tuple[str, ...]:
    told = [str(row["phases"]), f"{row['seconds']:.3g} s"]
    for name in ("displacement", "acceleration"):
        told += ["{:.0e}, {:.0e}".format(*row[name]["told"]), "{:.0e}, {:.0e}".format(*row[name]["rms_db"])]
    return (*told, "{:.0e}, {:.0e}".format(*row["level_db"]), f"{100.0 * row['verdicts']:.2g} %")


def _text(source: str) -> str | bytes:
    """Return the spec in a JSON file, in a ready study, or from standard input."""
    if source == "-":
        return sys.stdin.buffer.read()
    if source in ready_names():
        return ready_text(source)
    try:
        return Path(source).read_bytes()
    except (FileNotFoundError, IsADirectoryError):
        allowed = f"a JSON file that exists, -, or one of {', '.join(ready_names())}"
        invalid_request("SPEC", source, allowed, "Check the path; docs/study.md has examples.")
