"""A method and its size, what it is measured against, and the errors that a report tells of it.

Stage   no stage. `steady` and `motion` say how a scene is measured; `report` measures it.
Model   A `Subject` is one channel of a scene with the methods that can compute it. It compares what a method computes
        with its reference. To convert an error to a displacement, its spectrum is divided by (2 pi f)^k, where k is the
        order of the time derivative.
Source  design, section 5; thresholds: `threshold`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from time import get_clock_info, perf_counter, process_time

import numpy as np

from synth.arrays import Array
from synth.perception.threshold import threshold_displacement

clock = process_time if get_clock_info("process_time").resolution <= 1e-6 else perf_counter
"""Returns processor seconds, which other programs do not lengthen, where the system tells them finely enough."""


@dataclass(frozen=True, slots=True)
class Ready:
    """A method that is set up.

    frames: number of frames that `run` computes.
    nbytes: memory, bytes.
    run: computes the frames.
    values: returns the channel (SI) where it is compared with the reference. Of a steady scan these are the phases
        (i + 1/2) / points of a period, or those that the method itself can tell; of a motion its frames.
    setup: set-up time (s); None if it is measured by calling `set_up`.
    live: whether it fades above the band as a live voice does, so that only the band is compared.
    """

    frames: float
    nbytes: int
    run: Callable[[], object]
    values: Callable[[int], Array]
    setup: float | None = None
    live: bool = False


@dataclass(frozen=True, slots=True)
class Method:
    """A method to compute a subject.

    name: name in the report; its size is the part with a number.
    family: group of methods that differ only in size.
    set_up: returns the method, ready to run.
    seconds: approximate time to set it up, run it and compute its error, s.
    """

    name: str
    family: str
    set_up: Callable[[], Ready]
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class LeftOutMethod:
    """A method that was not measured, and why."""

    method: str
    family: str
    reason: str


@dataclass(frozen=True, slots=True)
class Errors:
    """The errors of one method. docs/accuracy.md describes the fields."""

    max_error: float
    rms_error: float
    error_m: float
    worst_harmonic_db: float
    threshold_margin_db: float


@dataclass(frozen=True, slots=True)
class Subject:
    """What a report measures.

    quantity: of the channel.
    extent: its peak-to-peak, SI.
    measured: what the errors are those of, as a sentence.
    reference_error: bound on the error of the reference, relative to the peak-to-peak.
    chosen: name of the method that the plan uses; it is one of `methods`.
    methods: in the order of the report.
    left_out: methods that do not apply.
    errors: returns the errors of a method.
    """

    quantity: str
    extent: float
    measured: str
    reference_error: float
    chosen: str
    methods: tuple[Method, ...]
    left_out: tuple[LeftOutMethod, ...]
    errors: Callable[[Ready], Errors]


def margin_below(sizes: Array, frequencies: Array, order: int, threshold: str) -> float:
    """Return how far lines of a spectrum are below the detection threshold, dB, at the loudest one.

    sizes: amplitude of each line, SI.
    frequencies: Hz, at least 1.
    order: of the time derivative.
    """
    felt = threshold_displacement(frequencies, threshold) * (2.0 * math.pi * frequencies) ** order
    return -decibels(float(np.max(sizes / felt)))


def decibels(ratio: float) -> float:
    """Return `ratio` in dB; minus infinity for 0."""
    return 20.0 * math.log10(ratio) if ratio > 0.0 else -math.inf
