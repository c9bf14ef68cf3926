"""The catalogue: every entry is a scene, its numbers have sources, and computed numbers are computed rightly."""

from __future__ import annotations

import re
from typing import Any

import pytest

from synth.accuracy.costing import explain
from synth.effects.stick_slip import SURFACES
from synth.errors import SceneError
from synth.scene.catalogue import FOLDER, TRUST, CatalogueEntry, catalogue, catalogue_names, lookup
from synth.scene.quantity import Dimension, parse_quantity
from synth.scene.scene import parse_scene
from synth.surfaces import profile_of

ENTRIES = catalogue()
each_entry = pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
GRATINGS = [entry for entry in ENTRIES if entry.name.startswith("grating-")]
FELT_BY_FRICTION = [entry for entry in ENTRIES if "effects" in entry.everyday]
GRAINS = {
    "p40": 425, "p60": 269, "p80": 201, "p100": 162, "p120": 125, "p150": 100, "p180": 82, "p220": 68, "p240": 58.5,
    "p320": 46.2, "p400": 35.0, "p600": 25.8, "p800": 21.8, "p1000": 18.3,
}  # fmt: skip
"""um. Mean grain of the P grades: ISO 6344, as tables of the trade give it."""


def length(text: str) -> float:
    return parse_quantity(text, Dimension.LENGTH)


def values_of(name: str) -> dict[str, Any]:
    """Return the fields of a texture, in SI."""
    return parse_scene(name).texture.values()


NEEDED = {
    "sinusoid": {"period"},
    "harmonics": {"period", "amplitudes"},
    "dots": {"period", "row_distance", "dot_height", "dot_diameter", "dot_top"},
    "grating": {"period", "height", "duty"},
    "rough": {"period", "rms_height", "hurst", "longest", "shortest"},
    "rough_area": {"period", "rms_height", "hurst", "longest", "shortest"},
    "weave": {"period", "weave", "thread_height"},
}
"""The fields of a kind that an entry states itself, so that no default stands for a number without a source."""


def test_names_are_unique_and_of_words_and_sizes() -> None:
    names = [entry.name for entry in ENTRIES]
    assert len(names) >= 40
    assert len(set(names)) == len(names)
    assert tuple(names) == catalogue_names()
    assert all(re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", name) for name in names)


def test_every_file_of_the_folder_is_a_group() -> None:
    groups = list(dict.fromkeys(entry.group for entry in ENTRIES))
    assert len(groups) == len(list(FOLDER.glob("*.toml"))) >= 5


@each_entry
def test_an_entry_is_a_texture_and_a_scene_with_a_fingertip(entry: CatalogueEntry) -> None:
    assert entry.title
    assert set(entry.document) == {"texture"}
    assert set(entry.everyday) - {"effects"} == {"finger", "texture", "scan"}
    texture, everyday = parse_scene(entry.document).texture, parse_scene(entry.everyday)
    assert everyday.texture == texture
    assert everyday.finger.kind == "fingertip"
    assert parse_scene({"texture": {"kind": entry.name}}).texture == texture
    assert 0.01 <= everyday.scan.speed <= 0.16, "the speeds of Greenspon et al. 2019"
    assert 0.05 <= everyday.scan.load <= 1.8, "the useful loads of Fagiani & Barbieri 2016"
    assert (profile_of(everyday).rms[0] > 0.0) != (entry in FELT_BY_FRICTION)


@each_entry
def test_every_number_has_a_source_that_states_how_far_to_trust_it(entry: CatalogueEntry) -> None:
    numbers = {f"{section}.{field}" for section in ("texture", "scan") for field in entry.everyday[section]}
    for effect, fields in entry.everyday.get("effects", {}).items():
        numbers |= {f"effects.{effect}.{field}" for field in fields}
    assert set(entry.sources) == numbers - {"texture.kind"}
    assert set(entry.description()["numbers"]) == set(entry.sources)
    assert NEEDED[entry.document["texture"]["kind"]] <= set(entry.document["texture"])
    for source in entry.sources.values():
        trust = next((word for word in TRUST if source.split(":")[0] == word), None)
        assert trust is not None, source
        if trust == "read":
            assert re.search(r"\b(19|20)[0-9]{2}\b|ISO [0-9]|IASA|Skedung|Dinse|Cotton Incorporated", source), source


@pytest.mark.parametrize("entry", GRATINGS, ids=lambda entry: entry.name)
def test_the_name_of_a_grating_gives_its_period_and_height(entry: CatalogueEntry) -> None:
    found = re.fullmatch(r"grating-([0-9]+[um]m)-([0-9]+um)", entry.name)
    assert found is not None
    texture = parse_scene(entry.document).texture
    assert texture.kind == "sinusoid"
    assert texture.period == length(found[1])
    assert 2.0 * texture.amplitude == pytest.approx(length(found[2]), abs=0.5e-6)


def test_the_ten_gratings_are_kept_finest_first() -> None:
    periods = [parse_scene(entry.document).texture.period for entry in GRATINGS]
    assert len(periods) == 10
    assert periods == sorted(periods)


@pytest.mark.parametrize("grade", GRAINS)
def test_a_sandpaper_has_the_grain_of_its_grade(grade: str) -> None:
    grain = GRAINS[grade] * 1e-6
    texture = values_of(f"sandpaper-{grade}")
    assert texture["rms_height"] == pytest.approx(grain / 4.0, rel=5e-3)
    assert texture["longest"] == pytest.approx(16.0 * grain, rel=5e-3)
    assert texture["shortest"] == pytest.approx(max(grain, 60e-6))


def test_periods_from_threads_per_inch_are_computed_rightly() -> None:
    checked = 0
    for entry in ENTRIES:
        found = re.search(r"(?:(\d) x )?25\.4 mm / (\d+)", entry.sources["texture.period"])
        if found:
            checked += 1
            period = int(found[1] or 1) * 25.4e-3 / int(found[2])
            assert length(entry.document["texture"]["period"]) == pytest.approx(period, rel=5e-3), entry.name
    assert checked >= 12


def test_grades_of_roughness_are_those_of_iso_1302() -> None:
    names = ("ground-steel-n5", "ground-steel-n6", "ground-steel-n7", "milled-steel-n8")
    for name, ra in zip(names, (0.4e-6, 0.8e-6, 1.6e-6, 3.2e-6), strict=True):
        assert values_of(name)["rms_height"] == pytest.approx(1.25 * ra)


@pytest.mark.parametrize(("name", "pitch"), [("screw-thread-m3", 0.5e-3), ("screw-thread-m6", 1e-3)])
def test_a_screw_thread_has_flanks_of_30_degrees(name: str, pitch: float) -> None:
    texture = values_of(name)
    assert texture["period"] == pitch
    assert texture["height"] / texture["ramp"] == pytest.approx(3.0**0.5, rel=5e-3)
    assert texture["duty"] * pitch - texture["ramp"] == pytest.approx(pitch / 8.0, rel=5e-3), "the crest"


@pytest.mark.parametrize("entry", FELT_BY_FRICTION, ids=lambda entry: entry.name)
def test_a_surface_felt_by_its_friction_sticks_and_slips_in_its_everyday_scan(entry: CatalogueEntry) -> None:
    effects = parse_scene(entry.everyday).effects
    assert list(effects) == ["stick_slip"]
    settings = effects["stick_slip"]
    assert settings.friction == SURFACES[settings.surface], "the numbers of the entry are those of the effect"
    told = explain(entry.everyday).document()["response"]["motion"]
    assert told["frequency_hz"] > 10.0
    assert told["force_peak_to_peak"] > 0.1 * told["mean_force"]


def test_every_surface_of_the_effect_but_skin_is_felt_in_the_catalogue() -> None:
    felt = {entry.everyday["effects"]["stick_slip"]["surface"] for entry in FELT_BY_FRICTION}
    assert felt == set(SURFACES) - {"skin"}


@each_entry
def test_an_entry_is_found_by_its_name(entry: CatalogueEntry) -> None:
    assert lookup(entry.name) == entry


def test_the_default_texture_is_in_the_catalogue() -> None:
    assert parse_scene("grating-800um-40um") == parse_scene({})


@pytest.mark.parametrize("name", ["", "grating-1mm", "GRATING-1MM-31UM", "sinusoid", "../grating", "x" * 100_000])
def test_an_unknown_name_is_refused_and_the_nearest_is_named(name: str) -> None:
    with pytest.raises(SceneError) as refused:
        lookup(name)
    (fault,) = refused.value.faults
    assert any(known in fault.hint for known in catalogue_names())
    assert len(fault.allowed) < 100


def test_what_one_reader_changes_is_not_seen_by_another() -> None:
    lookup("grating-1mm-31um").document["texture"]["period"] = "9 mm"
    lookup("grating-1mm-31um").everyday["texture"]["period"] = "9 mm"
    for scene in (lookup("grating-1mm-31um").document, lookup("grating-1mm-31um").everyday):
        assert scene["texture"]["period"] == "1 mm"
