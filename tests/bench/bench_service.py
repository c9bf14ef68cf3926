"""`POST /v1/render` over loopback: requests of a cached render to a real service in a separate process.

The client is `http.client` with one connection that is kept alive; it reads the whole answer and checks its length.
"""

from __future__ import annotations

import http.client
import json
import tempfile
from pathlib import Path
from time import perf_counter
from urllib.parse import urlsplit

from tests.bench.timing import Figure, figure
from tests.service.harness import Child

SECOND = json.dumps({"output": {"duration": 1.0}}).encode()
SOUND_BYTES = 4 * 48000
PATIENCE = 60.0  # s


def figures(quick: bool) -> list[Figure]:
    """Return the lines of the service; client and server may use all cores."""
    with tempfile.TemporaryDirectory() as folder:
        child = Child("service", Path(folder))
        try:
            address = urlsplit(child.url())
            client = http.client.HTTPConnection(address.hostname or "", address.port, timeout=PATIENCE)
            repeats = 5 if quick else 300
            for _ in range(5):
                asked(client)
            took = [asked(client) for _ in range(repeats)]
            client.close()
        finally:
            child.end()
    how = f"1 s at 48 kHz, float32 WAV, cached, over loopback, http.client kept alive, median of {repeats}"
    return [figure("POST /v1/render", took, "ms", 5.0, how, scale=1e3)]


def asked(client: http.client.HTTPConnection) -> float:
    """Return the seconds from the request to the last byte of its answer."""
    began = perf_counter()
    client.request("POST", "/v1/render", SECOND, {"Content-Type": "application/json"})
    answer = client.getresponse()
    sound = answer.read()
    took = perf_counter() - began
    if answer.status != 200 or len(sound) < SOUND_BYTES:
        raise RuntimeError(f"the service answered {answer.status}: {sound[:200]!r}")
    return took
