"""Arrays become scenes, sounds become files and views, and every file comes back as it was."""

from __future__ import annotations

import ast
import inspect
import io
import json
import pickle
import subprocess
import sys
import textwrap
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
import xarray
from scipy.io import wavfile

import ridgewave as rw
from synth.encode.scaled_frames import UNSCALED
from synth.encode.sound import Sound
from tests.conftest import in_this_process
from tests.synth.surfaces.maps.map_sets import Case, file_of, made, normals, surface

OUTPUT = {"duration": 0.05, "sample_rate": 8000}
POINTS = np.column_stack([np.linspace(0, 0.05, 700), np.linspace(0, 0.004, 700), np.full(700, 0.4)])
WAVE = 4e-6 * np.cos(np.arange(5000) / 9.0)
SCENES: dict[str, dict[str, Any]] = {
    "plain": {"output": OUTPUT},
    "huge": {"texture": {"kind": "profile", "heights": WAVE, "spacing": "20 um"}, "output": OUTPUT},
    "recorded": {"scan": {"trajectory": POINTS}, "output": OUTPUT},
    "two channels": {"output": {**OUTPUT, "channels": ["velocity", "displacement"]}},
}
KINDS = [("x.wav", None), ("x.wav", "pcm16"), ("x.wav", "pcm24"), ("x.flac", None)]


@pytest.fixture(scope="module", params=SCENES)
def sound(request: pytest.FixtureRequest) -> Sound:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rw.RenderWarning)
        return rw.render(SCENES[request.param])


@pytest.mark.parametrize(("name", "subtype"), KINDS)
def test_a_saved_sound_comes_back(sound: Sound, name: str, subtype: str | None, tmp_path: Path) -> None:
    path = sound.save(tmp_path / name, subtype)
    again = rw.load(path)
    assert again.scene == sound.scene == rw.parse_scene(path)
    assert (again.full_scale, again.quantities, again.sample_rate) == (sound.full_scale, sound.quantities, 8000)
    step = 0.0 if (name, subtype) == KINDS[0] else 2.0**-16 if subtype == "pcm16" else 2.0**-23
    np.testing.assert_allclose(again.frames, sound.frames, rtol=0, atol=step)
    with soundfile.SoundFile(path) as file:  # the scale, by libsndfile alone; then the samples, by SciPy alone
        channels = json.loads(file.comment)["channels"]
    assert [channel["full_scale"] for channel in channels] == list(sound.full_scale)
    if path.suffix == ".wav":
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            rate, samples = wavfile.read(path)
        assert (rate, len(samples)) == (8000, len(sound.frames))


def test_every_array_is_a_list_that_it_does_not_change_later() -> None:
    for dtype in (np.float64, np.float32, np.float16, np.int8):
        heights = np.zeros(50, dtype)
        scene = rw.parse_scene({"texture": {"kind": "profile", "heights": heights, "spacing": np.array([1e-5])}})
        heights[3] = 1
        assert scene.document()["texture"]["heights"] == [0.0] * 50
        assert rw.Scene.from_json(scene.json_text()) == scene
    data = xarray.DataArray(np.full((2, 3), 2e-6), attrs={"units": "m"})
    assert rw.Scene(texture={"kind": "heightmap", "rows": data}).texture.document()["rows"] == [[2e-6] * 3] * 2
    rows = [np.zeros(3), np.zeros(3)]
    assert rw.Scene(texture={"kind": "heightmap", "rows": rows}).texture.document()["rows"] == [[0.0] * 3] * 2
    sums = {"kind": "harmonics", "amplitudes": np.array([1e-6]), "phases": [np.float32(0.5)]}
    assert rw.Scene(texture=sums).texture.document()["phases"] == [0.5]


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (np.array([0.0, np.nan, 0.0]), r"heights\.1: got nan"),
        (np.ma.masked_array([0.0, 0.0, 1.0], [False, False, True]), r"heights\.2: got nan"),
        (np.zeros(3) * 1j, "complex numbers"),
        (np.array(["0 m", "1"]), r"heights\.1: got '1'.*Add a unit"),
        (np.array([None, 1.0]), "Python objects"),
        (np.zeros(3, bool), "truth values"),
        (xarray.DataArray([1.0, 2.0], attrs={"units": "um"}), "an array in um"),
        (np.zeros((2, 2)), r"texture\.rows"),
    ],
)
def test_an_array_that_is_no_list_of_si_numbers_is_refused(wrong: Any, told: str) -> None:
    with pytest.raises(rw.SceneError, match=told) as caught:
        rw.Scene(texture={"kind": "profile", "heights": wrong})
    assert len(caught.value.faults) == 1
    assert caught.value.__suppress_context__, "the traceback does not begin with pydantic's"


def test_a_number_may_be_an_array_of_one_number() -> None:
    assert rw.Scene(scan={"load": np.array(0.5), "speed": np.array([[0.1]])}).scan.load == 0.5
    for wrong in (np.array([1.0, 2.0]), np.array(np.inf), np.array(True), np.array(1j)):
        with pytest.raises(rw.SceneError, match=r"scan\.load"):
            rw.Scene(scan={"load": wrong})


def test_a_file_of_heights_is_read(tmp_path: Path) -> None:
    path = tmp_path / "track.npy"
    np.save(path, 1e-6 * np.sin(np.arange(70_000) / 7.0))
    texture = {"kind": "profile", "file": str(path), "spacing": "10 um"}
    scene = rw.parse_scene({"texture": texture, "output": OUTPUT})
    assert scene.texture.surface and rw.explain(scene).scene["texture"]["file"] == str(path)
    assert rw.parse_scene({}, texture=texture).texture == scene.texture


def test_another_programs_file_has_samples_and_no_scale(tmp_path: Path) -> None:
    path = tmp_path / "other.wav"
    soundfile.write(path, np.full((10, 2), 0.25), 44100)
    with pytest.warns(rw.RenderWarning, match="no scale"):
        sound = rw.load(path)
    assert (sound.quantities, sound.units) == ((UNSCALED,) * 2, ("", "")) and sound.frames[0, 0] == 0.25
    assert "; 1 warning>" in repr(sound) and "no scale" in sound._repr_html_()
    with pytest.raises(rw.CannotRender, match="no scene"):
        _ = sound.scene
    with pytest.raises(rw.SceneError, match="no scene in it"):
        rw.render(path)
    with pytest.raises(rw.InvalidRequest, match="no scale"):
        sound.with_full_scale(1.0)


def test_what_is_no_sound_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.wav").write_text("no sound")
    (tmp_path / "cut.wav").write_bytes(b"RIFF\0\0\0\0WAVELIST")
    (tmp_path / "a.raw").write_bytes(bytes(8))
    for name in ("text.wav", "cut.wav", "a.raw", "absent.wav", ""):
        with pytest.raises(rw.InvalidRequest, match="a WAV or FLAC file"):
            rw.load(tmp_path / name)


def test_the_command_line_takes_a_sound_for_a_scene(tmp_path: Path) -> None:
    sound = rw.render(SCENES["plain"])
    sound.save(tmp_path / "a.flac").rename(tmp_path / "any-name")
    for words in (["render", "any-name", "-o", "b.wav"], ["explain", "any-name"]):
        done = in_this_process(words, tmp_path)
        assert done.returncode == 0, done.stderr
    np.testing.assert_array_equal(rw.load(tmp_path / "b.wav").frames, sound.frames)


def test_a_recording_and_its_file_render_the_same(tmp_path: Path) -> None:
    contact = [[0, "contact", 1, 0.0, 0.0, None, 0.3], [200, "contact", 2, 0.025, 0.002, None, 0.3]]
    scene = rw.parse_scene({"output": OUTPUT}).document()
    head = {"format": "ridgewave-recording", "version": 6, "scene": scene, "full_scale": [5.0]}
    recording = {**head, "frames": 400, "faded": 0, "events": contact}
    sound = rw.render(recording)
    assert sound.frames.any() and len(sound.frames) == 400
    again = rw.render(sound.save(tmp_path / "hand.wav"))
    np.testing.assert_array_equal(again.frames, sound.frames)
    assert rw.load(tmp_path / "hand.wav").recording == recording
    with pytest.raises(rw.SceneError, match="recording"):
        rw.explain(tmp_path / "hand.wav")


def test_a_limited_file_says_so(tmp_path: Path) -> None:
    loud = rw.render({"output": {**OUTPUT, "full_scale": 0.5}})
    for name, subtype in KINDS[1:]:
        with pytest.warns(rw.RenderWarning, match="limiter reduced"):
            path = loud.save(tmp_path / name, subtype)
        with pytest.warns(rw.RenderWarning, match="limiter reduced"):
            assert len(rw.load(path).warnings) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert not rw.load(loud.save(tmp_path / "x.wav")).warnings


def test_frames_that_are_not_finite_are_refused_and_nothing_is_kept(tmp_path: Path) -> None:
    frames = np.zeros((9, 1), np.float32)
    frames[4] = np.nan
    for name in ("x.wav", "x.flac", "x.npy", "x.csv"):
        with pytest.raises(rw.InvalidRequest, match="frame 4"):
            Sound(frames, 8000, (1.0,), ("velocity",), {}).save(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_tables_and_xarray_have_si_values(tmp_path: Path) -> None:
    sound = rw.render(SCENES["two channels"])
    np.testing.assert_array_equal(np.load(sound.save(tmp_path / "x.npy")), np.asarray(sound))
    text = sound.save(tmp_path / "x.csv").read_text("ascii")
    assert text.startswith("time (s),velocity (m/s),displacement (m)\n")
    table = np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1)
    np.testing.assert_allclose(table, np.column_stack([sound.times, sound.values]), rtol=1e-8)
    found = sound.to_xarray()
    assert (found["displacement"].attrs["units"], found["time"].attrs["units"]) == ("m", "s")
    assert rw.Scene.from_json(found.attrs["scene"]) == sound.scene
    np.testing.assert_allclose(sound.rms, np.sqrt((sound.values**2).mean(axis=0)))


def test_a_series_has_one_scale() -> None:
    series = [rw.render({"output": OUTPUT}, scan={"load": load}) for load in (0.1, 1.0)]
    scale = rw.common_full_scale(series)
    same = [sound.with_full_scale(scale) for sound in series]
    assert max(np.abs(sound.frames).max() for sound in same) == pytest.approx(0.8)
    for before, after in zip(series, same, strict=True):
        np.testing.assert_allclose(after.values, before.values, rtol=1e-6, atol=1e-6 * before.peak[0])
    for wrong in ([], [same[0], rw.render(SCENES["two channels"])]):
        with pytest.raises(rw.InvalidRequest, match="same quantities"):
            rw.common_full_scale(wrong)
    for bad in (0.0, -1.0, np.nan, (1.0, 2.0)):
        with pytest.raises(rw.InvalidRequest, match="full_scale"):
            series[0].with_full_scale(bad)


def test_the_plan_is_made_when_it_is_read_and_a_sound_can_be_pickled(monkeypatch: pytest.MonkeyPatch) -> None:
    import synth.plan.plan as plan_module

    module: Any = plan_module
    made: list[object] = []
    true = module.response_document

    def counted(solved: Any) -> Any:
        made.append(solved)
        return true(solved)

    monkeypatch.setattr(module, "response_document", counted)
    sound = rw.render(SCENES["plain"])
    assert not made
    assert sound.plan is not None and sound.plan is sound.plan and len(made) == 1
    assert sound.plan.response["stiffness"] > 0.0 and len(repr(sound.plan)) < 300
    again = pickle.loads(pickle.dumps(sound))
    assert again.plan == sound.plan and again.scene == sound.scene


def test_a_notebook_shows_a_player_a_waveform_and_words(sound: Sound) -> None:
    page = sound._repr_html_()
    assert page.count("<svg") == len(sound.quantities) and page.count("<audio") == 1
    assert "Normalised for listening" in page and sound.units[0] in page
    assert sound.plot()._repr_png_().startswith(b"\x89PNG")


def test_warnings_are_given() -> None:
    with pytest.warns(rw.RenderWarning, match=r"scan\.load"):
        rw.render({"scan": {"load": 50.0}, "output": OUTPUT})


def test_an_import_is_kept_only_if_it_succeeds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIDGEWAVE_DATA_FOLDER", str(tmp_path / "data"))
    np.save(tmp_path / "cloth.npy", 1e-6 * np.sin(np.arange(300) / 9))
    before = len(rw.textures())
    with pytest.raises(rw.InvalidRequest):
        rw.import_texture(tmp_path / "cloth.npy", unit="furlong")
    done = rw.import_texture(tmp_path / "cloth.npy", unit="m", pixel="10 um", dry_run=True)
    assert not done["kept"] and len(rw.textures()) == before
    done = rw.import_texture(tmp_path / "cloth.npy", unit="m", pixel="10 um")
    assert done["kept"] and done["name"] in rw.textures()
    sound = rw.render("cloth", output=OUTPUT)
    assert rw.load(sound.save(tmp_path / "x.flac")).scene.texture.surface == done["address"]


def test_an_import_is_resampled_in_python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIDGEWAVE_DATA_FOLDER", str(tmp_path / "data"))
    path = tmp_path / "stylus.csv"
    path.write_text("X [um];Z [um]\n0;0\n1;2\n2.3;4.6\n4.1;8.2\n6;12\n")
    with pytest.raises(rw.InvalidRequest, match="resample"):
        rw.import_texture(path)
    assert rw.import_texture(path, resample="0.5 um")["report"]["points"] == [13]


def test_a_set_of_maps_is_imported_and_its_sound_file_says_what_is_synthetic(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RIDGEWAVE_DATA_FOLDER", str(tmp_path / "data"))
    heights = surface(0, side=32)
    files = {"wall_nor_gl.png": file_of(normals(heights, 3e-4, "up", 8), "png")}
    folder = made(Case(lambda _: files, True), heights, tmp_path)
    with pytest.raises(rw.InvalidRequest, match="width"):
        rw.import_texture(folder)
    done = rw.import_texture(folder, width="10 mm", hurst=0.6, shortest=2e-4)
    scene = {"finger": {"contact_length": "2 mm"}, "output": {**OUTPUT, "bandwidth": "200 Hz"}}
    sound = rw.render({**scene, "texture": {"kind": done["name"]}, "accuracy": {"tolerance": 0.03}})
    texture = rw.load(sound.save(tmp_path / "x.wav")).scene.texture
    values = {"synthetic_hurst": 0.6, "synthetic_shortest": 2e-4, "synthetic_seed": 0}
    assert values.items() <= texture.values().items()
    assert sound.plan is not None and sound.plan.simulated[0].name == "synthetic waves"
    words, slope = sound.plan.simulated[0].reason, done["report"]["synthetic"]["rms_slope"]
    assert "from 625 um, two pixels of its map, to 200 um are synthetic, not measured" in words
    assert f"rms slope is {slope:.3g} along each axis" in words and "Hurst exponent of 0.6 and the seed 0" in words


def test_a_data_folder_that_cannot_be_written_is_named_in_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setenv("RIDGEWAVE_DATA_FOLDER", str(tmp_path / "file" / "data"))
    np.save(tmp_path / "cloth.npy", 1e-6 * np.sin(np.arange(300) / 9))
    with pytest.raises(rw.CannotRender) as refused:
        rw.import_texture(tmp_path / "cloth.npy", unit="m", pixel="10 um")
    assert str(tmp_path / "file" / "data") in str(refused.value)


@pytest.mark.thorough
def test_a_newcomers_script_passes_strict_types(tmp_path: Path) -> None:
    script = tmp_path / "newcomer.py"
    script.write_text(
        textwrap.dedent("""
        import numpy as np

        import ridgewave as rw

        heights = 5e-6 * np.sin(np.arange(800) / 20)
        sound = rw.render({"texture": {"kind": "profile", "heights": heights, "spacing": "10 um"}})
        sound.plot().savefig("sound.png")
        again = rw.load(sound.save("sound.wav"))
        assert np.array_equal(again.values, sound.values) and again.scene == sound.scene
        speed: float = again.scene.scan.speed
        with rw.open_voice(again.scene) as voice:
            print(speed, voice.render(10).shape, again.peak, again.rms)
        for sentence in (*sound.warnings, *again.warnings):
            print(sentence)
        entries: dict[str, rw.CatalogueEntry | rw.StoredTexture] = rw.textures()
        print(rw.render(sound).with_full_scale("9 m/s^2").with_full_scale(again.peak).full_scale, len(entries))
        """),
        "utf-8",
    )
    root = str(Path(rw.__file__).resolve().parents[1])
    here = {"cwd": tmp_path, "env": {"PYTHONPATH": root, "MYPYPATH": root, "HOME": str(tmp_path)}}
    subprocess.run([sys.executable, script], check=True, capture_output=True, **here)  # type: ignore[call-overload]
    config = ["--config-file", f"{root}/pyproject.toml"]
    checked = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", *config, script], capture_output=True, text=True, **here
    )  # type: ignore[call-overload]
    assert checked.returncode == 0, checked.stdout + checked.stderr


def examples() -> list[object]:
    """Return the examples of the docstrings of what is public, and of the methods of a Sound."""
    named = [(name, getattr(rw, name)) for name in rw.__all__]
    named += [(f"Sound.{name}", value) for name, value in vars(Sound).items() if inspect.isfunction(value)]
    found: list[object] = []
    for name, value in named:
        text = inspect.getdoc(value) or ""
        if (inspect.isfunction(value) or value is Sound) and "Example:" in text:
            found.append(pytest.param(textwrap.dedent(text.partition("Example:")[2]).strip(), id=name))
    return found


@pytest.mark.parametrize("example", examples())
def test_an_example_of_a_docstring_runs(example: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    lines = [node.names[0].name for node in ast.walk(ast.parse(example)) if isinstance(node, ast.Import)]
    assert set(lines) <= {"ridgewave", "numpy"}
    exec(example, {"rw": rw, "__name__": "__main__"})
