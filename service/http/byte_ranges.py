"""Byte ranges: a part of an answer to GET (RFC 9110, 14).

Model: players read the first bytes of a sound before they play it, and read on from where they stopped. One range is
    answered with 206 and Content-Range; several are answered as none is, with the whole. So is a range with If-Range,
    unless it has the ETag. A header that is no range is ignored. Of an answer without an end, only the bytes before
    the samples can be read by range.
Limits: GET only, as the standard demands: a render is a POST, and HEAD has no part.
"""

from __future__ import annotations

import re
from collections.abc import AsyncGenerator
from contextlib import aclosing
from typing import NamedTuple, NoReturn

from starlette.requests import Request

from service.problems import Problem

ONE = re.compile(r"bytes=[ \t]*(\d{0,18})-(\d{0,18})[ \t]*", re.ASCII | re.IGNORECASE)
ACCEPTED = {"Accept-Ranges": "bytes"}


class ByteRange(NamedTuple):
    """The bytes `first` to `last`, both included, of `length`; None for an answer without an end."""

    first: int
    last: int
    length: int | None

    @property
    def headers(self) -> dict[str, str]:
        """The headers of a 206."""
        whole = "*" if self.length is None else self.length
        return {
            "Content-Range": f"bytes {self.first}-{self.last}/{whole}",
            "Content-Length": str(self.last + 1 - self.first),
        }


def range_of(request: Request, length: int, tag: str | None = None) -> ByteRange | None:
    """Return the part that a request asks for, of an answer of `length` bytes; None for the whole.

    tag: the strong ETag, without its quotes.
    Raises Problem (416) for a range that begins behind the end.
    """
    asked = _asked(request, tag)
    if asked is None:
        return None
    begin, end = asked
    first = max(0, length - (end or 0)) if begin is None else begin
    last = length - 1 if begin is None or end is None else min(end, length - 1)
    if first >= length:
        _refuse(f"from 0 to {length - 1}", {"Content-Range": f"bytes */{length}"})
    return ByteRange(first, last, length)


def range_of_endless(request: Request, header_bytes: int) -> ByteRange | None:
    """Return the part of the header that a request for an endless sound asks for; None for the whole sound.

    header_bytes: length of what is sent before the samples.
    Raises Problem (416) for a range that begins among the samples, or at the end.
    """
    asked = _asked(request, None)
    if asked is None or asked == (0, None):
        return None
    begin, end = asked
    if begin is None or begin >= header_bytes:
        known = f"from 0 to {header_bytes - 1}, the header" if header_bytes else "nothing: this format has no header"
        _refuse(f"{known}; the samples have no end and are played as they come")
    return ByteRange(begin, header_bytes - 1 if end is None else min(end, header_bytes - 1), None)


async def part_of(chunks: AsyncGenerator[bytes, None], part: ByteRange) -> AsyncGenerator[bytes, None]:
    """Yield the bytes of `part` out of `chunks`, and close these."""
    begin = 0
    async with aclosing(chunks):
        async for chunk in chunks:
            piece = chunk[max(0, part.first - begin) : max(0, part.last + 1 - begin)]
            begin += len(chunk)
            if piece:
                yield piece
            if begin > part.last:
                return


def _asked(request: Request, tag: str | None) -> tuple[int | None, int | None] | None:
    """Return the two numbers of the Range header, None for one that is left out; None without a valid range."""
    condition = request.headers.get("if-range")
    if request.method != "GET" or (condition is not None and (tag is None or condition.strip() != f'"{tag}"')):
        return None
    found = ONE.fullmatch(request.headers.get("range", ""))
    if found is None or not any(found.groups()):
        return None
    begin, end = (int(digits) if digits else None for digits in found.groups())
    return None if begin is not None and end is not None and end < begin else (begin, end)


def _refuse(allowed: str, headers: dict[str, str] | None = None) -> NoReturn:
    detail = f"Range names bytes that this sound or file does not have. It has those {allowed}. Leave Range out."
    raise Problem("range-refused", detail, headers=headers or {})
