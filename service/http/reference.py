"""The OpenAPI document and the page /docs as they are sent. Each is made once, which takes 0.1 s, and kept.

Limits: they are made by the first call, in its thread; the service calls at its start.
"""

from __future__ import annotations

from functools import cached_property

from fastapi import FastAPI

from service.http import openapi
from service.http.reference_page import reference_page
from synth.scene.text import json_text


class Reference:
    """Both for one application. Call it from a thread."""

    def __init__(self, app: FastAPI) -> None:
        self._app = app

    @cached_property
    def document(self) -> bytes:
        """Return the OpenAPI document, JSON."""
        return json_text(openapi.document(self._app))

    @cached_property
    def page(self) -> bytes:
        """Return the page, HTML."""
        return reference_page(openapi.document(self._app)).encode()

    def make(self) -> None:
        """Make both."""
        assert self.document and self.page
