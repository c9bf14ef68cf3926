"""The page /docs: every route, problem and setting, made from the tables that the code uses.

Plain HTML without scripts, and without content from other hosts: it works without a network.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from html import escape
from typing import Any

from service import problems
from service.operations import settings

CONTENT_SECURITY_POLICY = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'"
_STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;max-width:60em;margin:2em auto;padding:0 1em}"
    "code{background:#8882;padding:0 .2em}table{border-collapse:collapse}"
    "td,th{border:1px solid #8886;padding:.3em .6em;text-align:left;vertical-align:top}"
)


def reference_page(openapi: Mapping[str, Any]) -> str:
    """Return the page for the OpenAPI document `openapi`. Its links are relative, for a prefix of a proxy."""
    return "".join(
        (
            '<!doctype html><html lang="en"><meta charset="utf-8"><title>ridgewave</title>',
            f"<style>{_STYLE}</style><h1>ridgewave</h1><p>{escape(openapi['info']['description'])} ",
            'For programs: <a href="openapi.json">OpenAPI</a>.</p><h2>Calls</h2>',
            *(f"<p>Each path follows <code>{escape(one['url'])}</code>.</p>" for one in openapi.get("servers", ())),
            *_calls(openapi["paths"]),
            "<h2>Problems</h2><p>Errors are RFC 9457 problem documents.</p>",
            *(_problem(kind) for kind in problems.TYPES.values()),
            "<h2>Settings</h2>",
            _settings_table(),
            "</html>\n",
        )
    )


def _calls(paths: Mapping[str, Any]) -> Iterator[str]:
    for path, methods in paths.items():
        for method, call in methods.items():
            yield f"<h3><code>{method.upper()} {escape(path)}</code></h3><p>{escape(call.get('summary', ''))}. "
            yield f"{escape(call.get('description', ''))}</p>"
            if parameters := call.get("parameters"):
                yield "<ul>" + "".join(map(_parameter, parameters)) + "</ul>"
            statuses = ", ".join(escape(status) for status in call["responses"])
            yield f"<p>Answers: {statuses}.</p>"


def _parameter(parameter: Mapping[str, Any]) -> str:
    return f"<li><code>{escape(parameter['name'])}</code> {escape(parameter.get('description', ''))}</li>"


def _problem(kind: problems.ProblemType) -> str:
    return f'<p id="problem-{kind.name}"><code>{kind.name}</code> ({kind.status}) {escape(kind.when)}</p>'


def _settings_table() -> str:
    rows = (
        f"<tr><td><code>{settings.variable(entry.name)}</code><td>{escape(settings.default_text(entry))}"
        f"<td>{escape(entry.metadata['allowed'])}<td>{escape(entry.metadata['sentence'])}"
        for entry in settings.setting_fields()
    )
    return "<table><tr><th>Variable<th>Default<th>Allowed<th>Meaning" + "".join(rows) + "</table>"
