"""The absolute form of a request's target, `GET http://host/path HTTP/1.1`, as a client sends it to a proxy.

Model: the path and the query are those of the target. Its host replaces the header Host, so the checks of Host see it.
Source: RFC 9112, 3.2.2.
"""

from __future__ import annotations

import re
from urllib.parse import unquote

from starlette.types import Scope

ABSOLUTE = re.compile(rb"(?:https?|wss?)://([^/]+)(/.*)?", re.IGNORECASE | re.DOTALL)


def use_origin_form(scope: Scope) -> None:
    """Change the scope of a request in absolute form to that of the same request in the usual form."""
    found = ABSOLUTE.fullmatch(scope["raw_path"])
    if found is None:
        return
    host, path = found[1], found[2] or b"/"
    scope["raw_path"], scope["path"] = path, unquote(path.decode("ascii"))
    scope["headers"] = [(b"host", host), *(entry for entry in scope["headers"] if entry[0] != b"host")]
