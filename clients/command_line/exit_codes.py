"""Runs a command: its exit code, and the message that says why it failed.

    0    done
    1    cannot be done: the request is valid, but the machine or the disk fails (CannotRender, OSError)
    2    invalid request: a message with a line for each fault (InvalidRequest)
    130  interrupted (Ctrl-C); 143 terminated, or the terminal was closed. Unfinished files are removed

Any other exception is a bug of ridgewave and keeps its traceback.
"""

from __future__ import annotations

import errno
import json
import os
import signal
import sys
from collections.abc import Callable
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn

from clients.command_line.printing import say

if TYPE_CHECKING:
    from synth.errors import Fault

DONE = 0
COULD_NOT = 1
INVALID_REQUEST = 2
INTERRUPTED = 130
TERMINATED = 143


class Terminated(BaseException):
    """Raised on SIGTERM, so that every `with` of the command cleans up."""


def carry_out(command: Callable[[], int], *, as_json: bool) -> int:
    """Run `command` and return the exit code; its errors become messages on standard error.

    as_json: a message is one line with a problem document as JSON, as the service sends it, in place of a sentence.
    """
    from synth.errors import CannotRender, InvalidRequest

    previous = signal.signal(signal.SIGTERM, _terminate)
    closed_terminal = signal.getsignal(signal.SIGHUP)
    if closed_terminal is not signal.SIG_IGN:  # as under nohup
        signal.signal(signal.SIGHUP, _hang_up)
    try:
        code = command()
        sys.stdout.flush()
        return code
    except InvalidRequest as error:
        _report_faults("invalid request", error.faults, as_json)
        return INVALID_REQUEST
    except CannotRender as error:
        _report_detail("could not", error.reason, as_json)
        return COULD_NOT
    except BrokenPipeError:
        return COULD_NOT  # the reader of the results has gone, as in `ridgewave textures | head`
    except OSError as error:
        _report_detail("could not", _sentence(error), as_json)
        return COULD_NOT
    except KeyboardInterrupt:
        _report_detail("interrupted", "stopped; no unfinished file is left behind", as_json)
        return INTERRUPTED
    except Terminated:
        _report_detail("terminated", "stopped; no unfinished file is left behind", as_json)
        return TERMINATED
    finally:
        signal.signal(signal.SIGTERM, previous)
        signal.signal(signal.SIGHUP, closed_terminal)
        discard_unread_output()


def invalid_request(field: str, value: object, allowed: str, hint: str) -> NoReturn:
    """Raise InvalidRequest for one fault of the command line; field: the option or argument at fault."""
    from synth.errors import Fault, InvalidRequest, shown

    raise InvalidRequest([Fault("/" + field, shown(value), allowed, hint)])


def _report_faults(title: str, faults: tuple[Fault, ...], as_json: bool) -> None:
    if as_json:
        errors = [{"pointer": f.pointer, "value": f.value, "allowed": f.allowed, "hint": f.hint} for f in faults]
        _print_problem(title, errors=errors)
    elif len(faults) == 1:
        say(faults[0].sentence())
    else:
        say(f"{len(faults)} things are wrong:")
        for fault in faults:
            print(f"  - {fault.sentence()}", file=sys.stderr)


def _report_detail(title: str, detail: str, as_json: bool) -> None:
    if as_json:
        _print_problem(title, detail=detail)
    else:
        say(detail)


def _print_problem(title: str, **rest: Any) -> None:
    print(json.dumps({"type": "about:blank", "title": title, **rest}, ensure_ascii=False), file=sys.stderr)


def _sentence(error: OSError) -> str:
    """Return the message of the operating system, with the name of the file."""
    if error.errno == errno.EBADF:
        return "standard input or output is closed."
    reason = error.strerror or str(error)
    reason = reason[:1].lower() + reason[1:]
    return f"{error.filename}: {reason}" if error.filename else reason


def discard_unread_output() -> None:
    """Discard output that nobody reads, which would otherwise raise an error when Python ends."""
    try:
        sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def _terminate(_number: int, _frame: FrameType | None) -> NoReturn:
    raise Terminated


def _hang_up(_number: int, _frame: FrameType | None) -> None:
    """End as on SIGTERM, for which the service has a handler of its own."""
    signal.raise_signal(signal.SIGTERM)
