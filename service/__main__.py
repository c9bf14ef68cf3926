"""`python -m service`: run the service with the settings of the environment; exits as `ridgewave serve` does."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from service.http.page_files import shipped_page
from service.operations.settings import read_settings
from service.server import run
from synth.errors import CannotRender, InvalidRequest

if TYPE_CHECKING:
    from service.engine import Engine


def main(engine: Engine | None = None) -> int:
    """Serve; return 0, 1 (could not), 2 (invalid request) or 130 (interrupted), with one message. engine: see `run`."""
    try:
        return run(read_settings(web=shipped_page()), engine)
    except InvalidRequest as error:
        print(f"ridgewave: {error}", file=sys.stderr)
        return 2
    except CannotRender as error:
        print(f"ridgewave: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
