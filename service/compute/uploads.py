"""The imports under way in one process of the service: how many each client has, and how many bytes they hold.

Model: an import is under way from its first byte until its answer. It holds a place, and the bytes of its body: those
    that the head announces, or those that have arrived where they are more. Both are bounded for each client, and the
    number of all imports too. An import beyond a bound is refused at once, with Retry-After.
Limits: for one event loop. The bytes are those of the body; beside them are the heights of a file that is read.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from service.operations.settings import Settings
from service.problems import Problem

RETRY = {"Retry-After": "5"}  # s; the usual import takes a second, the largest a minute


class Upload:
    """One import under way."""

    def __init__(self, uploads: Uploads, client: str) -> None:
        self.client = client
        self._uploads = uploads
        self._held = 0

    def hold(self, size: int) -> None:
        """Hold at least `size` bytes. Raises Problem (429) if the client would hold more than it may."""
        if size > self._held:
            self._uploads.add(self.client, size - self._held)
            self._held = size

    @property
    def held(self) -> int:
        """The bytes that it holds."""
        return self._held


class Uploads:
    """The imports under way of one process."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._number: Counter[str] = Counter()
        self._bytes: Counter[str] = Counter()

    @property
    def under_way(self) -> int:
        """The number of all imports under way."""
        return self._number.total()

    @property
    def held_bytes(self) -> int:
        """The bytes of all imports under way."""
        return self._bytes.total()

    @contextmanager
    def begin(self, client: str) -> Iterator[Upload]:
        """Yield a new import of `client`. Raises Problem: 429 for one too many of the client, 503 for one of all."""
        most = self._settings.imports_per_client
        if self._number[client] >= most:
            raise self._too_many(client, f"You have {most} imports under way (RIDGEWAVE_IMPORTS_PER_CLIENT).")
        if self.under_way >= self._settings.max_imports:
            detail = "Too many imports at a time (RIDGEWAVE_MAX_IMPORTS). Try again later."
            raise Problem("full", detail, headers=RETRY)
        self._number[client] += 1
        upload = Upload(self, client)
        try:
            yield upload
        finally:
            self._number -= Counter({client: 1})
            self._bytes -= Counter({client: upload.held})

    def add(self, client: str, size: int) -> None:
        """Count `size` more bytes of `client`. Raises Problem (429) where they are too many."""
        most = self._settings.import_bytes_per_client
        if self._bytes[client] + size > most:
            detail = f"Your imports under way may hold {most} bytes together (RIDGEWAVE_IMPORT_BYTES_PER_CLIENT)."
            raise self._too_many(client, detail)
        self._bytes[client] += size

    def _too_many(self, client: str, detail: str) -> Problem:
        hint = f"{self._number[client]} of yours are uploading, waiting or being read: wait for one of them."
        return Problem("too-many-imports", f"{detail} {hint}", headers=RETRY)
