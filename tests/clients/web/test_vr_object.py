"""The user's own object on the table: a GLB file whose parts are touched as their materials are named."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.clients.web.browser import headless
from tests.clients.web.headset import at_the_table, three_folder

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Playwright

    from tests.service.harness import Running

TEXTURE = "grating-800um-40um"
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32)
SIDES = ("013", "032", "467", "475", "045", "051", "237", "276", "026", "064", "157", "173")
FACES = np.array([[int(corner) for corner in side] for side in SIDES], np.uint16)


def glb(materials: dict[str, list[float]], **changes: Any) -> bytes:
    """Return a GLB file with a box for each material, of a size in m, side by side along x."""
    binary = CORNERS.tobytes() + FACES.tobytes()
    nodes, left = [], 0.0
    for index, size in enumerate(materials.values()):
        nodes.append({"mesh": index, "translation": [left, 0, 0], "scale": size})
        left += size[0]
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "materials": [{"name": name, "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}} for name in materials],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": index}]}
            for index in range(len(materials))
        ],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": CORNERS.nbytes},
            {"buffer": 0, "byteOffset": CORNERS.nbytes, "byteLength": FACES.nbytes},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": len(CORNERS)},
            {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": FACES.size},
        ],
    } | changes
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


@pytest.fixture(scope="module")
def table(playwright: Playwright, service: Running, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    three = three_folder(tmp_path_factory.mktemp("three"))
    browser: Browser
    with headless(playwright, webgl=True) as browser, at_the_table(browser, service.url, three) as (page, _):
        yield page


def give(page: Page, content: bytes, told: str) -> None:
    """Choose a file with `content`; return once the page has told `told`."""
    page.set_input_files("#object", {"name": "key.glb", "mimeType": "model/gltf-binary", "buffer": content})
    page.wait_for_function("(told) => document.querySelector('#status').textContent.includes(told)", arg=told)


BAD = {
    "no glTF": (b"solid stl", "no glTF file"),
    "cut off": (glb({TEXTURE: [0.05, 0.01, 0.04]})[:-40], "cut off"),
    "another version": (glb({TEXTURE: [0.05, 0.01, 0.04]}, asset={"version": "1.0"}), "glTF 1.0"),
    "compressed": (glb({TEXTURE: [0.05, 0.01, 0.04]}, extensionsRequired=["KHR_draco"]), "KHR_draco"),
    "no known name": (glb({"brass": [0.05, 0.01, 0.04]}), 'it has "brass"'),
    "too large": (glb({TEXTURE: [5.0, 0.01, 0.04]}), "at most 0.5 m"),
    "too small": (glb({TEXTURE: [0.05, 0.01, 0.001]}), "at least 5 mm"),
    "numbers missing": (glb({TEXTURE: [0.05, 0.01, 0.04]}, accessors=[]), "of a kind that is not read"),
    "no triangles": (glb({TEXTURE: [0.05, 0.01, 0.04]}, meshes=[]), "no triangles"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_file_that_cannot_be_touched_is_refused_with_what_to_do(table: Page, case: str) -> None:
    before = table.evaluate("() => [ridgewave.room.swatches.length, ridgewave.room.table.children.length]")
    give(table, *BAD[case])
    assert table.evaluate("() => [ridgewave.room.swatches.length, ridgewave.room.table.children.length]") == before


def test_a_part_is_touched_with_the_texture_that_its_material_is_named_after(table: Page, service: Running) -> None:
    count = table.locator("#list button").count()
    give(table, glb({TEXTURE: [0.06, 0.01, 0.04], "brass": [0.02, 0.01, 0.04]}), "key.glb: 1 part can be touched")
    place = table.evaluate("() => ridgewave.room.layout.places.at(-1)")
    assert (place["length"], place["width"]) == pytest.approx((0.06, 0.04), abs=1e-6)
    tops = table.evaluate(
        """() => ridgewave.room.table.children.slice(-2).map((mesh) => {
             mesh.geometry.computeBoundingBox(); return mesh.geometry.boundingBox.max.y; })"""
    )
    assert tops == pytest.approx([0, 0], abs=1e-6), "in the plane of the swatches"
    button = table.locator("#list button").last
    assert table.locator("#list button").count() == count + 1 and f"as {TEXTURE}" in button.inner_text()
    button.focus()
    for key in ("ArrowUp", "ArrowDown"):
        table.keyboard.press(key)
    table.wait_for_function("() => ridgewave.fingers.size === 1 && [...ridgewave.fingers][0].source")
    table.evaluate("() => { window.heard = tools.listen(); }")
    for step in range(200):
        key = ("ArrowRight", "ArrowLeft")[step % 2]
        table.keyboard.down(key)
        table.wait_for_function("(index) => ridgewave.touches[0]?.index === index", arg=count)
        table.wait_for_function("() => ridgewave.touches.length === 0 || heard.peak > 0")
        table.keyboard.up(key)
        if table.evaluate("() => heard.peak") > 0:
            break
    assert table.evaluate("() => heard.peak") > 0
    listed = {entry["name"]: entry for entry in service.client.get("/v1/textures").json()["textures"]}
    scene = table.evaluate("() => [...ridgewave.fingers][0].scene.held")
    assert scene["texture"] == listed[TEXTURE]["scene"]["texture"]
