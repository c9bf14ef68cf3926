"""The page: its files and nothing else, the headers that restrict it, and what requires a key."""

from __future__ import annotations

from pathlib import Path

import pytest
from fastapi import FastAPI

from service.app import create_app
from service.http.page_files import MEDIA_TYPES, find_page_file
from tests.service.harness import ask, problem, settings_of
from tests.service.plain_engine import PlainEngine

SCRIPT = "export const answer = 42;\n" * 100
FILES = {
    "index.html": "<!doctype html><title>touch</title>",
    "vr.html": "<!doctype html><title>headset</title>",
    "page.css": "body { margin: 0 }",
    "sight/scale.js": SCRIPT,
    "sight/plot.svg": "<svg xmlns='http://www.w3.org/2000/svg'/>",
    "vendor/LICENSE": "do what you like",
    "vendor/version.json": "{}",
    ".hidden.js": "secret",
    "notes.md": "secret",
    "__pycache__/page.pyc": "secret",
    "page.py": "secret",
}
IDENTITY = {"Accept-Encoding": "identity"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "outside.js").write_text("secret")
    for name, text in FILES.items():
        path = tmp_path / "web" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    (tmp_path / "web" / "link.js").symlink_to(tmp_path / "outside.js")
    return tmp_path / "web"


@pytest.fixture
def app(folder: Path) -> FastAPI:
    return create_app(settings_of(web=folder), PlainEngine())


@pytest.mark.parametrize(
    ("path", "name", "media_type"),
    [
        ("/", "index.html", "text/html; charset=utf-8"),
        ("/vr", "vr.html", "text/html; charset=utf-8"),
        ("/web/index.html", "index.html", "text/html; charset=utf-8"),
        ("/web/page.css", "page.css", "text/css; charset=utf-8"),
        ("/web/sight/scale.js", "sight/scale.js", "text/javascript; charset=utf-8"),
        ("/web/vendor/LICENSE", "vendor/LICENSE", "text/plain; charset=utf-8"),
        ("/web/vendor/version.json", "vendor/version.json", "application/json"),
    ],
)
def test_a_file_is_sent_as_it_is_by_its_media_type(app: FastAPI, path: str, name: str, media_type: str) -> None:
    answer = ask(app, "GET", path, headers=IDENTITY)
    assert (answer.status_code, answer.text) == (200, FILES[name])
    assert answer.headers["content-type"] == media_type
    assert answer.headers["content-length"] == str(len(FILES[name]))
    assert "content-encoding" not in answer.headers


@pytest.mark.parametrize("path", ["/", "/vr", "/web/index.html", "/web/sight/plot.svg"])
def test_what_a_browser_opens_has_the_policies(app: FastAPI, path: str) -> None:
    headers = ask(app, "GET", path).headers
    policy = dict(entry.strip().partition(" ")[::2] for entry in headers["content-security-policy"].split(";"))
    assert policy["default-src"] == "'self'"
    assert policy["connect-src"] == "'self' ws: wss:"
    assert policy["worker-src"] == policy["media-src"] == "'self' blob:"
    assert policy["object-src"] == policy["base-uri"] == policy["frame-ancestors"] == "'none'"
    assert "unsafe" not in headers["content-security-policy"]
    allowed = headers["permissions-policy"]
    assert all(f"{name}=(self)" in allowed for name in ("speaker-selection", "gamepad", "xr-spatial-tracking"))
    assert all(f"{name}=()" in allowed for name in ("camera", "microphone", "geolocation"))


@pytest.mark.parametrize("path", ["/", "/web/sight/scale.js", "/web/page.css"])
def test_every_file_keeps_its_media_type_and_is_revalidated(app: FastAPI, path: str) -> None:
    headers = ask(app, "GET", path).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["cache-control"] == "no-cache"


@pytest.mark.parametrize(
    "path",
    [
        "/web/",
        "/web/missing.js",
        "/web/sight",
        "/web/sight/",
        "/web/../outside.js",
        "/web/%2e%2e/outside.js",
        "/web/..%2foutside.js",
        "/web/sight/../../outside.js",
        "/web//etc/passwd",
        "/web/link.js",
        "/web/.hidden.js",
        "/web/notes.md",
        "/web/page.py",
        "/web/__pycache__/page.pyc",
        "/web/index.html%00.js",
        "/web/" + "a" * 5000 + ".js",
        "/web/page.css/x.js",
    ],
)
def test_nothing_else_is_sent(app: FastAPI, path: str) -> None:
    answer = ask(app, "GET", path)
    problem(answer, 404, "not-found")
    assert "secret" not in answer.text


def test_a_name_that_leads_out_of_the_folder_is_not_found(folder: Path) -> None:
    """A client may normalise a path before it sends it; these names reach the folder unchanged."""
    for name in ("../outside.js", "sight/../../outside.js", "/etc/passwd", "..", "", "link.js", "sight\\scale.js", "."):
        assert find_page_file(folder, name) is None, name
    assert find_page_file(folder, "sight/scale.js") is not None


@pytest.mark.parametrize("path", ["/", "/vr", "/web/page.css"])
def test_head_answers_the_headers_alone(app: FastAPI, path: str) -> None:
    head, whole = (ask(app, method, path, headers=IDENTITY) for method in ("HEAD", "GET"))
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers == whole.headers


def test_what_the_client_has_is_not_sent_again(app: FastAPI, folder: Path) -> None:
    tag = ask(app, "GET", "/web/page.css").headers["etag"]
    for known in (tag, f'"other", {tag}', tag.removeprefix("W/"), "*"):
        again = ask(app, "GET", "/web/page.css", headers={"If-None-Match": known})
        assert (again.status_code, again.content) == (304, b"")
        assert again.headers["etag"] == tag
    assert ask(app, "GET", "/web/page.css", headers={"If-None-Match": '"other"'}).status_code == 200
    (folder / "page.css").write_text("body { margin: 1px }")
    changed = ask(app, "GET", "/web/page.css", headers={"If-None-Match": tag})
    assert (changed.status_code, changed.text) == (200, "body { margin: 1px }")


@pytest.mark.parametrize(
    ("accepted", "compressed"),
    [("gzip, br", True), ("*", True), ("GZIP;q=0.5", True), ("gzip;q=0", False), ("br", False), ("identity", False)],
)
def test_text_is_compressed_where_the_client_accepts_gzip(app: FastAPI, accepted: str, compressed: bool) -> None:
    answer = ask(app, "GET", "/web/sight/scale.js", headers={"Accept-Encoding": accepted})
    assert answer.text == SCRIPT
    assert answer.headers.get("content-encoding") == ("gzip" if compressed else None)
    assert (int(answer.headers["content-length"]) < len(SCRIPT) / 10) == compressed
    assert answer.headers["vary"] == "Accept-Encoding"


def test_the_page_requires_no_key_but_its_calls_do(folder: Path) -> None:
    app = create_app(settings_of(web=folder, api_keys="key-one"), PlainEngine())
    for path in ("/", "/vr", "/web/sight/scale.js"):
        assert ask(app, "GET", path).status_code == 200
    problem(ask(app, "GET", "/web/missing.js"), 404, "not-found")
    for method, path in (("POST", "/v1/picture"), ("GET", "/v1/threshold"), ("GET", "/v1/scene/schema.json")):
        problem(ask(app, method, path, json={}), 401, "key-required")
    for path in ("/webby", "/web", "/vr/", "/Web/page.css"):
        problem(ask(app, "GET", path), 401, "key-required")


def test_a_foreign_host_does_not_get_the_page(app: FastAPI) -> None:
    for path in ("/", "/vr", "/web/page.css"):
        problem(ask(app, "GET", path, headers={"Host": "evil.example"}), 403, "host-refused")


def test_the_page_takes_no_writes(app: FastAPI) -> None:
    for path in ("/", "/vr", "/web/page.css"):
        problem(ask(app, "POST", path, json={}), 405, "method-not-allowed")


def test_without_a_page_the_root_redirects_to_the_docs() -> None:
    app = create_app(settings_of(), PlainEngine())
    for method in ("GET", "HEAD"):
        assert ask(app, method, "/").headers["location"] == "/docs"
    for path in ("/vr", "/web/index.html"):
        problem(ask(app, "GET", path), 404, "not-found")


def test_a_folder_without_an_index_has_none(tmp_path: Path) -> None:
    problem(ask(create_app(settings_of(web=tmp_path), PlainEngine()), "GET", "/"), 404, "not-found")


def test_scripts_have_a_media_type_that_browsers_load_as_modules() -> None:
    assert MEDIA_TYPES[".js"].startswith("text/javascript")
