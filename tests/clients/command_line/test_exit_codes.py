"""Exit codes and messages of a command, as text and as JSON."""

from __future__ import annotations

import errno
import json
import os
import signal
from collections.abc import Callable
from typing import Any

import pytest

from clients.command_line.exit_codes import (
    COULD_NOT,
    DONE,
    INTERRUPTED,
    INVALID_REQUEST,
    TERMINATED,
    carry_out,
    invalid_request,
)
from clients.command_line.printing import print_json
from synth.errors import CannotRender, Fault, InvalidRequest

FAULTS = [
    Fault("/texture/period", "'3 kg'", "1 um to 1 m", 'Write a length, such as "0.8 mm".'),
    Fault("/scan/load", "-1", "0 N to 1000 N", "Write a load."),
]


def raising(error: BaseException) -> Callable[[], int]:
    def command() -> int:
        raise error

    return command


def test_the_exit_code_is_that_of_the_command() -> None:
    assert carry_out(lambda: DONE, as_json=False) == 0
    assert carry_out(lambda: INTERRUPTED, as_json=False) == 130


def test_an_invalid_request_lists_every_fault_on_standard_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert carry_out(raising(InvalidRequest(FAULTS)), as_json=False) == INVALID_REQUEST
    out, err = capsys.readouterr()
    assert out == ""
    lines = err.splitlines()
    assert lines[0] == "ridgewave: 2 things are wrong:"
    assert "texture.period: got '3 kg'; allowed: 1 um to 1 m." in lines[1]
    assert "scan.load: got -1; allowed: 0 N to 1000 N." in lines[2]


def test_one_fault_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    carry_out(raising(InvalidRequest(FAULTS[:1])), as_json=False)
    assert capsys.readouterr().err.count("\n") == 1


def test_an_invalid_request_as_json_has_the_services_shape(capsys: pytest.CaptureFixture[str]) -> None:
    assert carry_out(raising(InvalidRequest(FAULTS)), as_json=True) == INVALID_REQUEST
    problem = json.loads(capsys.readouterr().err)
    assert problem["errors"][1] == {
        "pointer": "/scan/load",
        "value": "-1",
        "allowed": "0 N to 1000 N",
        "hint": "Write a load.",
    }


@pytest.mark.parametrize(
    ("error", "code", "text"),
    [
        (CannotRender("the disk is full."), COULD_NOT, "the disk is full."),
        (OSError(errno.EACCES, os.strerror(errno.EACCES), "out.wav"), COULD_NOT, "out.wav: permission denied"),
        (KeyboardInterrupt(), INTERRUPTED, "stopped; no unfinished file is left behind"),
    ],
)
def test_an_error_is_one_sentence(
    error: BaseException, code: int, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert carry_out(raising(error), as_json=False) == code
    assert capsys.readouterr().err == f"ridgewave: {text}\n"
    assert carry_out(raising(error), as_json=True) == code
    assert json.loads(capsys.readouterr().err)["detail"] == text


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_unwinds_the_command(number: signal.Signals, capsys: pytest.CaptureFixture[str]) -> None:
    cleaned: list[str] = []

    def command() -> int:
        try:
            signal.raise_signal(number)
            return DONE
        finally:
            cleaned.append("up")

    before = signal.signal(signal.SIGHUP, signal.SIG_DFL), signal.getsignal(signal.SIGTERM)
    try:
        assert carry_out(command, as_json=False) == TERMINATED
        assert cleaned == ["up"]
        assert (signal.getsignal(signal.SIGHUP), signal.getsignal(signal.SIGTERM)) == (signal.SIG_DFL, before[1])
    finally:
        signal.signal(signal.SIGHUP, before[0])
    assert "stopped" in capsys.readouterr().err


def test_a_command_under_nohup_outlives_the_terminal() -> None:
    def command() -> int:
        signal.raise_signal(signal.SIGHUP)
        return DONE

    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert carry_out(command, as_json=False) == DONE
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_bug_keeps_its_traceback() -> None:
    with pytest.raises(ZeroDivisionError):
        carry_out(lambda: 1 // 0, as_json=False)


def test_a_fault_of_the_command_line_names_its_option() -> None:
    with pytest.raises(InvalidRequest) as caught:
        invalid_request("--set", "x", "FIELD=VALUE", "Write one.")
    assert caught.value.faults[0].sentence() == "--set: got 'x'; allowed: FIELD=VALUE. Write one."


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_results_are_strict_json(number: float) -> None:
    document: dict[str, Any] = {"peak": number}
    with pytest.raises(ValueError, match="Out of range float"):
        print_json(document)
