"""`ridgewave accuracy SCENE [-o DIR]`: what accuracy costs in time, as a table, as JSON, and as a figure in DIR.

The measurement takes up to a minute. Therefore a missing matplotlib, or a folder that cannot be written, is reported
before it. Without -o matplotlib is not imported.
"""

from __future__ import annotations

import argparse
import contextlib
import json
from collections.abc import Callable, Iterator
from pathlib import Path

from clients.accuracy_report.method_series import Document
from clients.accuracy_report.printed_table import print_accuracy
from clients.command_line.exit_codes import DONE
from clients.command_line.output_file import replaces
from clients.command_line.output_folder import opened_folder
from clients.command_line.printing import print_json, say
from clients.command_line.progress import Progress
from clients.command_line.scene_argument import read_scene
from synth.accuracy.report import measure_accuracy
from synth.errors import CannotRender
from synth.plan.process_start import begun

FILES = ("accuracy.json", "accuracy.svg", "accuracy.png")
NO_PLOTS = (
    "cannot draw the figures: matplotlib is not installed. Run: pip install 'ridgewave[plots]', or leave out -o: "
    "--json prints what the figures show."
)
NO_PLOT_CACHE = (
    "cannot draw the figures: matplotlib has no folder for its cache. Set MPLCONFIGDIR to a folder that can be "
    "written, or leave out -o."
)


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises InvalidRequest, CannotRender, OSError."""
    begun()  # before the import of matplotlib, which a render does not need
    scene = read_scene(arguments)
    replaced = []
    if arguments.output is not None:
        replaced = [name for name in FILES if replaces(Path(arguments.output) / name, arguments.no_clobber)]
    with _folder(arguments.output) as write:
        with contextlib.ExitStack() as stack:
            report = _progress(stack, arguments.progress)
            measured = measure_accuracy(scene, quantity=arguments.quantity, live=arguments.live, progress=report)
            document = measured.document()
        if write is not None:
            write(document)
    if arguments.json:
        print_json(document)
    else:
        print_accuracy(arguments.scene, document)
        if write is not None:
            print(f"Written to {arguments.output}: {', '.join(FILES)}")
    if replaced and not arguments.json:
        say(f"replaced {', '.join(replaced)} in {arguments.output}; --no-clobber keeps existing files")
    return DONE


@contextlib.contextmanager
def _folder(output: str | None) -> Iterator[Callable[[Document], None] | None]:
    """Yield a function that writes all files into the folder that -o names; None without -o."""
    if output is None:
        yield None
        return
    try:
        from clients.accuracy_report.figure import drawings
    except ImportError as error:
        raise CannotRender(NO_PLOTS) from error
    except OSError as error:  # it needs its own folder, or a temporary one
        raise CannotRender(NO_PLOT_CACHE) from error
    with opened_folder(Path(output), FILES) as write_files:

        def write(document: Document) -> None:
            """Write the report as JSON with its figures."""
            text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
            write_files({"accuracy.json": text.encode(), **drawings(document)})

        yield write


def _progress(stack: contextlib.ExitStack, wanted: bool | None) -> Callable[[str, int, int], None]:
    """Return the function to which the measurement reports (method, methods done, all methods)."""
    bars: list[Progress] = []
    reached = 0

    def report(_method: str, done: int, of: int) -> None:
        """Advance the bar to `done` of `of` methods."""
        nonlocal reached
        if not bars:  # the number of methods is known from the first report on
            bars.append(stack.enter_context(Progress("measuring", of, "methods", wanted)))
        bars[0].advance(done - reached)
        reached = done

    return report
