"""Runs the alert rules of docs/operations/alerts.yml over series of metrics, with promtool."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from prometheus_client.parser import text_string_to_metric_families

from tests.service.harness import ROOT
from tests.service.programs import program

RULES = ROOT / "docs" / "operations" / "alerts.yml"
DASHBOARD = ROOT / "docs" / "operations" / "dashboard.json"
INTERVAL_SECONDS = 15
SAMPLES = 56  # 14 minutes: the longest rule looks at five, and waits for five more
TARGET = {"instance": "here:8000", "job": "ridgewave"}

Key = tuple[str, frozenset[tuple[str, str]]]


def key(name: str, **labels: str) -> Key:
    """Return what tells a series from others."""
    return name, frozenset(labels.items())


def samples(exposed: str) -> dict[Key, float]:
    """Return the value of every series in an answer of `/metrics`."""
    families = text_string_to_metric_families(exposed)
    return {key(sample.name, **sample.labels): sample.value for family in families for sample in family.samples}


def steady(value: float) -> str:
    """Return a series that stays, in promtool's notation."""
    return f"{value!r}x{SAMPLES}"


def step(before: float, after: float) -> str:
    """Return a series that changes once, two and a half minutes before the end."""
    late = 150 // INTERVAL_SECONDS
    return f"{before!r}x{SAMPLES - late - 1} {after!r}x{late}"


def rising(a_second: float) -> str:
    """Return a series that rises all the time."""
    return f"0+{a_second * INTERVAL_SECONDS!r}x{SAMPLES}"


def firing(folder: Path, cases: Sequence[tuple[Mapping[Key, str], Iterable[str]]], among: str = ".*") -> None:
    """Assert that at the end of each of `cases` (series, names) the alerts of these names fire, and no other.

    among: a regular expression of the names that are looked at.
    """
    tests = [_case(series, names, among) for series, names in cases]
    minutes = (SAMPLES * INTERVAL_SECONDS) // 60
    for test in tests:
        test["promql_expr_test"][0]["eval_time"] = f"{minutes}m"
    document = {"rule_files": [str(RULES)], "evaluation_interval": f"{INTERVAL_SECONDS}s", "tests": tests}
    (folder / "rules_test.yml").write_text(json.dumps(document), encoding="utf-8")  # JSON is YAML
    promtool("test", "rules", str(folder / "rules_test.yml"))


def _case(series: Mapping[Key, str], names: Iterable[str], among: str) -> dict[str, Any]:
    written = [
        {"series": f"{name}{_labels(dict(labels) | TARGET)}", "values": values}
        for (name, labels), values in series.items()
    ]
    fired = [{"labels": _labels({"alertname": name}), "value": 1} for name in names]
    firing = f'ALERTS{{alertstate="firing", alertname=~"{among}"}}'
    query = f"count by (alertname) (count by (alertname, instance) ({firing}))"
    return {
        "interval": f"{INTERVAL_SECONDS}s",
        "input_series": written,
        "promql_expr_test": [{"expr": query, "exp_samples": fired}],
    }


def _labels(labels: Mapping[str, str]) -> str:
    return "{" + ", ".join(f"{name}={json.dumps(value)}" for name, value in sorted(labels.items())) + "}"


def promtool(*words: str) -> str:
    """Return what promtool says; fail where it finds fault."""
    done = subprocess.run(
        [program("promtool", "prometheus"), *words], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
