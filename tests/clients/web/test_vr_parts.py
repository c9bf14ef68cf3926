"""Parts of the VR page without three.js: layout of swatches, magnification, contact of a fingertip."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from ridgewave import textures

if TYPE_CHECKING:
    from playwright.sync_api import Page

FOLLOW = """async (points) => {
  const {FingertipContact} = await import("/web/vr/contact_model.js");
  const {layTable} = await import("/web/vr/table_layout.js");
  const follower = new FingertipContact(layTable(1));
  return points.map((point) => follower.follow(point && {x: point[0], y: point[1], z: layTable(1).places[0].z}));
}"""

MAGNIFIED = "given.map((wave) => table.magnification({wave, height: 4e-5}))"


PLACES = """async (points) => {
  const {FingertipContact} = await import("/web/vr/contact_model.js");
  const {layTable} = await import("/web/vr/table_layout.js");
  const {x, z} = layTable(1).places[0];
  return points.map(([right, near]) => {
    const {position, y} = new FingertipContact(layTable(1)).follow({x: x + right, y: 0, z: z + near});
    return [position, y];
  });
}"""


def loads(functions: Page, *points: tuple[float, float] | None) -> list[float | None]:
    """Return the load (N) of a fingertip that goes through the points (x, y) over a single swatch, null beside it."""
    return [None if under is None else under["load"] for under in functions.evaluate(FOLLOW, points)]


def table(functions: Page, expression: str, argument: Any = None) -> Any:
    """Return what an expression of vr/table.js gives."""
    return functions.evaluate(
        f"async (given) => {{ const table = await import('/web/vr/table_layout.js'); return {expression}; }}", argument
    )


def test_depth_is_load_until_the_most(functions: Page) -> None:
    pressed = loads(functions, (0, 0.01), (0, -0.001), (0, -0.005), (0, -0.015), (0, -0.05), (0, 0.0))
    assert pressed == pytest.approx([0, 0.2, 1.0, 3.0, 3.0, 0])


def test_a_fingertip_that_did_not_come_from_above_touches_nothing(functions: Page) -> None:
    assert loads(functions, (0, -0.005)) == [None], "found inside the table"
    assert loads(functions, (0, 0.01), None, (0, -0.005)) == [0, None, None], "lost above, found inside"
    assert loads(functions, (0, 0.01), (0, -0.07), (0, -0.005)) == [0, None, None], "through the table and back up"
    assert loads(functions, (1, 0.01), (1, -0.005), (0, -0.005)) == [None, None, None], "from the side"
    assert loads(functions, (0, 0.01), (0, -0.005), (0.08, -0.005), (0, -0.005)) == pytest.approx([0, 1, None, 1])


def test_a_pose_that_is_no_number_touches_nothing(functions: Page) -> None:
    script = FOLLOW.replace("follower.follow(point", "follower.follow(point && {x: NaN, y: -0.01, z: 0}, point")
    assert functions.evaluate(script, [[0, 0.01], [0, -0.01]]) == [None, None]


def test_a_place_on_a_swatch_is_metres_from_its_left_end_and_from_its_middle(functions: Page) -> None:
    length = table(functions, "table.LENGTH")
    assert functions.evaluate(PLACES, [[0.01, 0.02], [-0.03, -0.01]]) == [
        pytest.approx([length / 2 + 0.01, -0.02]),
        pytest.approx([length / 2 - 0.03, 0.01]),
    ], "y is 0 in the middle, and rises away from the person"
    ends = functions.evaluate(FOLLOW, [[-length / 2, 0.01], [0, 0.01], [length / 2, 0.01], [length / 2 + 1e-6, 0.01]])
    assert [end and end["position"] for end in ends] == [pytest.approx(0), length / 2, pytest.approx(length), None]


def test_a_finger_points_counter_clockwise_from_the_stroke_seen_from_above(functions: Page) -> None:
    found = functions.evaluate(
        """async (points) => {
          const {directionOf} = await import("/web/vr/tracked_fingertips.js");
          return points.map(([x, z]) => directionOf({x: 1, z: 2}, {x: 1 + x, z: 2 + z}) ?? null);
        }""",
        [[0.1, 0.1], [1, 0], [0, -1], [-1, 0], [0, 1], [0.5, -0.5]],
    )
    assert found == [
        None,  # upright
        pytest.approx(0),
        pytest.approx(math.pi / 2),  # away from the person
        pytest.approx(math.pi),
        pytest.approx(-math.pi / 2),
        pytest.approx(math.pi / 4),
    ]


def test_a_fingertip_that_goes_right_is_further_right_on_the_surface_as_on_the_pad(functions: Page) -> None:
    sent = functions.evaluate(
        """async () => {
          const {FingertipStream} = await import("/web/vr/fingertip_stream.js");
          const sent = [], move = (contact) => sent.push(contact);
          const finger = Object.assign(new EventTarget(), {move, close() {}});
          const stream = new FingertipStream({swatches: [{scene: {}}], open: async () => finger});
          stream.follow({index: 0, position: 0.01, load: 0, height: 0.01}, 0);
          await new Promise((done) => setTimeout(done));
          const touch = (step, turn) =>
            stream.follow({index: 0, position: 0.01 * step, y: 0.002, load: 0.5, height: 0}, step, turn);
          touch(1);
          touch(2, 1.5);
          return sent;
        }"""
    )
    assert sent == [
        {"x": 0.01, "y": 0.002, "load": 0.5, "time": 1},
        {"x": 0.02, "y": 0.002, "direction": 1.5, "load": 0.5, "time": 2},
    ]


def test_the_opening_of_a_stream_ends_when_the_fingertip_goes_to_another_swatch(functions: Page) -> None:
    report = functions.evaluate(
        """async () => {
          const {FingertipStream} = await import("/web/vr/fingertip_stream.js");
          const opened = [], problems = [], ended = [];
          const open = ({name}, signal) => new Promise((done, fail) => {
            opened.push(name);
            signal.addEventListener("abort", () => (ended.push(name), fail(new Error("ended"))));
            if (name === "far") done(Object.assign(new EventTarget(), {name, move() {}, close() {}}));
          });
          const swatches = [{scene: {name: "near"}}, {scene: {name: "far"}}];
          const stream = new FingertipStream({swatches, open, onProblem: (error) => problems.push(error.message)});
          for (const index of [0, 1, 1]) {
            stream.follow({index, position: 0, load: 0, height: 0.01}, 0);
            await new Promise((done) => setTimeout(done));
          }
          const {name} = stream.finger;
          stream.close();
          return {opened, ended, problems, name};
        }"""
    )
    assert report == {"opened": ["near", "far"], "ended": ["near"], "problems": [], "name": "far"}


@pytest.mark.parametrize("count", [1, 5, 12])
def test_swatches_and_labels_lie_apart_on_the_board(functions: Page, count: int) -> None:
    layout, length, width, label = table(
        functions, "[table.layTable(given), table.LENGTH, table.WIDTH, table.LABEL]", count
    )
    places = layout["places"]
    assert len(places) == count
    for index, one in enumerate(places):
        assert abs(one["x"]) + length / 2 < layout["width"] / 2
        assert one["z"] - width / 2 > -layout["depth"] / 2 and one["z"] + width / 2 + label < layout["depth"] / 2
        for other in places[index + 1 :]:
            assert abs(one["x"] - other["x"]) > length or abs(one["z"] - other["z"]) > width + label


def test_the_swatches_kept_are_of_every_group_and_spread_over_it(functions: Page) -> None:
    sizes = {"wood": 8, "glass": 1, "metal": 20, "paper": 2}
    entries = [{"name": f"{group} {number}", "group": group} for group, size in sizes.items() for number in range(size)]
    kept = [entry["name"] for entry in table(functions, "table.chooseSwatches(given, 9)", entries)]
    assert kept == ["wood 1", "wood 4", "wood 6", "glass 0", "metal 3", "metal 10", "metal 16", "paper 0", "paper 1"]
    assert table(functions, "table.chooseSwatches(given, 12)", entries[:3]) == entries[:3]
    catalogue = [{"name": entry.name, "group": entry.group} for entry in textures().values()]
    shown = table(functions, "table.chooseSwatches(given)", catalogue)
    assert {entry["group"] for entry in shown} == {entry["group"] for entry in catalogue}
    assert len(shown) == len({entry["name"] for entry in shown}) == 12


def test_finer_textures_are_drawn_finer_and_the_label_says_how_much(functions: Page) -> None:
    periods = [0.1e-3, 0.2e-3, 0.25e-3, 0.4e-3, 0.5e-3, 0.8e-3, 1e-3, 2e-3, 5e-3, 20e-3]
    along = [entry["along"] for entry in table(functions, MAGNIFIED, periods)]
    drawn = [times * period for times, period in zip(along, periods, strict=True)]
    assert drawn == sorted(set(drawn)) and along[-1] == 1
    lines = table(functions, "table.labelLines({title: 'A: b', wave: 8e-4, rough: false, height: 4e-5})")
    assert lines == ["A", "period 800 µm, height 40 µm", f"drawn {along[5]} × as wide, {3 * along[5]} × as high"]


def test_a_tall_surface_is_drawn_no_deeper_than_the_board(functions: Page) -> None:
    tall = table(functions, "table.magnification({wave: 1e-3, height: 1.5e-3})")
    assert tall == {"along": 6, "up": 5} and tall["up"] * 1.5e-3 < table(functions, "table.RAISED")


def test_the_newest_imported_textures_get_a_row(functions: Page) -> None:
    entries = [{"name": f"{day}", "stored": day > 1, "created": f"2026-01-0{day}T00:00:00Z"} for day in range(8)]
    kept = table(functions, "table.chooseOwn(given)", entries)
    assert [entry["name"] for entry in kept] == ["7", "6", "5", "4"]


def test_the_relief_is_the_heights_magnified_with_normals_across_them(functions: Page) -> None:
    mesh = functions.evaluate(
        """async () => {
          const {relief} = await import("/web/vr/relief.js");
          const heights = Array.from({length: 64}, (_, i) => 2e-5 * Math.cos(2 * Math.PI * i / 64));
          const surface = {heights, period: 1e-3, along: 5, up: 15, length: 0.02, width: 0.01, raised: 0.008};
          const {positions, normals, indices} = relief(surface);
          return {positions: [...positions], normals: [...normals], indices: [...indices]};
        }"""
    )
    points = [mesh["positions"][place : place + 3] for place in range(0, len(mesh["positions"]), 3)]
    tops = points[0::6]
    assert max(y for _, y, _ in tops) == pytest.approx(0, abs=1e-7), "the crest lies in the plane of the touch"
    assert min(y for _, y, _ in tops) == pytest.approx(-15 * 4e-5, rel=1e-2)
    assert all(abs(x) <= 0.01 + 1e-6 and abs(z) <= 0.005 + 1e-6 for x, _, z in points)
    crests = sum(before[1] < here[1] >= after[1] for before, here, after in zip(tops, tops[1:], tops[2:], strict=False))
    assert crests == 3, "four periods of 5 mm: three crests between the ends"
    outward_faces(mesh, points)


def outward_faces(mesh: dict[str, list[float]], points: list[list[float]]) -> None:
    """Check that every face of the mesh is seen from outside."""
    for corners in zip(*[iter(mesh["indices"])] * 3, strict=True):
        one, two, three = (points[int(corner)] for corner in corners)
        edge, other = ([b - a for a, b in zip(one, end, strict=True)] for end in (two, three))
        faces = [edge[1] * other[2] - edge[2] * other[1], edge[2] * other[0] - edge[0] * other[2], 0.0]
        faces[2] = edge[0] * other[1] - edge[1] * other[0]
        normal = mesh["normals"][3 * int(corners[0]) : 3 * int(corners[0]) + 3]
        outward = sum(a * b for a, b in zip(faces, normal, strict=True))
        assert outward > 0 or one[0] == two[0] == three[0], "every face is seen from outside"


def test_the_relief_of_an_area_is_its_heights_at_their_places(functions: Page) -> None:
    """Waves of 1 mm along and 2 mm across, drawn 5 times as wide and 15 times as high, y = 0 in the middle."""
    mesh = functions.evaluate(
        """async () => {
          const {areaRelief} = await import("/web/vr/area_relief.js");
          const turn = (i) => 2 * Math.PI * i / 64;
          const row = (i) => Array.from({length: 64}, (_, j) => 2e-5 * Math.cos(turn(j)) + 1e-5 * Math.sin(turn(i)));
          const area = Array.from({length: 64}, (_, i) => row(i));
          const size = {along: 5, up: 15, length: 0.02, width: 0.01, raised: 0.008};
          const {positions, normals, indices} = areaRelief({area, period: 1e-3, across: 2e-3, ...size});
          return {positions: [...positions], normals: [...normals], indices: [...indices]};
        }"""
    )
    points = [mesh["positions"][place : place + 3] for place in range(0, len(mesh["positions"]), 3)]
    assert {(round(abs(x), 6), round(abs(z), 6)) for x, _, z in points} >= {(0.01, 0.005)}
    assert all(abs(x) <= 0.01 + 1e-6 and abs(z) <= 0.005 + 1e-6 for x, _, z in points)
    tops = [(point, mesh["normals"][3 * i : 3 * i + 3]) for i, point in enumerate(points)]
    tops = [(point, normal) for point, normal in tops if normal[1] > 0]
    for (x, y, z), (nx, ny, nz) in tops:
        along, across = 2 * math.pi * (x + 0.01) / 5e-3, 2 * math.pi * -z / 10e-3
        height = 2e-5 * math.cos(along) + 1e-5 * math.sin(across)
        assert y == pytest.approx(15 * (height - 3e-5), abs=15 * 4e-7)
        slopes = -2e-5 * math.sin(along) * 2 * math.pi / 5e-3, -1e-5 * math.cos(across) * 2 * math.pi / 10e-3
        assert -nx / ny == pytest.approx(15 * slopes[0], abs=0.03)
        assert -nz / ny == pytest.approx(15 * slopes[1], abs=0.03)
    assert max(y for (_, y, _), _ in tops) == pytest.approx(0, abs=6e-6), "the crest lies in the plane of the touch"
    assert [y for _, y, _ in points if y < -15 * 6e-5 - 1e-5] == pytest.approx(
        [-0.008] * ((len(points) - len(tops)) // 2)
    )
    outward_faces(mesh, points)


@pytest.mark.parametrize("most", [4, 2])
def test_imported_textures_lie_in_rows_of_their_own_in_front(functions: Page, most: int) -> None:
    places = table(functions, f"table.layTable(given, 3, {most}).places", 12)
    listed, own = places[:-3], places[-3:]
    assert max(place["z"] for place in listed) < min(place["z"] for place in own)
