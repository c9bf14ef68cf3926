"""Multipart request bodies: one file with its fields, checked for their media type and their size.

The Content-Type is checked before a byte of the body is read. The size is checked while the body is read. A
large file is kept in a temporary file meanwhile, not in memory. A body without its closing boundary was cut: the parser
would drop its last part without a word.

Limits: the media type does not refuse a form that another page posts, as it does elsewhere (`request_body`). The checks
of Origin and Host (`security`) refuse it.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass

from python_multipart.multipart import parse_options_header
from starlette.datastructures import UploadFile
from starlette.formparsers import MultiPartException
from starlette.requests import Request
from starlette.types import Message

from service.compute.import_process import NO_ROOM
from service.http.request_body import check_not_packed, too_large
from service.problems import Problem, refused
from synth.errors import CannotRender, shown

FORM = "multipart/form-data"
MOST_FIELDS = 16
FIELD_BYTES = 4096
CHARSETS = ("utf-8", "us-ascii")  # RFC 7578 has no charset; with others, decoding fails or leaves lone surrogates


@dataclass(frozen=True, slots=True)
class Form:
    """A file and the fields beside it, by name; empty fields are left out."""

    file: UploadFile
    fields: dict[str, str]


@asynccontextmanager
async def read_form(
    request: Request, limit: int, setting: str, hold: Callable[[int], None] = lambda _size: None
) -> AsyncIterator[Form]:
    """Yield the form of a request, with its file in the field "file".

    limit: largest body, in bytes, which the setting `setting` gives.
    hold: called with the size of the body, announced or arrived so far. What it raises ends the upload.
    Raises Problem: 415 for another media type, 413 for a larger body, 422 for a form without a file; CannotRender where
    the temporary file has no room.
    """
    media_type, parameters = parse_options_header(request.headers.get("content-type"))
    if media_type != FORM.encode():
        raise Problem("not-multipart", f"Send Content-Type: {FORM}.", headers={"Accept-Post": FORM})
    check_not_packed(request, "not-multipart", FORM)
    if (charset := parameters.get(b"charset", b"utf-8").decode("latin-1")).lower() not in CHARSETS:
        raise refused("", f"a form with charset={shown(charset)}", "a form in UTF-8", "Leave charset out.")
    larger = too_large(limit, setting)
    length = request.headers.get("content-length", "")
    if (announced := int(length) if length.isdigit() else 0) > limit:
        raise larger
    hold(announced)
    total, closing, newest, is_closed = 0, b"\r\n--" + parameters.get(b"boundary", b"") + b"--", b"", False

    async def counted() -> Message:
        """Return the next message. Raises `larger` once the body exceeds the limit, whatever its header says."""
        nonlocal total, newest, is_closed
        message = await request.receive()
        body = message.get("body", b"")
        total += len(body)
        if total > limit:
            raise larger
        hold(total)
        newest += body
        is_closed = is_closed or closing in newest
        newest = newest[1 - len(closing) :]
        return message

    asked = Request({name: value for name, value in request.scope.items() if name != "app"}, counted)
    try:
        parsed = await asked.form(max_files=1, max_fields=MOST_FIELDS, max_part_size=FIELD_BYTES)
    except MultiPartException as error:
        raise refused("", shown(str(error)), "a multipart form with one file", "See docs/http.md.") from error
    except OSError as error:
        raise CannotRender(NO_ROOM) from error
    try:
        if not is_closed:
            raise refused("", "a form without its closing boundary", "a whole form", "Send all of it again.")
        yield _checked(dict(parsed.multi_items()), len(parsed.multi_items()))
    finally:
        await parsed.close()


def _checked(parts: dict[str, UploadFile | str], count: int) -> Form:
    if len(parts) != count:
        raise refused("", "a field twice", "each field once", "Leave one out.")
    file = parts.pop("file", None)
    if not isinstance(file, UploadFile):
        hint = 'Send it as the field "file", with a filename: a part without one is text.'
        raise refused("/file", "nothing" if file is None else "text", "a file", hint)
    fields = {name: value for name, value in parts.items() if isinstance(value, str) and value}
    if any(isinstance(value, UploadFile) for value in parts.values()):
        raise refused("", "two files", 'one file, in the field "file"', "Leave the other out.")
    return Form(file, fields)
