"""The frame: what is installed, what the wheel holds, how the image is built, what continuous integration runs."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

from tests.readme_blocks import marked_command

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
PINS = [line for line in (ROOT / "constraints.txt").read_text("utf-8").splitlines() if not line.startswith("#")]


def requirement_name(requirement: str) -> str:
    found = re.match(r"[A-Za-z0-9._-]+", requirement)
    assert found is not None, requirement
    return canonical(found.group())


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def pip_words(command: str) -> list[list[str]]:
    """Return the words of every pip install in a shell command, from "install" on."""
    parts = [shlex.split(part) for part in re.split(r"&&|;", command)]
    return [words[1:] for words in parts if words and words[0].endswith("/pip")]


def dockerfile() -> str:
    return (ROOT / "Dockerfile").read_text("utf-8").replace("\\\n", " ")


def apt_packages(text: str) -> set[str]:
    found = re.findall(r"apt-get install((?: +(?:-\S+|[a-z0-9][a-z0-9.+-]*))+)", text)
    return {word for words in found for word in words.split() if not word.startswith("-")}


def run_quietly(*command: str) -> None:
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_constraints_are_plain_pins() -> None:
    assert PINS
    wrong = [line for line in PINS if not re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.+!]+", line)]
    assert not wrong


def test_constraints_pin_every_requirement() -> None:
    pinned = {requirement_name(line) for line in PINS}
    extras = PROJECT["optional-dependencies"].values()
    wanted = {requirement_name(each) for each in PROJECT["dependencies"] + [each for extra in extras for each in extra]}
    assert wanted <= pinned, wanted - pinned


def test_every_requirement_says_why_it_is_there() -> None:
    lines = (ROOT / "pyproject.toml").read_text("utf-8").partition("\ndependencies = [")[2].partition("\n]")[0]
    assert all("#" in line for line in lines.splitlines() if line.strip())


def test_what_is_imported_is_required() -> None:
    """Runtime code imports the standard library, the three packages, and what pyproject.toml requires.

    What draws a figure also imports what the extra `plots` requires. The reader of instruments' files imports what the
    extra `surfaces` requires, the view of a sound as a labelled array what the extra `xarray` requires, and a
    study what the extra `study` requires.
    """
    from tests.test_layers import ROOMS, imports_of, sources

    figures = ("accuracy_report/figure.py", "compare_figure.py", "figure_look.py")
    drawing = {ROOT / "clients" / name for name in figures} | {ROOT / "synth" / "encode" / "sound.py"}
    drawing |= set((ROOT / "clients" / "study_figures").glob("*.py"))
    readers = ROOT / "synth" / "surfaces" / "readers"
    reading = {readers / "topography_package.py", readers / "array_files.py"}
    extras = PROJECT["optional-dependencies"]
    labelling = {ROOT / "synth" / "encode" / "sound_views.py"}
    studying = drawing | {ROOT / "ridgewave" / "studies.py", *(ROOT / "synth" / "study").glob("*.py")}
    plots, surfaces, xarray, study = (
        {requirement_name(each) for each in extras[name]} for name in ("plots", "surfaces", "xarray", "study")
    )
    # in what fastapi, pydantic, pillow and the like bring
    other_names = {"starlette", "pydantic-core", "pythonjsonlogger", "pil"}
    required = {requirement_name(each) for each in PROJECT["dependencies"]} | other_names
    for path in (path for room in ROOMS for path in sources(room)):
        allowed = required | (plots if path in drawing else set()) | (surfaces if path in reading else set())
        allowed |= (xarray if path in labelling else set()) | (study if path in studying else set())
        imported = {name.split(".")[0] for name, _ in imports_of(path)}
        strays = {name for name in imported - sys.stdlib_module_names - set(ROOMS) if canonical(name) not in allowed}
        assert not strays, f"{path.relative_to(ROOT)}: not required in pyproject.toml: {strays}"


def test_the_wheel_holds_the_packages_and_no_tests(tmp_path: Path) -> None:
    build = f"import hatchling.build as b; b.build_wheel({str(tmp_path)!r})"
    run_quietly(sys.executable, "-c", build)
    (wheel,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.split("/")[0] for name in names}
    assert tops == {"ridgewave", "synth", "service", "clients", f"ridgewave-{PROJECT['version']}.dist-info"}
    ours = {
        str(path.relative_to(ROOT))
        for room in ("ridgewave", "synth", "service", "clients")
        for path in (ROOT / room).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert {name for name in names if ".dist-info/" not in name} == ours
    assert {f"{room}/py.typed" for room in ("ridgewave", "synth", "service", "clients")} <= ours


def test_the_image_installs_as_the_readme_does() -> None:
    readme = (ROOT / "README.md").read_text("utf-8")
    (step,) = re.findall(r"^RUN (python3 -m venv .*)$", dockerfile(), re.M)
    (image,) = pip_words(step)
    (first,) = pip_words(marked_command(readme, "the main job"))
    (tests,) = pip_words(marked_command(readme, "the tests"))
    assert image == first == ["install", "-c", "constraints.txt", "."]
    assert [word.partition("[")[0] for word in tests] == first, "the tests' install differs by its extras only"


def test_the_image_installs_system_packages_that_ci_proves() -> None:
    script = (ROOT / ".ci" / "run").read_text("utf-8")
    proven = set(re.findall(r"^    \[([a-z0-9.+-]+)\]=", script, re.M))
    image = apt_packages(dockerfile())
    assert image
    assert image <= proven
    readme = apt_packages((ROOT / "README.md").read_text("utf-8"))
    assert readme == proven, "README.md names the packages that .ci/run installs"


def test_ci_runs_the_readmes_test_command() -> None:
    """What .ci/run takes out of README.md with awk is the block that a reader sees, cut where the linters begin."""
    script = (ROOT / ".ci" / "run").read_text("utf-8")
    extract = script[script.index("command=$(awk") : script.index("rm -rf .venv-test")]
    done = subprocess.run(
        ["bash", "-euc", extract + 'printf "%s\n" "$install" "$tests"'],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    install, tests = done.stdout.splitlines()
    assert f"{install} && {tests}" == marked_command((ROOT / "README.md").read_text("utf-8"), "the tests")
    assert "pip install" in install and "pytest" not in install
    assert tests.startswith(".venv-test/bin/python -m pytest")


def test_the_image_gets_what_its_build_copies() -> None:
    """.dockerignore lets through every path that the Dockerfile copies from the checkout."""
    let_through = {
        line.removeprefix("!")
        for line in (ROOT / ".dockerignore").read_text("utf-8").splitlines()
        if line.startswith("!")
    }
    copied = re.findall(r"^COPY (?!--from)(.+) \S+$", dockerfile(), re.M)
    assert {word for words in copied for word in words.split()} == let_through
    assert {"ridgewave", "synth", "service", "clients"} <= let_through, "the packages of the wheel"
    assert all((ROOT / name).exists() for name in let_through)
