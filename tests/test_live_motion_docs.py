"""docs/live-motion.md cannot drift: its tables are those that are measured, its numbers those of the code."""

from __future__ import annotations

from pathlib import Path

import pytest

from synth.motion.update_smoothing import DELAY, LOAD_DECAY

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "live-motion.md").read_text("utf-8")


def numbers(name: str) -> list[list[float]]:
    """Return the numbers of each line of the page's tables that is named `name`."""
    lines = [line.strip().strip("|").split("|") for line in PAGE.splitlines() if line.startswith(f"| {name} |")]
    return [[float(cell) for cell in cells[1:]] for cells in lines]


def test_the_chosen_way_has_the_figures_of_the_page() -> None:
    pytest.importorskip("matplotlib", reason="figures need the extra `plots`: pip install '.[plots]'")
    from docs.figures.following import row
    from docs.figures.following_measures import Network, chosen, figures

    for hz in (30, 125):
        found = row(f"{hz} Hz", figures(chosen, Network(hz)))
        measured = [float(cell) for cell in found.strip("|").split("|")[1:]]
        (shown,) = numbers(f"{hz} Hz")
        assert measured == pytest.approx(shown, rel=0.02, abs=0.11)


def test_another_way_has_the_figures_of_the_page() -> None:
    """These ways called kernels that Python cannot call: the command of the page ended with a segmentation fault."""
    pytest.importorskip("matplotlib", reason="figures need the extra `plots`: pip install '.[plots]'")
    from docs.figures.following import row
    from docs.figures.following_measures import WAYS, Network, figures

    name = "line 20 ms late"
    found = row(name, figures(WAYS[name], Network(125)))
    (shown,) = numbers(name)
    assert [float(cell) for cell in found.strip("|").split("|")[1:]] == pytest.approx(shown, rel=0.02, abs=0.11)


def test_every_trouble_way_and_rate_has_its_line() -> None:
    pytest.importorskip("matplotlib", reason="figures need the extra `plots`: pip install '.[plots]'")
    from docs.figures.following import DECAYS, RATES
    from docs.figures.following_measures import TROUBLES, WAYS

    for name in (*WAYS, *TROUBLES, *(f"{hz} Hz" for hz in RATES)):
        assert len(numbers(name)) == 1, name
    assert all(len(numbers(f"{decay}, {hz} Hz")) == 1 for decay in DECAYS for hz in (30, 125))


def test_the_page_names_the_delays_of_the_code() -> None:
    assert f"**{1e3 * DELAY:.0f} ms late**" in PAGE
    assert f"**{3e3 / LOAD_DECAY:.0f} ms late**" in PAGE
