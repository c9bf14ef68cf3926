"""Every figure for which the project has a limit, measured in one run and printed with its limit.

    python -m tests.bench [--long] [--json] [PART ...]
    python -m tests.bench live [--seconds 60] [--streams 200] [--workers 2]
    python -m tests.bench page
    python -m tests.bench table
    python -m tests.bench direct
    python -m tests.bench choices
    python -m tests.bench fingertip
    python -m tests.bench floods
    python -m tests.bench inputs
    python -m tests.bench lock-step
    python -m tests.bench study

Parts: solver, voice, limiter, response, effects (each on one core), service, processes; --long adds an hour's render.
`live`, `page`, `table`, `direct`, `choices`, `fingertip`, `floods`, `inputs`, `lock-step` and `study` run only where
they are named: `live` loads a service with streams for minutes, `page` needs a browser, `table` measures tables,
`direct` voices without one, `choices` opens textures of the catalogue, `fingertip` compares 200 renders with brute
force, which takes an hour, `floods` floods a service, `inputs` sends it the largest inputs, which takes half an hour,
`lock-step` pulls a minute of sound block by block, and `study` solves 110,000 scenes.
Nothing here passes or fails: a figure over its limit is marked OVER. docs/benchmarks.md explains each line.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial
from resource import RUSAGE_SELF, getrusage
from time import perf_counter

from tests.bench import (
    bench_choices,
    bench_direct,
    bench_effects,
    bench_fingertip,
    bench_floods,
    bench_import,
    bench_largest_inputs,
    bench_limiter,
    bench_live,
    bench_lock_step,
    bench_page,
    bench_processes,
    bench_response,
    bench_service,
    bench_solver,
    bench_study,
    bench_table,
    bench_voice,
)
from tests.bench.timing import Figure, machine, one_core

Measure = Callable[[bool], list[Figure]]

PARTS: dict[str, Measure] = {
    "solver": bench_solver.figures,
    "voice": bench_voice.figures,
    "limiter": bench_limiter.figures,
    "response": bench_response.figures,
    "effects": bench_effects.figures,
    "service": bench_service.figures,
    "processes": bench_processes.figures,
}
BY_NAME: dict[str, Measure] = {  # only where named
    "live": bench_live.figures,
    "page": bench_page.figures,
    "table": bench_table.figures,
    "direct": bench_direct.figures,
    "choices": bench_choices.figures,
    "fingertip": bench_fingertip.figures,
    "floods": bench_floods.figures,
    "inputs": bench_largest_inputs.figures,
    "lock-step": bench_lock_step.figures,
    "import": bench_import.figures,
    "study": bench_study.figures,
}
ON_ONE_CORE = ("solver", "voice", "limiter", "response", "effects", "table", "import")
HEADER = f"{'figure':35} {'median':>9} {'least':>9} {'unit':8} {'limit':>6} {'':6}  how"


def main(words: list[str] | None = None) -> None:
    """Measure what the arguments `words` name, and print each line as soon as it is known."""
    arguments = parser().parse_args(words)
    asked: dict[str, Measure] = {name: (PARTS | BY_NAME)[name] for name in arguments.parts or PARTS}
    if "live" in asked:
        live = partial(bench_live.figures, seconds=arguments.seconds, streams=arguments.streams)
        asked["live"] = partial(live, workers=arguments.workers, times=arguments.times, search=arguments.search)
    if arguments.long:
        asked["hour"] = bench_processes.hour
    if not arguments.json:
        print(", ".join(f"{name} {value}" for name, value in machine().items()), HEADER, sep="\n")
    found, preempted = [], {}
    for name, measure in asked.items():
        lines, preempted[name] = measured_with(measure, arguments.quick, name in ON_ONE_CORE)
        found += lines
        if not arguments.json:
            print(*map(line, lines), sep="\n", flush=True)
    rates = ", ".join(f"{name} {rate:.0f}" for name, rate in preempted.items() if name in ON_ONE_CORE)
    if arguments.json:
        figures = [one.document() for one in found]
        print(json.dumps({"machine": machine(), "preempted": preempted, "figures": figures}, indent=1))
    elif rates:
        print(f"interruptions of the core by other work, per second: {rates}")


def measured_with(measure: Measure, quick: bool, pinned: bool) -> tuple[list[Figure], float]:
    """Return the figures of a part, and how often per second its threads were interrupted by other work."""
    before, began = getrusage(RUSAGE_SELF).ru_nivcsw, perf_counter()
    with one_core() if pinned else nullcontext():
        lines = measure(quick)
    return lines, (getrusage(RUSAGE_SELF).ru_nivcsw - before) / (perf_counter() - began)


def parser() -> argparse.ArgumentParser:
    """Return the command's arguments."""
    made = argparse.ArgumentParser(prog="python -m tests.bench", description="Measure ridgewave on this machine.")
    made.add_argument(
        "parts", nargs="*", metavar="PART", type=part, help=f"of {', '.join(PARTS)}; or {', '.join(BY_NAME)}"
    )
    made.add_argument("--long", action="store_true", help="also the peak memory of an hour's render")
    made.add_argument("--json", action="store_true", help="the figures as JSON, after all are measured")
    made.add_argument("--seconds", type=float, default=60.0, help="of live: each run (default %(default)g)")
    made.add_argument("--streams", type=int, default=200, help="of live: streams at a time (default %(default)d)")
    made.add_argument("--workers", type=int, default=2, help="of live: server processes (default %(default)d)")
    made.add_argument("--times", type=int, default=1, help="of live: runs of each kind (default %(default)d)")
    made.add_argument("--search", action="store_true", help="of live: also find the most streams of a worker")
    made.add_argument("--quick", action="store_true", help="few repeats: shows that it runs, not how fast")
    return made


def part(word: str) -> str:
    """Return `word` if it names a part."""
    if word not in PARTS | BY_NAME:
        raise argparse.ArgumentTypeError(f"{word!r} is not one of {', '.join(PARTS | BY_NAME)}")
    return word


def line(one: Figure) -> str:
    """Return a figure as a line of the table."""
    limit = "" if one.limit is None else f"{one.limit:g}"
    return (
        f"{one.name:35} {one.value:9.3f} {one.least:9.3f} {one.unit:8} {limit:>6} {one.verdict:6}  {one.how}"
    ).rstrip()


if __name__ == "__main__":
    main()
