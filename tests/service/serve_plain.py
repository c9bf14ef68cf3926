"""`python -m tests.service.serve_plain`: the service with the plain engine, for tests that end it with a signal."""

from __future__ import annotations

import sys

from service.__main__ import main
from tests.service.plain_engine import PlainEngine

if __name__ == "__main__":
    sys.exit(main(PlainEngine()))
