"""How a command ends: its exit code, and the one message that says why.

    0    done
    1    could not: the request was fine, the machine or the disk was not (CannotRender, OSError)
    2    invalid request: a message with a line for each fault, never a traceback (InvalidRequest)
    130  interrupted (Ctrl-C); 143 terminated. Whatever was half written is gone

Any other exception is a bug of ridgewave's own and keeps its traceback.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Callable
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from synth.errors import Fault

DONE = 0
COULD_NOT = 1
INVALID_REQUEST = 2
INTERRUPTED = 130
TERMINATED = 143


class Terminated(BaseException):
    """SIGTERM arrived: unwinds the command, so that every `with` cleans up, and ends it with 143."""


def carry_out(command: Callable[[], int], *, as_json: bool) -> int:
    """Run `command` and return the exit code; what it raises on purpose becomes a message on standard error.

    as_json: messages are one JSON object on a line, in the service's problem shape, instead of sentences.
    """
    from synth.errors import CannotRender, InvalidRequest

    previous = signal.signal(signal.SIGTERM, _terminate)
    try:
        code = command()
        sys.stdout.flush()
        return code
    except InvalidRequest as error:
        _report("invalid request", error.faults, as_json)
        return INVALID_REQUEST
    except CannotRender as error:
        _say("could not", error.reason, as_json)
        return COULD_NOT
    except BrokenPipeError:
        return COULD_NOT  # whoever read the results left, as in `ridgewave textures | head`: there is nobody to tell
    except OSError as error:
        _say("could not", _sentence(error), as_json)
        return COULD_NOT
    except KeyboardInterrupt:
        _say("interrupted", "stopped; no unfinished file is left behind", as_json)
        return INTERRUPTED
    except Terminated:
        _say("terminated", "stopped; no unfinished file is left behind", as_json)
        return TERMINATED
    finally:
        signal.signal(signal.SIGTERM, previous)
        _settle_standard_output()


def invalid_request(field: str, value: object, allowed: str, hint: str) -> NoReturn:
    """Raise `InvalidRequest` for one fault in the command line itself; `field` is the option or argument at fault."""
    from synth.errors import Fault, InvalidRequest, shown

    raise InvalidRequest([Fault("/" + field, shown(value), allowed, hint)])


def warn(text: str) -> None:
    """Write a warning on standard error."""
    print(f"ridgewave: warning: {text}", file=sys.stderr)


def say(text: str) -> None:
    """Write a message on standard error."""
    print(f"ridgewave: {text}", file=sys.stderr)


def print_json(document: object) -> None:
    """Write a result on standard output as indented JSON; NaN and infinities are bugs, and raise ValueError."""
    print(json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False))


def _report(title: str, faults: tuple[Fault, ...], as_json: bool) -> None:
    if as_json:
        errors = [{"pointer": f.pointer, "value": f.value, "allowed": f.allowed, "hint": f.hint} for f in faults]
        _print_problem(title, errors=errors)
    elif len(faults) == 1:
        print(f"ridgewave: {faults[0].sentence()}", file=sys.stderr)
    else:
        print(f"ridgewave: {len(faults)} things are wrong:", file=sys.stderr)
        for fault in faults:
            print(f"  - {fault.sentence()}", file=sys.stderr)


def _say(title: str, detail: str, as_json: bool) -> None:
    if as_json:
        _print_problem(title, detail=detail)
    else:
        print(f"ridgewave: {detail}", file=sys.stderr)


def _print_problem(title: str, **rest: Any) -> None:
    print(json.dumps({"type": "about:blank", "title": title, **rest}, ensure_ascii=False), file=sys.stderr)


def _sentence(error: OSError) -> str:
    """Return what the operating system said, with the file it said it about."""
    reason = (error.strerror or str(error)).lower()
    return f"{error.filename}: {reason}" if error.filename else reason


def _settle_standard_output() -> None:
    """Drop what standard output no longer takes, so that Python does not stumble over it when it ends."""
    try:
        sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def _terminate(_number: int, _frame: FrameType | None) -> NoReturn:
    raise Terminated
