"""docs/operations: the alert rules fire when they should and not else; rules, dashboard and page name what exists."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import yaml
from fastapi import FastAPI

from tests.service.alerting import DASHBOARD, RULES, Key, firing, key, promtool, rising, samples, steady, step
from tests.service.harness import ROOT
from tests.service.scraping import scrape

Rules = list[dict[str, Any]]


def rules() -> Rules:
    (group,) = yaml.safe_load(RULES.read_text("utf-8"))["groups"]
    return list(group["rules"])


def dashboard() -> dict[str, Any]:
    document: dict[str, Any] = json.loads(DASHBOARD.read_text("utf-8"))
    return document


def queries() -> list[str]:
    """Return the expressions of the dashboard, what Grafana writes into them written in."""
    found = [target["expr"] for panel in dashboard()["panels"] for target in panel["targets"]]
    return [text.replace("$__rate_interval", "1m").replace("$instance", ".*") for text in found]


def buckets(exposed: dict[Key, float], metric: str, late_from: float, **labels: str) -> dict[Key, str]:
    """Return a histogram of 20 a second that are all just below the bound `late_from`."""
    series = {key(f"{metric}_count", **labels): rising(20.0)}
    for name, tags in exposed:
        if name == f"{metric}_bucket" and labels.items() <= dict(tags).items():
            series[name, tags] = rising(20.0 if float(dict(tags)["le"]) >= late_from else 0.0)
    return series


LAG, LATENESS = "ridgewave_loop_lag_seconds", "ridgewave_block_lateness_seconds"
WAIT = "ridgewave_pool_wait_seconds"


def refused(kind: str, values: str) -> dict[Key, str]:
    return {key("ridgewave_problems_total", type=kind): values}


def cases(exposed: dict[Key, float]) -> dict[str, dict[Key, str]]:
    """Return for each alert the series that differ from those of a quiet service."""
    stalled = buckets(exposed, LAG, 0.002)
    for name, tags in ((f"{LAG}_count", {}), (f"{LAG}_bucket", {"le": "+Inf"})):
        stalled[key(name, **tags)] = "0+300x46 14103+300x9"  # three more than the other buckets hold
    return {
        "RidgewaveTimeSkipped": {key("ridgewave_skipped_seconds_total", kind="live"): step(0.0, 2.5)},
        "RidgewaveLoopStalls": stalled,
        "RidgewaveLoopLags": buckets(exposed, LAG, 0.05),
        "RidgewaveBlocksLate": buckets(exposed, LATENESS, 0.02, kind="live"),
        "RidgewaveUnderruns": {key("ridgewave_underruns_total"): step(0.0, 1.0)},
        "RidgewaveMistakes": refused("internal", step(0.0, 1.0)),
        "RidgewaveFull": refused("full", rising(0.1)),
        "RidgewaveStrangers": refused("key-required", rising(2.0)),
        "RidgewaveSlowReaders": {key("ridgewave_live_closes_total", code="4408"): step(0.0, 5.0)},
        "RidgewaveLimited": {key("ridgewave_limited_seconds_total"): rising(0.2)},
        "RidgewaveWorkerMissing": {key("ridgewave_workers"): step(2.0, 1.0)},
        "RidgewaveProcessorsBusy": {key("ridgewave_cpu_seconds_total"): rising(0.9)},
        "RidgewaveWorkWaits": buckets(exposed, WAIT, 3.0, pool="render"),
        "RidgewaveGone": {key("up"): step(1.0, 0.0)},
    }


def test_each_alert_fires_on_what_it_is_for_and_none_on_a_quiet_service(app: FastAPI, tmp_path: Path) -> None:
    exposed = samples(scrape(app).text)
    quiet = {name: steady(value) for name, value in exposed.items()} | {key("up"): steady(1.0)}
    quiet |= {key("ridgewave_workers"): steady(1.0)}
    quiet |= buckets(exposed, LAG, 0.005) | buckets(exposed, LATENESS, 0.002, kind="live")
    loud = cases(exposed)
    assert list(loud) == [rule["alert"] for rule in rules()]
    firing(tmp_path, [(quiet, ()), *((quiet | changed, (name,)) for name, changed in loud.items())])


def test_promtool_is_content_with_the_rules() -> None:
    promtool("check", "rules", str(RULES))


def test_the_expressions_of_the_dashboard_parse(tmp_path: Path) -> None:
    recorded = [{"record": f"panel_{index}", "expr": text} for index, text in enumerate(queries())]
    document = {"groups": [{"name": "dashboard", "rules": recorded}]}
    (tmp_path / "dashboard.yml").write_text(json.dumps(document), encoding="utf-8")
    promtool("check", "rules", str(tmp_path / "dashboard.yml"))


def test_every_series_that_rules_and_dashboard_name_is_there(app: FastAPI) -> None:
    series = samples(scrape(app).text)
    names = {name for name, _ in series}
    labels = {name: {label for found, tags in series if found == name for label, _ in tags} for name in names}
    texts = [rule["expr"] for rule in rules()] + queries()
    for text in texts:
        for name, chosen in re.findall(r"(ridgewave_\w+)(\{[^}]*\})?", text):
            assert name in names, text
            assert set(re.findall(r"(\w+)=", chosen)) - {"instance"} <= labels[name], text


def test_every_value_of_a_label_that_a_rule_names_is_there(app: FastAPI) -> None:
    known = {value for _, tags in samples(scrape(app).text) for _, value in tags} | {"ridgewave"}
    for rule in rules():
        for text in re.findall(r'=~?"([^"]*)"', rule["expr"]):
            assert set(text.split("|")) <= known, rule["alert"]


def test_the_dashboard_has_what_grafana_needs_to_import_it() -> None:
    document = dashboard()
    assert document["title"] and document["uid"] and document["schemaVersion"] >= 36 and "id" not in document
    assert {variable["name"] for variable in document["templating"]["list"]} == {"datasource", "instance"}
    panels = document["panels"]
    assert len({panel["id"] for panel in panels}) == len(panels)
    for panel in panels:
        assert panel["title"] and panel["description"] and panel["type"] == "timeseries"
        assert panel["datasource"] == {"type": "prometheus", "uid": "${datasource}"}
        place = panel["gridPos"]
        assert place["x"] + place["w"] <= 24 and place["h"] > 0
        assert len({target["refId"] for target in panel["targets"]}) == len(panel["targets"]) > 0


def test_the_page_on_operations_has_the_rules_of_the_file() -> None:
    page = (ROOT / "docs" / "operations.md").read_text("utf-8")
    section = page.partition("\n### What to alert on\n")[2].partition("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("| `Ridgewave")]
    shown = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip("|"))] for line in lines]
    assert shown == [line_of(rule) for rule in rules()]


def line_of(rule: dict[str, Any]) -> list[str]:
    """Return the cells of the page's line for a rule."""
    expression = rule["expr"].strip().replace("|", "\\|")
    lasting = f" for {rule['for']}" if "for" in rule else ""
    return [f"`{rule['alert']}`", f"`{expression}`{lasting}", rule["annotations"]["reason"]]
