"""What a file says about itself comes back exactly."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.encode.formats import Metadata, SoundFormat, encode_all, read_metadata, stream_header
from synth.encode.sound_metadata import UNITS, parse_metadata
from synth.errors import CannotRender, InvalidRequest

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=20,
)
METADATAS = st.lists(
    st.tuples(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(sorted(UNITS))), min_size=1, max_size=4
).flatmap(
    lambda channels: st.builds(
        Metadata,
        st.just(tuple(full_scale for full_scale, _ in channels)),
        st.just(tuple(quantity for _, quantity in channels)),
        st.dictionaries(st.text(), JSON, max_size=5),
    )
)
SILENCE = np.zeros((2, 1), dtype=np.float32)


@settings(max_examples=60, deadline=None)
@given(METADATAS, st.sampled_from([kind for kind in SoundFormat if kind.container != "raw"]))
def test_metadata_round_trips_exactly(metadata: Metadata, sound_format: SoundFormat) -> None:
    block = np.zeros((2, len(metadata.full_scale)), dtype=np.float32)
    assert read_metadata(encode_all(block, sound_format, 48000, metadata)) == metadata


def test_an_endless_stream_says_it_too() -> None:
    metadata = Metadata((1.0,), ("velocity",), {"scan": {"load": 0.1}})
    assert read_metadata(stream_header(SoundFormat.WAV16, 48000, 1, metadata)) == metadata


@pytest.mark.parametrize("output", [{}, {"output": None}, {"output": {"bandwidth": None}}])
def test_a_file_from_before_versions_tells_the_full_band_that_it_has(output: dict[str, Any]) -> None:
    scene = {"scan": {"load": 0.1}} | output
    now = Metadata((1.0,), ("velocity",), scene)
    told = json.loads(now.text())
    assert told.pop("version") == 2
    assert parse_metadata(now.text()) == now
    before = parse_metadata(json.dumps(told).encode())
    assert before is not None and before.scene == {"scan": {"load": 0.1}, "output": {"bandwidth": "full"}}
    named = told | {"scene": {"output": {"bandwidth": 200.0}}}
    read = parse_metadata(json.dumps(named).encode())
    assert read is not None and read.scene == named["scene"]


def test_the_generator_is_named_with_its_version() -> None:
    metadata = Metadata((1.0,), ("velocity",), {})
    assert metadata.generator.startswith("ridgewave ")
    read = read_metadata(encode_all(SILENCE, SoundFormat.FLAC, 48000, dataclasses.replace(metadata, generator="x 9")))
    assert read is not None and read.generator == "x 9"


@pytest.mark.parametrize("sound_format", list(SoundFormat))
def test_no_metadata_is_none(sound_format: SoundFormat) -> None:
    assert read_metadata(encode_all(SILENCE, sound_format, 48000)) is None


@pytest.mark.parametrize("sound_format", [SoundFormat.WAV, SoundFormat.FLAC])
def test_a_file_cut_anywhere_is_none_or_whole(sound_format: SoundFormat) -> None:
    metadata = Metadata((1.0,), ("velocity",), {"scan": {"load": 0.1}})
    file = encode_all(SILENCE, sound_format, 48000, metadata)
    for length in range(len(file)):
        assert read_metadata(file[:length]) in (None, metadata)


@pytest.mark.parametrize("comment", [b"[]", b"{}", b"hello", b'{"channels":[1],"scene":{},"generator":"x"}'])
def test_the_comment_of_others_is_none(comment: bytes) -> None:
    entry = b"INFOICMT" + len(comment).to_bytes(4, "little") + comment + b"\0" * (len(comment) % 2)
    file = b"RIFF\xff\xff\xff\xffWAVELIST" + len(entry).to_bytes(4, "little") + entry + b"data\0\0\0\0"
    assert read_metadata(file) is None


def test_nan_in_the_scene_is_our_bug() -> None:
    with pytest.raises(ValueError, match="JSON"):
        encode_all(SILENCE, SoundFormat.WAV, 48000, Metadata((1.0,), ("velocity",), {"a": float("nan")}))


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(CannotRender, match=r"none\.wav"):
        read_metadata(tmp_path / "none.wav")


def test_flac_takes_eight_channels_and_16_megabytes() -> None:
    assert encode_all(np.zeros((1, 8), dtype=np.float32), SoundFormat.FLAC, 48000)
    with pytest.raises(InvalidRequest, match="9 channels"):
        encode_all(np.zeros((1, 9), dtype=np.float32), SoundFormat.FLAC, 48000)
    with pytest.raises(CannotRender, match="16 MB"):
        encode_all(SILENCE, SoundFormat.FLAC, 48000, Metadata((1.0,), ("velocity",), {"a": "x" * 2**24}))
