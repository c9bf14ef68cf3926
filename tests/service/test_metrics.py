"""What `/metrics` tells: streams, blocks, plays, renders, problems, and nothing that a client could choose."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from typing import Any

import pytest
from fastapi import FastAPI
from prometheus_client.core import Metric
from prometheus_client.openmetrics.parser import text_string_to_metric_families

from service import VERSION
from service.app import create_app
from service.operations.metrics import LATENESS_BOUNDS, Metrics, exposition, merged, snapshot
from service.sessions.pacer import Pacer
from tests.service.harness import ROOT, Running, ask, problem, settings_of, until
from tests.service.plain_engine import PlainEngine, PlainLive
from tests.service.scraping import Scrape, scrape

DEVICE = {"device": "file:a.wav"}


def told(metrics: Metrics) -> Scrape:
    """Return what a service of one worker with these metrics answers."""
    return merge(metrics)


def merge(own: Metrics, present: Sequence[Metrics] = (), ended: Sequence[Metrics] = ()) -> Scrape:
    """Return what a service of several workers answers."""
    others = ([snapshot(metrics.families()) for metrics in workers] for workers in (present, ended))
    return Scrape(exposition(merged(own.families(), *others))[0].decode())


def test_every_metric_is_there_before_anything_happened(app: FastAPI) -> None:
    shown = scrape(app).families
    assert len(shown) == 30 and all(family.samples for family in shown.values())
    assert all(name.startswith("ridgewave_") for name in shown)


def test_a_block_counts_in_the_bucket_of_its_lateness() -> None:
    metrics = Metrics()
    for late in (-0.5, 0.0001, 0.00011, 0.3, 7.0):
        metrics.block_sent("live", 480, late)
    metrics.block_sent("live", 480)
    shown = told(metrics)
    counts = [
        shown.value("block_lateness_seconds_bucket", kind="live", le=str(bound)) for bound in (*LATENESS_BOUNDS, "+Inf")
    ]
    assert counts == [2, *[3] * 10, 4, 4, 5]
    assert shown.value("block_lateness_seconds_sum", kind="live") == pytest.approx(7.30021)
    assert shown.value("frames_sent_total", kind="live") == 6 * 480
    assert shown.value("frames_sent_total", kind="http") == 0


def test_what_the_live_protocol_counts() -> None:
    metrics = Metrics()
    metrics.stream_opened("live")
    metrics.updates(received=5, applied=2, dropped=3)
    metrics.limited(2.5, 0.01)
    metrics.limited(1.5, 0.02)
    for code in (1000, 1000, 4408, 4999):
        metrics.live_closed(code)
    shown = told(metrics)
    assert [shown.value(f"updates_{what}_total") for what in ("received", "applied", "dropped")] == [5, 2, 3]
    assert shown.value("limited_blocks_total") == 2
    assert shown.value("limited_seconds_total") == pytest.approx(0.03)
    assert shown.value("limiter_largest_reduction_decibels") == 2.5
    assert [shown.value("live_closes_total", code=code) for code in ("1000", "4408", "other", "1011")] == [2, 1, 1, 0]
    assert shown.value("streams", kind="live") == 1


def test_a_block_after_a_gap_of_the_service_is_late_by_the_gap() -> None:
    metrics = Metrics()
    metrics.block_sent("live", 480, 0.0, skipped=2.5)
    shown = told(metrics)
    assert shown.value("skipped_seconds_total", kind="live") == 2.5
    assert shown.value("skipped_seconds_total", kind="http") == 0
    assert shown.value("block_lateness_seconds_bucket", kind="live", le="1.0") == 0
    assert shown.value("block_lateness_seconds_bucket", kind="live", le="+Inf") == 1


def test_the_build_is_told_once_however_many_workers() -> None:
    shown = merge(Metrics(), [Metrics()], [Metrics(), Metrics()])
    assert shown.value("build_info", version=VERSION, python=platform.python_version()) == 1


def test_counts_of_a_worker_that_has_gone_stay_and_its_streams_do_not() -> None:
    here, gone = Metrics(), Metrics()
    for metrics, reduction in ((here, 1.0), (gone, 6.0)):
        metrics.stream_opened("http")
        metrics.block_sent("http", 10, 0.001)
        metrics.limited(reduction, 0.5)
    shown = merge(here, ended=[gone])
    assert shown.value("streams", kind="http") == 1
    assert shown.value("streams_opened_total", kind="http") == 2
    assert shown.value("frames_sent_total", kind="http") == 20
    assert shown.value("block_lateness_seconds_count", kind="http") == 2
    assert shown.value("limiter_largest_reduction_decibels") == 6.0


def test_a_stream_counts_while_it_lasts_and_its_sound_for_good(running: Running) -> None:
    session = running.open_session()
    with running.listening(session) as listener:
        listener.frames(9600)
        during = scrape(running.client)
        assert during.value("streams", kind="http") == 1
        assert during.value("frames_sent_total", kind="http") >= 9600
        assert during.value("block_lateness_seconds_count", kind="http") >= 10
        assert during.value("sessions") == 1
    until(lambda: scrape(running.client).value("streams", kind="http") == 0)
    after = scrape(running.client)
    assert after.value("streams_opened_total", kind="http") == 1
    assert session not in after.text


def test_a_refused_stream_is_not_one(app: FastAPI) -> None:
    problem(ask(app, "GET", "/v1/sessions/nothing/stream"), 404, "not-found")
    assert scrape(app).value("streams_opened_total", kind="http") == 0


def test_a_play_counts_and_so_do_its_underruns(running: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.sinks.file_sink.FileSink.underruns", 3, raising=False)
    path = f"/v1/sessions/{running.open_session()}"
    assert running.client.post(f"{path}/play", json=DEVICE).status_code == 202
    until(lambda: running.client.get(path).json()["play"]["frames"] > 960)
    assert scrape(running.client).value("streams", kind="play") == 1
    frames = running.client.delete(f"{path}/play").json()["frames"]
    shown = scrape(running.client)
    assert shown.value("streams", kind="play") == 0
    assert shown.value("frames_sent_total", kind="play") == frames
    assert shown.value("underruns_total") == 3


def test_a_play_that_does_not_begin_is_none(running: Running) -> None:
    path = f"/v1/sessions/{running.open_session()}"
    problem(running.client.post(f"{path}/play", json={"device": "file:../a.wav"}), 422, "request-refused")
    assert scrape(running.client).value("streams_opened_total", kind="play") == 0


def test_the_limiter_s_work_is_counted(running: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PlainLive, "reduction_db", 4.0)
    with running.listening(running.open_session()) as listener:
        listener.frames(9600)
    shown = scrape(running.client)
    assert shown.value("limiter_largest_reduction_decibels") == 4.0
    assert shown.value("limited_seconds_total") >= 0.2 - 1e-9  # a sum of ten blocks


def test_renders_and_what_they_built_are_counted(app: FastAPI) -> None:
    for _ in range(3):
        ask(app, "POST", "/v1/render", json={"output": {"duration": 0.01}})
    session = ask(app, "POST", "/v1/sessions", json={}).json()["id"]
    shown = scrape(app)
    assert shown.value("renders_total") == 3
    assert shown.value("renders_under_way") == 0
    assert shown.value("build_seconds_count", what="voice") == 5  # three, and a session's before and with its scale
    assert shown.value("build_seconds_count", what="change") == 0
    assert session not in shown.text


def test_a_change_of_scene_is_a_build(running: Running) -> None:
    session = running.open_session()
    with running.listening(session) as listener:
        listener.frames(480)
        assert running.client.patch(f"/v1/sessions/{session}", json={"scan": {"speed": 0.1}}).status_code == 200
        assert scrape(running.client).value("build_seconds_count", what="change") == 1


@pytest.mark.parametrize(
    ("method", "path", "rest", "kind"),
    [
        ("GET", "/nowhere", {}, "not-found"),
        ("PUT", "/v1/render", {}, "method-not-allowed"),
        ("POST", "/v1/render", {"content": b"{}"}, "not-json"),
        ("POST", "/v1/render", {"json": {"finger": 1}}, "scene-refused"),
        ("POST", "/v1/render?x=1", {"json": {}}, "request-refused"),
        ("GET", "/healthz", {"headers": {"Host": "evil.example"}}, "host-refused"),
        ("POST", "/v1/stop", {"headers": {"Origin": "null"}}, "origin-refused"),
    ],
)
def test_every_problem_counts_by_its_name(app: FastAPI, method: str, path: str, rest: Any, kind: str) -> None:
    ask(app, method, path, **rest)
    shown = scrape(app)
    assert shown.value("problems_total", type=kind) == 1
    assert sum(sample.value for sample in shown.families["ridgewave_problems"].samples) == 1


def test_a_bug_of_ours_counts_too(app: FastAPI, engine: PlainEngine) -> None:
    engine.mistake = True
    problem(ask(app, "POST", "/v1/render", json={}), 500, "internal")
    assert scrape(app).value("problems_total", type="internal") == 1


def test_metrics_need_the_key_where_keys_are_set() -> None:
    app = create_app(settings_of(api_keys="sesame"), PlainEngine())
    problem(ask(app, "GET", "/metrics"), 401, "key-required")
    assert scrape(app, headers={"Authorization": "Bearer sesame"}).value("problems_total", type="key-required") == 1
    app.state.service.finish()


def test_a_scraper_that_wants_openmetrics_gets_it(app: FastAPI) -> None:
    answer = ask(app, "GET", "/metrics", headers={"Accept": "application/openmetrics-text;version=1.0.0"})
    assert answer.headers["content-type"].startswith("application/openmetrics-text")
    families = text_string_to_metric_families(answer.text)  # type: ignore[no-untyped-call]
    assert {family.name for family in families} >= {"ridgewave_streams"}


def test_the_cache_of_the_engine_is_told() -> None:
    app = create_app(settings_of())
    for _ in range(2):
        assert ask(app, "POST", "/v1/sessions", json={}).status_code == 201
    shown = scrape(app)
    assert shown.value("cache_misses_total") >= 1
    assert shown.value("cache_hits_total") >= 1
    assert shown.value("cache_bytes") > 0
    app.state.service.finish()


def test_a_block_of_the_first_lead_is_not_late_and_one_after_its_time_is() -> None:
    pacer = Pacer(1000, 10.0, lead=0.25)
    pacer.advance(200)
    assert pacer.late(10.001) == pytest.approx(0.001)
    pacer.advance(500)
    assert pacer.late(10.5) == pytest.approx(0.25)


def test_the_page_on_operations_has_a_line_for_every_metric(app: FastAPI) -> None:
    page = (ROOT / "docs" / "operations.md").read_text("utf-8")
    section = page.partition("\n## Metrics\n")[2].partition("\n## ")[0]
    lines = [line.strip("|").split(" | ") for line in section.splitlines() if line.startswith("| `ridgewave_")]
    shown = [[cell.strip() for cell in line] for line in lines]
    assert sorted(shown) == sorted(line_of(family) for family in scrape(app).families.values())


def line_of(family: Metric) -> list[str]:
    """Return the cells of the page's line for a metric."""
    name = f"{family.name}_total" if family.type == "counter" else family.name
    labels = dict.fromkeys(label for sample in family.samples for label in sample.labels if label != "le")
    return [f"`{name}`", family.type, ", ".join(f"`{label}`" for label in labels), family.documentation]
