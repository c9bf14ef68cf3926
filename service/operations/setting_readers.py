"""Readers of settings: from the text of a variable to its value. Text that is not allowed raises ValueError."""

from __future__ import annotations

import ipaddress
import math
import os
import re
from collections.abc import Callable
from pathlib import Path

from service.unix_socket import LONGEST_PATH

HOST = r"[A-Za-z0-9._-]+|\[[0-9A-Fa-f:.]+\]"


def number(low: float, high: float) -> Callable[[str], float]:
    """Return a reader of a number from `low` to `high`."""

    def read(text: str) -> float:
        number = float(text)
        if not (math.isfinite(number) and low <= number <= high):
            raise ValueError
        return number

    return read


def whole(low: int, high: int) -> Callable[[str], int]:
    """Return a reader of a whole number from `low` to `high`."""

    def read(text: str) -> int:
        if not re.fullmatch(r"[0-9]{1,18}", text) or not low <= int(text) <= high:
            raise ValueError
        return int(text)

    return read


def matching(pattern: str) -> Callable[[str], str]:
    """Return a reader of text that matches `pattern`."""

    def read(text: str) -> str:
        if not re.fullmatch(pattern, text):
            raise ValueError
        return text

    return read


def listed(pattern: str) -> Callable[[str], tuple[str, ...]]:
    """Return a reader of words, separated by commas, that match `pattern`."""

    def read(text: str) -> tuple[str, ...]:
        items = tuple(item.strip() for item in text.split(",") if item.strip())
        if not all(re.fullmatch(pattern, item) for item in items):
            raise ValueError
        return items

    return read


def origins(text: str) -> tuple[str, ...]:
    """Return origins as browsers send them: in small letters, without the port that the scheme implies."""
    items = listed(rf"https?://({HOST})(:[0-9]{{1,5}})?")(text.lower())
    return tuple(item.removesuffix(":443" if item.startswith("https:") else ":80") for item in items)


def networks(text: str) -> tuple[str, ...]:
    """Return networks, separated by commas."""
    items = tuple(item.strip() for item in text.split(",") if item.strip())
    return tuple(str(ipaddress.ip_network(item)) for item in items)


def existing_folder(text: str) -> str:
    """Return the absolute path of a folder that exists."""
    if "\0" in text or not Path(text).is_dir():
        raise ValueError
    return str(Path(text).resolve())


def socket_path(text: str) -> str:
    """Return the absolute path of a Unix socket."""
    path = os.path.abspath(text)
    if "\0" in text or len(os.fsencode(path)) > LONGEST_PATH:
        raise ValueError
    return path
