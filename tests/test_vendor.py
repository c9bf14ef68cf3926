"""What the build puts beside the page: three.js where npm can fetch it, and one sentence where not."""

from __future__ import annotations

import base64
import hashlib
import importlib.util
import io
import json
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parent.parent
NPM = """#!{python}
import sys
place = sys.argv[sys.argv.index("--pack-destination") + 1]
open({asked!r}, "a").write(" ".join(sys.argv[1:]) + chr(10))
open(place + "/three-{version}.tgz", "wb").write(open({archive!r}, "rb").read())
"""


@pytest.fixture
def hook() -> ModuleType:
    """The build hook, as hatchling loads it."""
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def archive_of(hook: ModuleType, folder: Path, *, but: str = "") -> Path:
    """Return an archive as npm packs one, every file holding its own name, without the file `but`."""
    path = folder / "packed.tgz"
    with tarfile.open(path, "w:gz") as packed:
        for name in [*hook.FILES, "package/build/other.js"]:
            if name != but:
                entry = tarfile.TarInfo(name)
                entry.size = len(name)
                packed.addfile(entry, io.BytesIO(name.encode()))
    return path


def stand_in(hook: ModuleType, folder: Path, archive: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Put an npm that hands out `archive` on the PATH, trusted by its digest; return where it notes its words."""
    tools, asked = folder / "tools", folder / "asked.txt"
    tools.mkdir()
    npm = tools / "npm"
    npm.write_text(NPM.format(python=sys.executable, asked=str(asked), archive=str(archive), version=hook.VERSION))
    npm.chmod(0o755)
    digest = base64.b64encode(hashlib.sha512(archive.read_bytes()).digest()).decode()
    monkeypatch.setattr(hook, "INTEGRITY", f"sha512-{digest}")
    monkeypatch.setenv("PATH", str(tools))
    return asked


def test_the_three_files_are_put_beside_the_page_once(
    hook: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = stand_in(hook, tmp_path, archive_of(hook, tmp_path), monkeypatch)
    folder = tmp_path / "vendor"
    assert hook.vendored(folder) == ""
    assert {path.name for path in folder.iterdir()} == {*hook.FILES.values(), hook.STAMP}
    assert (folder / "three.core.js").read_text() == "package/build/three.core.js"
    assert f"three@{hook.VERSION}" in asked.read_text()
    assert hook.vendored(folder) == ""
    assert len(asked.read_text().splitlines()) == 1, "nothing is fetched twice"


SCRIPT = """/**
 * @license
 * Copyright 2010-2026 Three.js Authors
 */
// a remark
const glsl = `
  vec3 a;  // kept: it is text
`;

/** Adds. */
export function add( a, b ) {

	return a + +b / 2 / 1;

}
"""


def test_scripts_lose_remarks_and_spaces_but_not_their_licence(hook: ModuleType, tmp_path: Path) -> None:
    folder = tmp_path / "vendor"
    folder.mkdir()
    for name in hook.FILES.values():
        (folder / name).write_text(SCRIPT if name.endswith(".js") else "The MIT License\n\n© 2010")
    (folder / hook.STAMP).write_text(json.dumps({"three": hook.VERSION, "integrity": hook.INTEGRITY}))
    for _ in range(2):
        assert hook.vendored(folder) == ""
        script = (folder / "three.core.js").read_text()
        licence, code = script.split("*/\n")
        assert licence == SCRIPT.split("*/")[0]
        assert code.split() == [
            *["const", "glsl=`", "vec3", "a;", "//", "kept:", "it", "is", "text", "`;export"],
            *["function", "add(a,b){return", "a+", "+b/2/1;}"],
        ]
        assert (folder / "LICENSE").read_text() == "The MIT License\n\n© 2010"


def test_another_version_is_replaced(hook: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in(hook, tmp_path, archive_of(hook, tmp_path), monkeypatch)
    folder = tmp_path / "vendor"
    folder.mkdir()
    for name in hook.FILES.values():
        (folder / name).write_text("old")
    (folder / hook.STAMP).write_text(json.dumps({"three": "0.1.0", "integrity": "sha512-old"}))
    assert hook.vendored(folder) == ""
    assert (folder / "three.module.js").read_text() != "old"


def test_what_is_not_the_published_archive_is_not_taken(
    hook: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in(hook, tmp_path, archive_of(hook, tmp_path), monkeypatch)
    monkeypatch.setattr(hook, "INTEGRITY", "sha512-another")
    assert "as it was published" in hook.vendored(tmp_path / "vendor")
    assert not (tmp_path / "vendor").exists()


def test_an_archive_that_lacks_a_file_leaves_nothing(
    hook: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    archive = archive_of(hook, tmp_path, but="package/build/three.core.js")
    stand_in(hook, tmp_path, archive, monkeypatch)
    assert "three.core.js" in hook.vendored(tmp_path / "vendor")
    assert not (tmp_path / "vendor").exists()


def test_npm_that_fails_or_hangs_is_told_in_words(
    hook: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tools = tmp_path / "tools"
    tools.mkdir()
    npm = tools / "npm"
    for script, said in (("exit(1)", "could not fetch"), ("import time; time.sleep(60)", "did not answer")):
        npm.write_text(f"#!{sys.executable}\n{script}\n")
        npm.chmod(0o755)
        monkeypatch.setenv("PATH", str(tools))
        monkeypatch.setattr(hook, "PATIENCE", 60.0 if "exit" in script else 0.2)
        assert said in hook.vendored(tmp_path / "vendor")


def tree(folder: Path) -> Path:
    """Return a copy of what a build reads, small, with a page."""
    copy = folder / "tree"
    copy.mkdir()
    for name in ("pyproject.toml", "README.md", "LICENSE", "hatch_build.py", "constraints.txt", ".gitignore"):
        shutil.copy(ROOT / name, copy / name)
    for room in ("ridgewave", "synth", "service", "clients"):
        (copy / room).mkdir()
        (copy / room / "__init__.py").write_text("")
    (copy / "clients" / "web" / "views").mkdir(parents=True)
    (copy / "clients" / "web" / "index.html").write_text("<!doctype html>")
    (copy / "clients" / "web" / "views" / "panel.js").write_text("export const one = 1;")
    return copy


def built(copy: Path, kind: str) -> subprocess.CompletedProcess[str]:
    """Build a wheel or an sdist of `copy` without npm on the PATH."""
    words = f"import hatchling.build as b; b.build_{kind}('out')"
    (copy / "out").mkdir(exist_ok=True)
    environment = {**os.environ, "PATH": str(copy / "nothing")}
    return subprocess.run(
        [sys.executable, "-c", words], cwd=copy, env=environment, capture_output=True, text=True, check=False
    )


def test_without_npm_the_build_goes_on_with_one_sentence(tmp_path: Path) -> None:
    copy = tree(tmp_path)
    done = built(copy, "wheel")
    assert done.returncode == 0, done.stderr
    said = [line for line in (done.stdout + done.stderr).splitlines() if "three.js" in line]
    assert len(said) == 1 and "npm is not installed" in said[0]
    (wheel,) = (copy / "out").glob("*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {"clients/web/index.html", "clients/web/views/panel.js"} <= names
    assert not any("vendor" in name for name in names)


def test_what_is_beside_the_page_is_packed_though_git_does_not_hold_it(hook: ModuleType, tmp_path: Path) -> None:
    copy = tree(tmp_path)
    vendor = copy / "clients" / "web" / "vendor"
    vendor.mkdir()
    for name in hook.FILES.values():
        (vendor / name).write_text(name)
    (vendor / hook.STAMP).write_text(json.dumps({"three": hook.VERSION, "integrity": hook.INTEGRITY}))
    for kind in ("wheel", "sdist"):
        done = built(copy, kind)
        assert done.returncode == 0, done.stderr
        assert "three.js" not in done.stdout + done.stderr
    (wheel,) = (copy / "out").glob("*.whl")
    (source,) = (copy / "out").glob("*.tar.gz")
    wanted = {f"clients/web/vendor/{name}" for name in (*hook.FILES.values(), hook.STAMP)}
    assert wanted <= set(zipfile.ZipFile(wheel).namelist())
    with tarfile.open(source) as packed:
        names = {name.partition("/")[2] for name in packed.getnames()}
    assert wanted | {"hatch_build.py", "clients/web/index.html"} <= names
