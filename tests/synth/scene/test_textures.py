"""The catalogue: every entry has the dimensions in its name, and a source."""

from __future__ import annotations

import re

import pytest

from synth.errors import SceneError
from synth.scene.catalogue import CatalogueEntry, catalogue, catalogue_names, lookup
from synth.scene.quantity import Dimension, parse_quantity
from synth.scene.scene import parse_scene

each_entry = pytest.mark.parametrize("entry", catalogue(), ids=lambda entry: entry.name)


def test_there_are_ten_gratings_finest_first_each_under_its_own_name() -> None:
    names = [entry.name for entry in catalogue()]
    assert len(set(names)) == 10
    assert tuple(names) == catalogue_names()
    periods = [parse_scene(name).texture.period for name in names]
    assert periods == sorted(periods)


@each_entry
def test_a_name_gives_the_period_and_the_height(entry: CatalogueEntry) -> None:
    found = re.fullmatch(r"grating-([0-9]+[um]m)-([0-9]+um)", entry.name)
    assert found is not None
    texture = parse_scene(entry.document).texture
    assert texture.period == parse_quantity(found[1], Dimension.LENGTH)
    height = parse_quantity(found[2], Dimension.LENGTH)
    assert 2.0 * texture.amplitude == pytest.approx(height, abs=0.5e-6)


@each_entry
def test_an_entry_is_a_texture_alone_with_a_title_and_a_source(entry: CatalogueEntry) -> None:
    assert set(entry.document) == {"texture"}
    assert entry.document["texture"]["kind"] == "sinusoid"
    assert entry.title
    believed = re.search(r"\(PMC[0-9]+\)|\(doi |computed, not measured", entry.source)
    assert believed or entry.source.startswith("chosen for this catalogue to cover")
    assert "chosen" in entry.source or "computed" in entry.source, "no height here was measured, and the source says so"


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
    assert all(known in fault.allowed for known in catalogue_names())


def test_what_one_reader_changes_is_not_seen_by_another() -> None:
    lookup("grating-1mm-31um").document["texture"]["period"] = "9 mm"
    assert lookup("grating-1mm-31um").document["texture"]["period"] == "1 mm"
