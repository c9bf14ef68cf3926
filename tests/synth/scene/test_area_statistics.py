"""The areas of the catalogue have the heights, the correlation and the periods that their numbers state."""

from __future__ import annotations

import pytest

from docs.figures.area_statistics import KINDS, areas, expected_correlation, expected_slope, measured
from synth.scene.catalogue import CatalogueEntry, catalogue
from synth.scene.scene import parse_scene
from synth.surfaces import profile_of
from synth.surfaces.height_field import HeightField


def test_every_entry_that_varies_across_is_an_area() -> None:
    for kind, entry in {entry.document["texture"]["kind"]: entry for entry in catalogue()}.items():
        assert profile_of(parse_scene(entry.document)).of_area == (kind in KINDS)


@pytest.mark.parametrize("entry", areas(), ids=lambda entry: entry.name)
def test_an_area_has_the_statistics_of_its_numbers(entry: CatalogueEntry) -> None:
    texture, field = parse_scene(entry.document).texture.values(), profile_of(parse_scene(entry.document))
    assert isinstance(field, HeightField)
    found = measured(field)
    assert found.periods == pytest.approx((field.period, field.across))
    assert field.period == pytest.approx(texture["period"])
    if field.kind == "rough_area":
        band = texture["hurst"], texture["longest"], texture["shortest"]
        few = texture["longest"] / field.period  # with few long waves, a sum over waves is far from an integral
        assert found.rq == pytest.approx(texture["rms_height"], rel=1e-9)
        slope, length = expected_slope(texture["rms_height"], *band), expected_correlation(*band)
        assert found.slopes == pytest.approx((slope, slope), rel=0.01 + 0.15 * few)
        assert found.correlation == pytest.approx((length, length), rel=0.04 + 0.3 * few)
    else:
        height = texture["thread_height"] if field.kind == "weave" else abs(texture["dot_height"])
        assert found.height == pytest.approx(height, rel=2e-3)
