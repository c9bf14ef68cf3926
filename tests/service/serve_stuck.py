"""`python -m tests.service.serve_stuck`: the service with an engine whose tables and measurements never end."""

from __future__ import annotations

import sys
import threading
from typing import Any

from service.__main__ import main
from service.engine import TableFile
from synth.scene.scene import Scene
from tests.service.plain_engine import PlainEngine


class StuckEngine(PlainEngine):
    """Writes a line to the log when its work begins."""

    def make_table(self, scene: Scene) -> TableFile:
        print("a table begins", file=sys.stderr, flush=True)
        threading.Event().wait()
        raise AssertionError

    def accuracy(
        self, scene: Scene, quantity: str | None, given_up: threading.Event, *, live: bool = False
    ) -> dict[str, Any]:
        print("a measurement begins", file=sys.stderr, flush=True)
        return super().accuracy(scene, quantity, given_up, live=live)


if __name__ == "__main__":
    sys.exit(main(StuckEngine(slow=True)))
