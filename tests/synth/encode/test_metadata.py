"""What a file says about itself comes back exactly."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.encode.formats import Metadata, SoundFormat, encode_all, stream_header
from synth.encode.sound_metadata import UNITS
from synth.errors import CannotRender, InvalidRequest
from tests.file_metadata import read_metadata

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


def test_the_generator_is_named_with_its_version() -> None:
    metadata = Metadata((1.0,), ("velocity",), {})
    assert metadata.generator.startswith("ridgewave ")
    read = read_metadata(encode_all(SILENCE, SoundFormat.FLAC, 48000, dataclasses.replace(metadata, generator="x 9")))
    assert read is not None and read.generator == "x 9"


@pytest.mark.parametrize("sound_format", list(SoundFormat))
def test_no_metadata_is_none(sound_format: SoundFormat) -> None:
    assert read_metadata(encode_all(SILENCE, sound_format, 48000)) is None


def test_nan_in_the_scene_is_our_bug() -> None:
    with pytest.raises(ValueError, match="JSON"):
        encode_all(SILENCE, SoundFormat.WAV, 48000, Metadata((1.0,), ("velocity",), {"a": float("nan")}))


def test_flac_takes_eight_channels_and_16_megabytes() -> None:
    assert encode_all(np.zeros((1, 8), dtype=np.float32), SoundFormat.FLAC, 48000)
    with pytest.raises(InvalidRequest, match="9 channels"):
        encode_all(np.zeros((1, 9), dtype=np.float32), SoundFormat.FLAC, 48000)
    with pytest.raises(CannotRender, match="16 MB"):
        encode_all(SILENCE, SoundFormat.FLAC, 48000, Metadata((1.0,), ("velocity",), {"a": "x" * 2**24}))
