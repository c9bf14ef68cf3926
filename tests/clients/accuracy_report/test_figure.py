"""The accuracy figure: axes, families, legend, front, levels, zeros, and the same bytes every time."""

from __future__ import annotations

import itertools
import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from clients.accuracy_report.figure import LOOK, STYLES, draw, drawings, main
from clients.accuracy_report.method_series import FAMILIES, ROUNDING, cost_of, felt_error, front_of, series_of
from synth.scene.scene import parse_scene, scene_document
from tests.accuracy_case import CHOSEN, document


@pytest.fixture(scope="module")
def figure() -> Iterator[Figure]:
    with matplotlib.rc_context(LOOK):
        yield draw(document())


@pytest.fixture(scope="module")
def files() -> dict[str, bytes]:
    return drawings(document())


def lines(figure: Figure, label: str) -> list[Line2D]:
    return [line for line in axes_of(figure).get_lines() if line.get_label() == label]


def points_of(line: Line2D) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in np.asarray(line.get_xydata()).reshape(-1, 2)]


def axes_of(figure: Figure) -> Axes:
    (axes,) = figure.axes
    return axes


def words(figure: Figure) -> str:
    legend = [text for legend in figure.legends for text in legend.get_texts()]
    return "\n".join(text.get_text() for text in (*figure.texts, *axes_of(figure).texts, *legend))


def test_both_axes_are_in_decades_and_say_their_units(figure: Figure) -> None:
    axes = axes_of(figure)
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")
    assert "computing time for a second of sound" in axes.get_xlabel()
    assert axes.get_ylabel() == "largest error of the acceleration (of its peak-to-peak)"
    figure.draw_without_rendering()
    assert {"1 ms", "1 s"} <= {label.get_text() for label in axes.get_xticklabels()}
    (top,) = axes.child_axes
    assert top.get_xlabel() == "times faster than real time"


def test_the_top_axis_counts_against_the_bottom_one(figure: Figure) -> None:
    figure.draw_without_rendering()
    axes = axes_of(figure)
    (top,) = axes.child_axes
    at_top = top.transData.transform((1000.0, 0.5))[0]
    assert at_top == pytest.approx(axes.transData.transform((1e-3, 1.0))[0])


def test_every_method_is_drawn_once_at_its_cost_and_error(figure: Figure) -> None:
    made = document()
    drawn = sorted(
        point
        for line in axes_of(figure).get_lines()
        if line.get_marker() in {marker for _, marker, _ in STYLES.values()} and line.get_markersize() < 10
        for point in points_of(line)
    )
    wanted = sorted((cost_of(made, row), row["max_error"]) for row in made["methods"] if row["max_error"])
    assert [value for pair in drawn for value in pair] == pytest.approx([value for pair in wanted for value in pair])


def test_every_family_has_a_colour_and_a_marker_of_its_own_and_its_name(figure: Figure) -> None:
    assert tuple(STYLES) == FAMILIES
    colours, markers, _ = zip(*STYLES.values(), strict=True)
    assert len(set(colours)) == len(set(markers)) == len(STYLES)
    shown = words(figure)
    assert all(series.name in shown for series in series_of(document()))
    framed, tabled = (lines(figure, f"trapezoid and brentq{kind}")[0] for kind in ("", ", tabled"))
    assert framed.get_linestyle() != tabled.get_linestyle()
    assert framed.get_markerfacecolor() != tabled.get_markerfacecolor()


def test_the_front_is_a_staircase_through_the_methods_on_it(figure: Figure) -> None:
    made = document()
    (front,) = lines(figure, "Pareto front")
    assert front.get_drawstyle() == "steps-post"
    assert [x for x, _ in points_of(front)] == [cost_of(made, row) for row in front_of(made)]


def test_the_plans_choice_is_ringed_and_named(figure: Figure) -> None:
    made = document()
    (row,) = (row for row in made["methods"] if row["method"] == CHOSEN)
    rings = [line for line in axes_of(figure).get_lines() if line.get_markersize() > 10]
    assert [points_of(ring) for ring in rings] == [[(cost_of(made, row), row["max_error"])]]
    assert CHOSEN in words(figure).replace("\n", " ")


def test_each_level_is_a_line_at_its_error(figure: Figure) -> None:
    shown = words(figure).replace("\n", " ")
    assert all(text in shown for text in ("tolerance 0.001", "float32 rounding", "not felt below", "real time"))
    drawn = [points_of(line) for line in axes_of(figure).get_lines()]
    across = {line[0][1] for line in drawn if [x for x, _ in line] == [0.0, 1.0]}
    assert across == {0.001, ROUNDING, felt_error(document())}
    assert [line[0][0] for line in drawn if [y for _, y in line] == [0.0, 1.0]] == [1.0]


def test_errors_of_zero_are_arrows_on_the_lower_edge_and_it_says_so(figure: Figure) -> None:
    edge = axes_of(figure).get_ylim()[0]
    arrows = sorted(point for line in lines(figure, "_zero") for point in points_of(line))
    free = [row for row in document()["methods"] if row["max_error"] == 0.0]
    assert arrows == sorted((cost_of(document(), row), edge) for row in free)
    assert "Arrows on the lower edge: no error" in words(figure)
    felt = document()
    felt["methods"] = [row for row in felt["methods"] if row["max_error"]]
    with matplotlib.rc_context(LOOK):
        assert "Arrows" not in words(draw(felt))


def test_the_title_names_scene_and_quantity(figure: Figure) -> None:
    shown = words(figure)
    assert "What accuracy costs: acceleration" in shown
    assert "λ₂ = 0.8 mm" in shown and "w = 300 mN; peak-to-peak 37.9 m/s²" in shown
    assert "Medians of 7 timings" in shown and "Nobody (1900)" in shown


@pytest.mark.parametrize(
    ("scan", "end"),
    [
        ({}, "L = 10 mm, u = 80 mm/s, w = 300 mN"),
        ({"stroke": {}}, "u = 80 mm/s, w = 300 mN, back and forth"),
        ({"trajectory": [[0.1 * step, 0.004 * step, 0.2] for step in range(5)]}, "L = 10 mm, recorded motion"),
    ],
)
def test_the_scene_is_a_line_whatever_its_scan(scan: dict[str, Any], end: str) -> None:
    made = document(scene=scene_document(parse_scene({"scan": scan})))
    with matplotlib.rc_context(LOOK):
        assert f"{end}; peak-to-peak" in words(draw(made))


def test_where_no_error_could_be_felt_it_says_so_without_a_line() -> None:
    made = document()
    made["methods"] = [row | {"threshold_margin_db": 400.0} for row in made["methods"]]
    with matplotlib.rc_context(LOOK):
        shown = words(draw(made))
    assert "even an error as large as the motion" in shown and "not felt below" not in shown


def test_no_labels_overlap(figure: Figure) -> None:
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    renderer = canvas.get_renderer()  # type: ignore[no-untyped-call]
    boxes = [(text.get_text(), Text.get_window_extent(text, renderer)) for text in axes_of(figure).texts]
    assert len(boxes) > 10
    for (one, box), (other, second) in itertools.combinations(boxes, 2):
        assert not box.overlaps(second), f"{one!r} lies on {other!r}"


@pytest.mark.parametrize(
    "changed",
    [
        lambda rows: [row | {"max_error": 0.0, "threshold_margin_db": None} for row in rows],
        lambda rows: rows[:1],
        lambda rows: [row | {"max_error": 1e-17, "setup_seconds": 1e4} for row in rows],
    ],
    ids=["no error at all", "one method", "round-off and hours"],
)
def test_odd_documents_are_drawn_too(changed: Any) -> None:
    made = document()
    made["methods"] = changed(made["methods"])
    with matplotlib.rc_context(LOOK):
        draw(made).draw_without_rendering()


def test_the_svg_holds_text_and_no_date(files: dict[str, bytes]) -> None:
    svg = files["accuracy.svg"].decode()
    assert svg.startswith("<?xml") and "<svg" in svg
    assert all(
        text in svg
        for text in (">real time<", ">trapezoid and brentq<", ">the plan's choice: sum of harmonics, 512 phases<")
    )
    assert "<dc:date>" not in svg


def test_the_png_has_300_dots_an_inch(files: dict[str, bytes]) -> None:
    png = files["accuracy.png"]
    assert png.startswith(b"\x89PNG")
    place = png.index(b"pHYs") + 4
    across, up, metres = struct.unpack(">IIB", png[place : place + 9])
    assert (across, up, metres) == (round(300 / 0.0254), round(300 / 0.0254), 1)


def test_it_is_drawn_again_from_the_json_alone_to_the_same_bytes(files: dict[str, bytes], tmp_path: Path) -> None:
    (tmp_path / "accuracy.json").write_text(json.dumps(document()))
    main(tmp_path)
    assert {name: (tmp_path / name).read_bytes() for name in files} == files
