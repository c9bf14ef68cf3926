"""`python -m service`: run the service with the settings of the environment; exits as `ridgewave serve` does."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from service.http.page_files import shipped_page
from service.operations.settings_environment import read_settings
from service.server import run
from synth.errors import CannotRender, InvalidRequest

if TYPE_CHECKING:
    from service.engine import Engine

NO_ARGUMENTS = (
    "python -m service takes no arguments: its settings come from the environment (docs/settings.md), "
    "and `ridgewave serve` has options."
)


def main(engine: Engine | None = None, arguments: Sequence[str] = ()) -> int:
    """Serve until a signal. On failure, print one message.

    engine: see `service.server.run`.
    arguments: those of the command line; any argument is refused.
    Returns 0, 1 (could not serve), 2 (invalid request) or 130 (interrupted).
    """
    if arguments:
        print(f"ridgewave: {NO_ARGUMENTS}", file=sys.stderr)
        return 2
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
    sys.exit(main(arguments=sys.argv[1:]))
