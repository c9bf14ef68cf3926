"""Files of laboratories: tables with a rate or times, and sounds with or without a scale."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

import ridgewave as rw
from synth.study.recordings import read_recording

RATE = 4000
VALUES = np.sin(np.arange(2000) / 7.0)


def table(path: Path, **columns: Any) -> Path:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(columns)
    if path.suffix == ".parquet":
        frame.to_parquet(path)
    else:
        frame.to_csv(path, index=False)
    return path


@pytest.mark.filterwarnings("ignore")
def test_tables_and_sounds_are_read(tmp_path: Path) -> None:
    times = np.arange(2000) / RATE
    one = read_recording(table(tmp_path / "a.csv", time=times, az=VALUES))
    assert one.rate == pytest.approx(RATE) and not one.scaled and one.values == pytest.approx(VALUES)
    two = read_recording(table(tmp_path / "b.parquet", ax=VALUES, az=2.0 * VALUES), column="az", rate=RATE, scale=9.81)
    assert two.scaled and two.values == pytest.approx(2.0 * 9.81 * VALUES)
    for name, kind in (("c.wav", "FLOAT"), ("d.flac", "PCM_24")):
        soundfile.write(tmp_path / name, 0.5 * VALUES, RATE, subtype=kind)
        plain, scaled = (read_recording(tmp_path / name, scale=scale) for scale in (None, 20.0))
        assert not plain.scaled and plain.quantity == "" and plain.values == pytest.approx(0.5 * VALUES, abs=1e-6)
        assert scaled.scaled and scaled.values == pytest.approx(10.0 * VALUES, abs=1e-5)
    own = rw.render({}, output={"duration": "0.1 s", "quantity": "velocity"}).save(tmp_path / "own.wav")
    assert read_recording(Path(own)).quantity == "velocity" and read_recording(Path(own)).scaled


def test_what_is_no_recording_is_refused(tmp_path: Path) -> None:
    times = np.arange(2000) / RATE
    gap = np.where(np.arange(2000) == 7, np.nan, VALUES)
    (tmp_path / "e.txt").write_text("1 2 3")
    cases: list[tuple[Path, dict[str, Any], str]] = [
        (tmp_path / "e.txt", {}, "WAV or CSV"),
        (table(tmp_path / "f.csv", ax=VALUES, az=VALUES), {"rate": RATE}, "ax, az"),
        (tmp_path / "f.csv", {"rate": RATE, "column": "ay"}, "ax, az"),
        (table(tmp_path / "g.csv", az=VALUES), {}, "--rate"),
        (table(tmp_path / "h.csv", t=times**1.5, az=VALUES), {}, "equal steps"),
        (table(tmp_path / "i.csv", t=times, az=gap), {}, "row 8"),
    ]
    for path, how, word in cases:
        with pytest.raises(rw.InvalidRequest, match=word):
            read_recording(path, **how)
    soundfile.write(tmp_path / "j.wav", VALUES, RATE)
    with pytest.raises(rw.InvalidRequest, match="channel"):
        read_recording(tmp_path / "j.wav", channel=3)


@pytest.mark.parametrize(
    ("told", "word"),
    [
        ({"scale": 0.0, "rate": 8000}, "scale"), ({"scale": -1.0, "rate": 8000}, "scale"),
        ({"scale": "9.81", "rate": 8000}, "scale"), ({"rate": "8 kHz"}, "rate"), ({"rate": 0}, "rate"),
        ({"rate": True}, "rate"),
    ],
)  # fmt: skip
def test_a_rate_and_a_scale_are_numbers_above_0(told: dict[str, Any], word: str) -> None:
    with pytest.raises(rw.InvalidRequest, match=word):
        rw.analyze(np.ones(9000), quantity="velocity", **told)
    with pytest.raises(rw.InvalidRequest, match=word):
        rw.compare({}, np.ones(9000), quantity="velocity", **told)


def test_what_a_file_knows_is_not_overruled(tmp_path: Path) -> None:
    path = rw.render({}, output={"duration": "0.5 s"}).save(tmp_path / "own.wav")
    for told, word in (
        ({"quantity": "velocity"}, "acceleration"),
        ({"scale": 2.0}, "scale"),
        ({"rate": 4000.0}, "rate"),
    ):
        arguments: dict[str, Any] = dict(told)
        with pytest.raises(rw.InvalidRequest, match=word):
            rw.analyze(path, **arguments)
        with pytest.raises(rw.InvalidRequest, match=word):
            rw.compare({}, path, **arguments)
    with pytest.raises(rw.InvalidRequest, match="nothing with a recording"):
        rw.analyze(path, finger={"kind": "fingertip"})
    with pytest.raises(rw.InvalidRequest, match="nothing with a scene"):
        rw.analyze({}, scale=2.0)
    with pytest.raises(rw.InvalidRequest, match="real numbers"):
        rw.analyze(np.ones(9000) * 1j, quantity="velocity", rate=8000)


LOGGERS = ["Time [s];az\n{0};{1}", "# fs 4000 Hz\n# logger 7\ntime,az\n{0},{1}", "# time\taz\n{0}\t{1}"]


@pytest.mark.parametrize(
    ("text", "decimal"), [*((text, ".") for text in LOGGERS), (LOGGERS[0], ","), (LOGGERS[2], ",")]
)
def test_tables_as_loggers_write_them(tmp_path: Path, text: str, decimal: str) -> None:
    pytest.importorskip("pandas")
    header, row = text.rsplit("\n", 1)
    rows = [row.format(f"{n / RATE:.6f}", f"{one:.9f}") for n, one in enumerate(VALUES.tolist())]
    body = "\n".join(rows).replace(".", decimal)
    (tmp_path / "a.csv").write_text(f"\ufeff{header}\n{body}", "utf-8")
    found = read_recording(tmp_path / "a.csv")
    assert found.rate == pytest.approx(RATE, rel=1e-5) and found.values == pytest.approx(VALUES, abs=1e-8)


def test_times_may_be_rounded_and_a_rate_may_be_written_beside_them(tmp_path: Path) -> None:
    exact = np.arange(2000) / 1024.0
    jitter = exact + np.random.default_rng(1).normal(0.0, 0.05 / 1024.0, 2000)
    for name, times in (("ms.csv", np.round(exact, 3)), ("jitter.csv", jitter)):
        found = read_recording(table(tmp_path / name, t=times, az=VALUES))
        assert found.rate == pytest.approx(1024.0, rel=1e-3)
        assert read_recording(tmp_path / name, rate=1024.0).rate == 1024.0
    for faster in (3200.0, 8000.0, 25_600.0):
        for how in (np.round, lambda clock, digits: np.floor(clock * 10**digits) / 10**digits):
            times = how(7.0 + np.arange(2000) / faster, 3)
            assert read_recording(table(tmp_path / "fast.csv", t=times, az=VALUES)).rate == pytest.approx(
                faster, rel=1e-3
            )
    uneven = table(tmp_path / "uneven.csv", t=exact**1.5, az=VALUES)
    assert read_recording(uneven, rate=1024.0).rate == 1024.0
    with pytest.raises(rw.InvalidRequest, match="as the times of the table say"):
        read_recording(tmp_path / "ms.csv", rate=2000.0)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("az\n" + "0,0712\n" * 400, "semicolons"),
        ("time,az\n" + "".join(f"0,{n:03d},1,5\n" for n in range(400)), "semicolons"),
        ("time,az\n" + "".join(f"{(n + (n > 200)) / 4000:.6f},{n % 7}\n" for n in range(400)), "a gap before row 202"),
        (
            "time,az\n" + "".join(f"{n / 8000 + 0.01 * (n > 200):.3f},{n % 7}\n" for n in range(400)),
            "gap before row 202",
        ),
        ("time,az\n" + "".join(f"{0.05 * (n / 400) ** 2:.3f},{n % 7}\n" for n in range(400)), "equal steps"),
    ],
)
def test_a_table_that_would_be_misread_is_refused(tmp_path: Path, text: str, word: str) -> None:
    pytest.importorskip("pandas")
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(rw.InvalidRequest, match=word):
        read_recording(tmp_path / "a.csv", column="az", rate=None if "time" in text else 8000.0)


def test_names_with_a_hash_trailing_separators_and_times_in_ms_are_read(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    rows = "".join(f"{n / 4:.2f};{one:.6f};{2 * one:.6f};\n" for n, one in enumerate(VALUES.tolist()))
    (tmp_path / "a.csv").write_text("time (ms);ch#1;ch#2;\n" + rows)
    for name, factor in (("ch#1", 1.0), ("ch#2", 2.0)):
        found = read_recording(tmp_path / "a.csv", column=name)
        assert found.rate == pytest.approx(RATE) and found.values == pytest.approx(factor * VALUES, abs=1e-5)
    with pytest.raises(rw.InvalidRequest, match="time"):
        read_recording(tmp_path / "a.csv", column="time (ms)")


@pytest.mark.parametrize("unit", ["ns", "us", "ms"])
def test_times_of_a_type_have_their_own_unit(tmp_path: Path, unit: str) -> None:
    pandas = pytest.importorskip("pandas")
    since = pandas.to_timedelta(np.arange(2000) / RATE if unit != "ms" else np.arange(2000) / 1000, unit="s")
    rate = RATE if unit != "ms" else 1000
    for name, times in (("dates", pandas.Timestamp("2026-01-01") + since), ("durations", since)):
        path = table(tmp_path / f"{name}.parquet", time=pandas.Series(times).dt.as_unit(unit), az=VALUES)
        assert read_recording(path).rate == pytest.approx(rate)
        assert read_recording(path, rate=rate).rate == rate
