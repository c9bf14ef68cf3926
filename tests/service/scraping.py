"""Reads what `/metrics` answers, with Prometheus's own parser."""

from __future__ import annotations

from typing import Any

import httpx
from fastapi import FastAPI
from prometheus_client.parser import text_string_to_metric_families

from tests.service.harness import ask


class Scrape:
    """The samples of one answer."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.families = {family.name: family for family in text_string_to_metric_families(text)}
        samples = [sample for family in self.families.values() for sample in family.samples]
        self._values = {(sample.name, *sorted(sample.labels.items())): sample.value for sample in samples}

    def value(self, name: str, **labels: str) -> float:
        """Return the one sample of this name, without the prefix, and these labels."""
        return float(self._values[(f"ridgewave_{name}", *sorted(labels.items()))])


def scrape(source: FastAPI | httpx.Client, **rest: Any) -> Scrape:
    """Return what an application in process, or a service behind a client, answers now."""
    answer = (
        source.get("/metrics", **rest) if isinstance(source, httpx.Client) else ask(source, "GET", "/metrics", **rest)
    )
    assert answer.status_code == 200, answer.text
    return Scrape(answer.text)
