"""Range: the probe of a player beside a reader, and parts of finite answers, byte by byte."""

from __future__ import annotations

import pytest
from fastapi import FastAPI

from tests.service.harness import Running, ask, problem, until
from tests.service.plain_engine import TABLE

RATE = 48000


def endless_header(running: Running, session: str, query: str = "") -> bytes:
    """Return the bytes of an endless stream up to its samples, read as a reader reads them."""
    with running.client.stream("GET", f"/v1/sessions/{session}/stream{query}") as answer:
        start = next(answer.iter_raw())
    return start[: start.index(b"data") + 8]


@pytest.mark.parametrize(
    ("asked", "first", "last"),
    [("0-1", 0, 1), ("0-0", 0, 0), ("4-11", 4, 11), ("0-65535", 0, None), ("2-", 2, None), ("12-99999999", 12, None)],
)
def test_a_probe_of_an_endless_stream_gets_its_bytes_beside_a_reader(
    running: Running, asked: str, first: int, last: int | None
) -> None:
    session = running.open_session()
    header = endless_header(running, session)
    last = len(header) - 1 if last is None else last
    with running.listening(session) as listener:
        listener.frames(480)
        answer = running.client.get(f"/v1/sessions/{session}/stream", headers={"Range": f"bytes={asked}"})
        assert (answer.status_code, answer.content) == (206, header[first : last + 1])
        assert answer.headers["content-range"] == f"bytes {first}-{last}/*"
        assert answer.headers["content-length"] == str(len(answer.content))
        assert answer.headers["content-type"] == "audio/wav"
        assert running.reader_of(session) is True
        listener.frames(4800)  # the reader goes on


def test_probes_take_no_place_from_readers_to_come(running: Running) -> None:
    session = running.open_session()
    for _ in range(40):  # more than an address may have streams
        answer = running.client.get(f"/v1/sessions/{session}/stream", headers={"Range": "bytes=0-1"})
        assert (answer.status_code, answer.content) == (206, b"RI")
    assert running.reader_of(session) is False and not any(running.service.limits._streams.values())


@pytest.mark.parametrize(
    "asked", ["bytes=0-", "bytes=5-1", "bytes=-", "bytes=0-1, 4-5", "items=0-1", "bytes=a-b", "0-1"]
)
def test_what_is_not_one_bounded_range_is_the_whole_stream(running: Running, asked: str) -> None:
    session = running.open_session()
    path = f"/v1/sessions/{session}/stream"
    with running.client.stream("GET", path, headers={"Range": asked}) as answer:
        chunks = answer.iter_raw()  # kept: without it httpx hangs up
        assert answer.status_code == 200 and next(chunks)[:4] == b"RIFF"
        assert running.reader_of(session) is True


@pytest.mark.parametrize("query", ["", "?format=f32le", "?format=l16"])
@pytest.mark.parametrize("asked", ["bytes=100000-", "bytes=100000-100001", "bytes=-2", "bytes=-0"])
def test_samples_of_an_endless_stream_are_no_range(running: Running, query: str, asked: str) -> None:
    session = running.open_session()
    answer = running.client.get(f"/v1/sessions/{session}/stream{query}", headers={"Range": asked})
    assert "Leave Range out" in problem(answer, 416, "range-refused")["detail"]
    assert running.reader_of(session) is False


@pytest.mark.parametrize("name", ["wav", "wav16", "wav24", "f32le", "l16"])
@pytest.mark.parametrize("asked", ["0-1", "0-", "3-9", "2000-2999", "9000-", "-100", "0-999999999", "-999999999"])
def test_a_part_of_a_finite_stream_is_cut_from_the_whole(running: Running, name: str, asked: str) -> None:
    session = running.open_session()
    path = f"/v1/sessions/{session}/stream?duration=0.1&format={name}"
    whole = running.client.get(path)
    assert whole.headers["accept-ranges"] == "bytes"
    check_part(running.client.get(path, headers={"Range": f"bytes={asked}"}), whole.content, asked)
    until(lambda: running.reader_of(session) is False)


def check_part(answer: object, whole: bytes, asked: str) -> None:
    """Assert that `answer` is the part `asked` of `whole`."""
    begin, _, end = asked.partition("-")
    first = int(begin) if begin else max(0, len(whole) - int(end))
    last = min(int(end), len(whole) - 1) if begin and end else len(whole) - 1
    status, content, headers = answer.status_code, answer.content, answer.headers  # type: ignore[attr-defined]
    assert (status, content) == (206, whole[first : last + 1])
    assert headers["content-range"] == f"bytes {first}-{last}/{len(whole)}"
    assert headers["content-length"] == str(last + 1 - first)


def test_behind_the_end_of_a_finite_stream_is_nothing(running: Running) -> None:
    session = running.open_session()
    path = f"/v1/sessions/{session}/stream?duration=0.1&format=f32le"
    answer = running.client.get(path, headers={"Range": f"bytes={4 * RATE // 10}-"})
    problem(answer, 416, "range-refused")
    assert answer.headers["content-range"] == f"bytes */{4 * RATE // 10}"
    assert running.reader_of(session) is False


def test_a_condition_that_no_stream_meets_gives_the_whole(running: Running) -> None:
    session = running.open_session()
    headers = {"Range": "bytes=0-1", "If-Range": '"tag"'}
    answer = running.client.get(f"/v1/sessions/{session}/stream?duration=0.1", headers=headers)
    assert answer.status_code == 200 and len(answer.content) == int(answer.headers["content-length"])


def test_head_has_no_part(running: Running) -> None:
    session = running.open_session()
    for query in ("", "?duration=0.1"):
        path = f"/v1/sessions/{session}/stream{query}"
        part = running.client.head(path, headers={"Range": "bytes=0-1"})
        whole = running.client.head(path)
        assert part.status_code == 200 and "content-range" not in part.headers
        assert part.headers.get("content-length") == whole.headers.get("content-length")


@pytest.mark.parametrize("asked", ["0-1", "0-", "100-4095", "5000-", "-7", "0-999999999"])
def test_a_part_of_a_table(app: FastAPI, asked: str) -> None:
    url, tag = table_of(app)
    check_part(ask(app, "GET", url, headers={"Range": f"bytes={asked}"}), TABLE.read_bytes(), asked)
    check_part(ask(app, "GET", url, headers={"Range": f"bytes={asked}", "If-Range": tag}), TABLE.read_bytes(), asked)


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Range": "bytes=0-1,4-5"},
        {"Range": "bytes=7-3"},
        {"Range": "bytes=0-1", "If-Range": '"another"'},
        {"Range": "bytes=0-1", "If-Range": "W/{tag}"},
        {"Range": "bytes=0-1", "If-Range": "Sat, 28 Nov 2026 00:00:00 GMT"},
    ],
)
def test_the_whole_of_a_table(app: FastAPI, headers: dict[str, str]) -> None:
    url, tag = table_of(app)
    answer = ask(app, "GET", url, headers={name: value.replace("{tag}", tag) for name, value in headers.items()})
    assert (answer.status_code, answer.content) == (200, TABLE.read_bytes())
    assert answer.headers["accept-ranges"] == "bytes" and "content-range" not in answer.headers


def test_behind_the_end_of_a_table_is_nothing(app: FastAPI) -> None:
    url, _ = table_of(app)
    answer = ask(app, "GET", url, headers={"Range": f"bytes={len(TABLE.read_bytes())}-"})
    problem(answer, 416, "range-refused")
    assert answer.headers["content-range"] == f"bytes */{len(TABLE.read_bytes())}"


def test_a_render_is_no_get_and_has_no_part(app: FastAPI) -> None:
    scene = {"output": {"duration": 0.01}}
    for name in ("wav", "flac"):
        whole = ask(app, "POST", f"/v1/render?format={name}", json=scene)
        part = ask(app, "POST", f"/v1/render?format={name}", json=scene, headers={"Range": "bytes=0-1"})
        assert (part.status_code, part.content) == (200, whole.content)


def table_of(app: FastAPI) -> tuple[str, str]:
    """Return the path of a table and its ETag."""
    told = ask(app, "POST", "/v1/tables", json={}).json()
    return told["url"], f'"{told["hash"]}"'
