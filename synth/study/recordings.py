"""Recordings of a laboratory: sound files with or without a scale, and tables with a column of samples.

Stage   STUDY, used by `comparison` and `sound_outcome`.
Model   A file of ridgewave has its quantity and scale. Another WAV or FLAC has samples without a scale, unless one is
        given. A table (CSV, Parquet) has the samples in a column, and a rate, or times in a column `t` or `time`.
        A table has commas, semicolons or tabs between its columns, and decimal points or commas.
Limits  Times at equal steps: those of a clock that are off by more than LATE are refused. Times may be rounded to
        whole multiples of a unit that is longer than a step, such as ms at 3.2 kHz: then off is by parts of the unit.
"""

from __future__ import annotations

import csv
import itertools
import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from synth.arrays import Array
from synth.errors import CannotRender, Fault, InvalidRequest, shown

if TYPE_CHECKING:
    import numpy.typing as npt

    from synth.encode.sound import Sound

SOUNDS, TABLES = (".wav", ".flac"), (".csv", ".parquet")
TIMES = re.compile(r"(t|time)[ _]*[\[(]?(?P<unit>s|ms|us|µs)?[\])]?")  # names of columns of times
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}
LATE = 0.75  # of a step, or of the unit of rounded times: a time is off by no more
GAP = 1.9  # steps, or units of rounded times: a longer one lacks samples
WHOLE = 1e-3  # of the unit: so near are the steps of rounded times to multiples of it
ROUNDED = 16.0  # steps by which a time is off at most where it is rounded; beyond, the steps differ
AGREES = 0.01  # of the rate of a table with times: a rate that is written beside them
MOST_HEADER = 1024  # lines of a table in which its separator is looked for
MOST_SAMPLES = 1 << 24  # of a file from anybody: a FLAC of 1 MB may hold hours of silence


@dataclass(frozen=True, slots=True)
class Recording:
    """One channel.

    scaled: whether `values` are SI. quantity: "" where the file does not say.
    warnings: sentences, such as that the file has other channels.
    """

    name: str
    values: Array
    rate: float
    quantity: str
    scaled: bool
    warnings: tuple[str, ...] = ()


def is_recording(source: str | os.PathLike[str]) -> bool:
    """Return whether the name of a file is that of a recording."""
    return Path(source).suffix.lower() in (*SOUNDS, *TABLES)


def recording_of(
    source: str | os.PathLike[str] | Sound | npt.ArrayLike,
    name: str,
    *,
    column: str | None = None,
    channel: int | None = None,
    rate: float | None = None,
    scale: float | None = None,
) -> Recording:
    """Return one channel of a file, of a sound, or of an array. name: of a sound or an array; others: `read_recording`.

    Raises as `read_recording` does, and InvalidRequest for an array without a rate.
    """
    from synth.encode.sound import Sound

    check_numbers(rate, scale)
    if isinstance(source, str | os.PathLike):
        return read_recording(Path(source), column=column, channel=channel, rate=rate, scale=scale)
    if isinstance(source, Sound):
        return _of_sound(source, name, channel, rate, scale)
    if rate is None:
        raise _refused("/rate", "none", "the rate of an array, Hz", "Write rate=10000.")
    values = np.asarray(source)
    if values.dtype.kind not in "fiub":
        raise _refused("/recording", f"an array of {values.dtype}", "an array of real numbers", "Choose one channel.")
    return Recording(name, values.astype(np.float64) * (1.0 if scale is None else scale), rate, "", True)


def check_numbers(rate: float | None, scale: float | None) -> None:
    """Raise InvalidRequest for a rate or a scale that is no number above 0."""
    for name, value in (("rate", rate), ("scale", scale)):
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if value is not None and not (number and 0.0 < value < np.inf):
            hint = "Write a plain number, in Hz." if name == "rate" else "Write the SI value of a sample of 1."
            raise _refused(f"/{name}", shown(value), "a number above 0", hint)


def read_recording(
    path: Path,
    *,
    column: str | None = None,
    channel: int | None = None,
    rate: float | None = None,
    scale: float | None = None,
) -> Recording:
    """Return one channel of the file at `path`.

    column: of a table; None: the only column beside the time.
    channel: of a sound; None: 0, with a warning if it has others.
    rate: Hz, of a table without times. scale: SI value of 1.0 of a sound, or of 1 of a column.
    Raises InvalidRequest for what is no such file or column, OSError, CannotRender without a library.
    """
    check_numbers(rate, scale)
    if path.suffix.lower() in SOUNDS:
        return _sound(path, channel, rate, scale)
    if path.suffix.lower() in TABLES:
        return _table(path, column, rate, scale)
    allowed = f"a name that ends in {', '.join((*SOUNDS, *TABLES))}"
    raise _refused("/recording", str(path), allowed, "Export the recording as WAV or CSV.")


def recording_in(content: bytes, *, channel: int | None = None, scale: float | None = None) -> Recording:
    """Return one channel of the WAV or FLAC file with these bytes, which may come from anybody.

    Raises InvalidRequest as `read_recording` does, and where the file would unpack to more than MOST_SAMPLES.
    """
    import soundfile

    from synth.encode.sound_files import load

    try:
        known = soundfile.info(BytesIO(content))
    except soundfile.LibsndfileError:
        raise _refused("/recording", f"{len(content)} bytes", "a WAV or FLAC file", "Is it complete?") from None
    if known.frames * known.channels > MOST_SAMPLES:
        allowed = f"at most {MOST_SAMPLES} samples"
        raise _refused("/recording", f"{known.frames * known.channels} samples", allowed, "Send a part of it.")
    check_numbers(None, scale)
    return _of_sound(load(BytesIO(content)), "recording", channel, None, scale)


def _sound(path: Path, channel: int | None, rate: float | None, scale: float | None) -> Recording:
    from synth.encode.sound_files import load

    return _of_sound(load(path), path.name, channel, rate, scale)


def _of_sound(sound: Sound, name: str, channel: int | None, rate: float | None, scale: float | None) -> Recording:
    if rate is not None:
        raise _refused("/rate", f"{rate:g}", "nothing with a sound", f"It has its rate, {sound.sample_rate} Hz.")
    warnings = _other_channels(sound.quantities) if channel is None else ()
    channel = 0 if channel is None else channel
    if not 0 <= channel < len(sound.quantities):
        allowed = f"0 to {len(sound.quantities) - 1}"
        raise _refused("/channel", str(channel), allowed, "Write the number of a channel of the file.")
    quantity = sound.quantities[channel]
    known = quantity != "unscaled"
    if known and scale is not None:
        raise _refused("/scale", f"{scale:g}", "nothing with a file of ridgewave", "It has its scale. Leave it out.")
    values = np.asarray(sound.values[:, channel], np.float64) * (1.0 if known or scale is None else scale)
    is_scaled = known or scale is not None
    return Recording(name, values, float(sound.sample_rate), quantity if known else "", is_scaled, warnings)


def _other_channels(quantities: Sequence[str]) -> tuple[str, ...]:
    """Return a warning about the channels of a sound of which none was named; none where it has one."""
    if len(quantities) == 1:
        return ()
    known = ", ".join(f"{n} is {one}" for n, one in enumerate(quantities) if one != "unscaled")
    which = f"0 to {len(quantities) - 1}" + (f" ({known})" if known else "")
    read = f"It has {len(quantities)} channels, and channel 0 was read, as none is named."
    return (f"{read} Write channel, or --channel on the command line, from {which}.",)


def _table(path: Path, column: str | None, rate: float | None, scale: float | None) -> Recording:
    try:
        import pandas
    except ModuleNotFoundError:
        raise CannotRender("Tables need pandas: pip install 'ridgewave[study]'.") from None
    try:
        parquet = path.suffix.lower() == ".parquet"
        table: Any = pandas.read_parquet(path) if parquet else pandas.read_csv(path, **_layout(path))
    except (ValueError, pandas.errors.ParserError) as error:
        allowed = "UTF-8: a header row, then rows of numbers between commas, semicolons or tabs; comments begin with #"
        raise _refused("/recording", str(path), allowed, "Is it complete?") from error
    names = [str(name) for name in table.columns]
    times = sorted((name for name in names if TIMES.fullmatch(name.strip().lower())), key=len, reverse=True)
    others = [name for name in names if name not in times]
    chosen = column if column is not None else others[0] if len(others) == 1 else None
    if chosen not in others:
        allowed = f"one of {', '.join(others)}"
        raise _refused("/column", chosen or "none", allowed, "Name the column of the samples.")
    values = pandas.to_numeric(table[chosen], errors="coerce").to_numpy(np.float64)
    if not np.all(np.isfinite(values)):
        row = int(np.flatnonzero(~np.isfinite(values))[0])
        raise _refused("/column", f"row {row + 1} of {chosen}", "a finite number in every row", "Fill or cut the gap.")
    clock = None
    if times and (typed := table[times[0]]).dtype.kind in "mM":  # durations or dates, which have a unit of their own
        clock = (typed - typed.iloc[0]).dt.total_seconds().to_numpy(np.float64)
    elif times and (found := TIMES.fullmatch(times[0].strip().lower())):
        clock = pandas.to_numeric(table[times[0]], errors="coerce").to_numpy(np.float64) * SECONDS[found["unit"] or "s"]
    return Recording(path.name, values * (1.0 if scale is None else scale), _rate(clock, rate), "", scale is not None)


def _layout(path: Path) -> dict[str, Any]:
    """Return how pandas reads the text of a logger: separator, decimal sign, lines to skip, and a header after a #.

    Raises InvalidRequest where a row has more cells than the header.
    """
    with path.open(encoding="utf-8-sig") as file:
        lines = list(itertools.islice(file, MOST_HEADER))
    skipped = next((n for n, line in enumerate(lines) if line.strip() and not line.startswith("#")), len(lines))
    comments = [line for line in lines[:skipped] if line.strip()]
    rows = [line.strip("\r\n") for line in lines[skipped:] if line.strip()]
    separator = next((one for one in ("\t", ";") if rows and one in rows[0]), ",")
    commas = separator != "," and any(re.search(r"\d,\d", row) for row in rows[1:])
    how: dict[str, Any] = {"sep": separator, "decimal": "," if commas else ".", "encoding": "utf-8-sig"}
    how |= {"skiprows": skipped, "index_col": False}
    header = rows[0] if rows else ""
    first = header.split(separator)[0].strip().replace(",", ".")
    if comments and re.fullmatch(r"[-+]?\d*\.?\d+(e[-+]?\d+)?", first.lower()):  # its header is a comment too
        header = comments[-1].lstrip("#")
        how |= {"header": None, "names": [one.strip() for one in header.split(separator)]}
    cells = len(next(csv.reader([header], delimiter=separator), []))
    for row in rows[1:]:
        found = next(csv.reader([row.rstrip(separator)], delimiter=separator), [])
        if len(found) > cells:
            allowed = f"{cells} cells, as the header has"
            hint = "Write semicolons between cells with decimal commas, and a name for every column."
            raise _refused("/recording", f"{len(found)} cells in {row[:40]!r}", allowed, hint)
    return how


def _rate(clock: Array | None, rate: float | None) -> float:
    """Return the rate (Hz) of a table; clock: its times (s)."""
    if clock is None:
        if rate is None:
            raise _refused("/rate", "none", "a rate, or a column t or time", "Write --rate 10000.")
        return rate
    numbers = np.arange(len(clock))
    step, begin = np.polyfit(numbers, clock, 1) if len(clock) > 1 and np.all(np.isfinite(clock)) else (0.0, 0.0)
    unit = max(step, _rounded_to(clock))
    late = float(np.max(np.abs(clock - begin - step * numbers))) / unit if step > 0.0 else math.inf
    if rate is None:
        gaps = np.flatnonzero(np.diff(clock) > GAP * unit) if late < ROUNDED else np.empty(0)
        if len(gaps):
            row = int(gaps[0]) + 2
            raise _refused(
                "/recording", f"a gap before row {row}", "times at equal steps", "Fill the gap, or cut there."
            )
        if late > LATE:
            raise _refused("/recording", "its times", "times at equal steps, in s", "Resample it, or write --rate.")
        return float(1.0 / step)
    if late < ROUNDED and abs(rate * step - 1.0) > AGREES:
        hint = "Leave the rate out, or the column of the times."
        raise _refused("/rate", f"{rate:g} Hz", f"{1.0 / step:.6g} Hz, as the times of the table say", hint)
    return rate


def _rounded_to(clock: Array) -> float:
    """Return the unit (s) of which all steps of a clock are multiples, some of them 0; 0 where there is none."""
    steps = np.diff(clock)
    if not len(steps) or not np.min(steps) == 0.0 < np.max(steps):
        return 0.0
    unit = float(np.min(steps[steps > 0.0]))
    return unit if np.all(np.abs(steps / unit - np.round(steps / unit)) < WHOLE) else 0.0


def quantity_of(recording: Recording, asked: str | None) -> str:
    """Return the quantity of a recording; "" where nobody says it. Raises InvalidRequest where `asked` contradicts."""
    if asked and recording.quantity and asked != recording.quantity:
        hint = "Leave it out, or choose another channel."
        raise _refused("/quantity", asked, f"{recording.quantity}, as the file says", hint)
    return asked or recording.quantity


def _refused(where: str, value: str, allowed: str, hint: str) -> InvalidRequest:
    return InvalidRequest([Fault(where, value, allowed, hint)])
