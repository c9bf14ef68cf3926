"""A table's file is read back unchanged; incomplete, altered, huge or invalid files and other versions are refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from synth.errors import CannotRender
from synth.plan.scene_table import table_of_scene
from synth.response.table import ResponseTable
from synth.response.table_file import LARGEST_BYTES, METADATA, read_table, table_bytes, table_of_bytes
from synth.response.table_making import TableBounds
from synth.scene.scene import parse_scene

SMALL = TableBounds(harmonics=4, nbytes=40_000)


@pytest.fixture(scope="module")
def table() -> ResponseTable:
    return table_of_scene(parse_scene({}), SMALL)


def parts(content: bytes) -> tuple[dict[str, Any], bytes]:
    length = int.from_bytes(content[:8], "little")
    return json.loads(content[8 : 8 + length]), content[8 + length :]


def whole(document: dict[str, Any], body: bytes) -> bytes:
    text = json.dumps(document).encode()
    return len(text).to_bytes(8, "little") + text + body


def changed_header(content: bytes, **fields: Any) -> bytes:
    document, body = parts(content)
    header = json.loads(document[METADATA]["header"]) | fields
    document[METADATA]["header"] = json.dumps(header)
    return whole(document, body)


def test_a_table_is_read_back_as_it_was(table: ResponseTable, tmp_path: Path) -> None:
    (tmp_path / "one.safetensors").write_bytes(table_bytes(table))
    found = read_table(tmp_path / "one.safetensors")
    assert found.hash == table.hash
    np.testing.assert_array_equal(found.pool, table.pool)
    assert found.covered == table.covered
    assert table_bytes(found) == table_bytes(table)


def test_scenes_that_differ_in_what_no_table_holds_have_one_table(table: ResponseTable) -> None:
    other = {"scan": {"speed": 0.02, "load": 1.0}, "output": {"duration": 3, "quantity": "velocity"}}
    assert table_of_scene(parse_scene(other), SMALL).hash == table.hash
    assert table_of_scene(parse_scene({"texture": {"period": "0.7 mm"}}), SMALL).hash != table.hash


def test_a_cut_file_is_refused_wherever_it_ends(table: ResponseTable) -> None:
    content = table_bytes(table)
    for end in [0, 3, 8, 9, 200, 1500, len(content) // 2, len(content) - 4, len(content) - 1]:
        with pytest.raises(CannotRender, match="incomplete"):
            table_of_bytes(content[:end])
    with pytest.raises(CannotRender, match="incomplete or was altered"):
        table_of_bytes(content + b"\0")


def test_every_altered_byte_of_the_arrays_is_refused(table: ResponseTable) -> None:
    content = table_bytes(table)
    body = len(content) - len(parts(content)[1])
    for at in np.random.default_rng(1).integers(body, len(content), 20):
        altered = bytearray(content)
        altered[at] ^= 4
        with pytest.raises(CannotRender, match="altered"):
            table_of_bytes(bytes(altered))


@pytest.mark.parametrize(
    "fields",
    [{"period": 1e-3}, {"band": -1.0}, {"lift_load": 0.0}, {"harmonics": [4, 2]}, {"places": [2, 2, 2]}, {"scene": []},
     {"harmonics": None}, {"mean_law": [1.0]}, {"covered": [0.0, 1e9]}, {"filters": {}}],
)  # fmt: skip
def test_an_altered_header_is_refused(table: ResponseTable, fields: dict[str, Any]) -> None:
    with pytest.raises(CannotRender, match="altered"):
        table_of_bytes(changed_header(table_bytes(table), **fields))


def test_another_version_is_refused_by_its_number(table: ResponseTable) -> None:
    document, body = parts(table_bytes(table))
    document[METADATA]["ridgewave_table"] = "2"
    with pytest.raises(CannotRender, match="version 2"):
        table_of_bytes(whole(document, body))


def test_numbers_that_are_none_are_refused(table: ResponseTable) -> None:
    content = bytearray(table_bytes(table))
    content[-4:] = np.array([np.nan], "<f4").tobytes()
    with pytest.raises(CannotRender, match="altered"):
        table_of_bytes(bytes(content))


@pytest.mark.parametrize("text", [b"[]", b"{}", b'{"__metadata__": 3}', b"[" * 100_000, b"\xff"])
def test_what_is_no_table_is_refused(text: bytes) -> None:
    with pytest.raises(CannotRender, match="cannot be read"):
        table_of_bytes(len(text).to_bytes(8, "little") + text)


def test_a_huge_file_is_refused_unread(tmp_path: Path) -> None:
    with (tmp_path / "huge").open("wb") as file:
        file.truncate(LARGEST_BYTES + 1)
    with pytest.raises(CannotRender, match="bytes"):
        read_table(tmp_path / "huge")
