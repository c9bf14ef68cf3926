"""Every byte of each format for small sounds, the conversion of floats to integers, and the metadata read back."""

from __future__ import annotations

import dataclasses
import io
from decimal import ROUND_HALF_EVEN, Decimal

import numpy as np
import pytest
import soundfile
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.encode.formats import (
    Block,
    Metadata,
    SoundFormat,
    block_bytes,
    choose_format,
    encode_all,
    media_type,
    open_writer,
    quantise,
    stream_header,
)
from synth.errors import CannotRender, InvalidRequest
from tests.file_metadata import read_metadata

METADATA = Metadata((2.5,), ("acceleration",), {"a": 1}, generator="ridgewave 0.1.0")
COMMENT = (
    b'{"version":2,"generator":"ridgewave 0.1.0",'
    b'"channels":[{"quantity":"acceleration","full_scale":2.5,"unit":"m/s^2"}],"scene":{"a":1}}'
)
LIST = (
    b"LIST\xaa\x00\x00\x00INFO"
    b"ISFT\x10\x00\x00\x00ridgewave 0.1.0\x00"
    b"ICMT\x85\x00\x00\x00" + COMMENT + b"\x00\x00"  # 133 bytes with the terminator, and one byte of padding
)
JUNK = b"JUNK\x1c\x00\x00\x00" + bytes(28)
FLOAT_SAMPLES = b"\x00\x00\x00\x3f\x00\x00\x80\xbf\x00\x00\x00\x40"  # 0.5, -1, 2


def mono() -> Block:
    return np.array([[0.5], [-1.0], [2.0]], dtype=np.float32)


def three_channels() -> Block:
    return np.array([[0.0, 0.5, 1.0]], dtype=np.float32)


def test_float_wav() -> None:
    assert encode_all(mono(), SoundFormat.WAV, 48000) == (
        b"RIFF\x62\x00\x00\x00WAVE" + JUNK + b"fmt \x12\x00\x00\x00\x03\x00\x01\x00"
        b"\x80\xbb\x00\x00\x00\xee\x02\x00\x04\x00\x20\x00\x00\x00"
        b"fact\x04\x00\x00\x00\x03\x00\x00\x00"
        b"data\x0c\x00\x00\x00" + FLOAT_SAMPLES
    )


def test_float_wav_with_its_scene() -> None:
    assert encode_all(mono(), SoundFormat.WAV, 48000, METADATA) == (
        b"RIFF\x14\x01\x00\x00WAVE" + JUNK + b"fmt \x12\x00\x00\x00\x03\x00\x01\x00"
        b"\x80\xbb\x00\x00\x00\xee\x02\x00\x04\x00\x20\x00\x00\x00"
        b"fact\x04\x00\x00\x00\x03\x00\x00\x00" + LIST + b"data\x0c\x00\x00\x00" + FLOAT_SAMPLES
    )


def test_16_bit_wav() -> None:
    assert encode_all(mono(), SoundFormat.WAV16, 8000) == (
        b"RIFF\x4e\x00\x00\x00WAVE" + JUNK + b"fmt \x10\x00\x00\x00\x01\x00\x01\x00"
        b"\x40\x1f\x00\x00\x80\x3e\x00\x00\x02\x00\x10\x00"
        b"data\x06\x00\x00\x00\x00\x40\x00\x80\xff\x7f"
    )


def test_24_bit_wav_is_padded_to_an_even_byte() -> None:
    assert encode_all(mono(), SoundFormat.WAV24, 8000) == (
        b"RIFF\x52\x00\x00\x00WAVE" + JUNK + b"fmt \x10\x00\x00\x00\x01\x00\x01\x00"
        b"\x40\x1f\x00\x00\xc0\x5d\x00\x00\x03\x00\x18\x00"
        b"data\x09\x00\x00\x00\x00\x00\x40\x00\x00\x80\xff\xff\x7f\x00"
    )


def test_more_than_two_channels_are_extensible_without_loudspeakers() -> None:
    assert encode_all(three_channels(), SoundFormat.WAV16, 8000) == (
        b"RIFF\x72\x00\x00\x00WAVE" + JUNK + b"fmt \x28\x00\x00\x00\xfe\xff\x03\x00"
        b"\x40\x1f\x00\x00\x80\xbb\x00\x00\x06\x00\x10\x00"
        b"\x16\x00\x10\x00\x00\x00\x00\x00\x01\x00\x00\x00\x00\x00\x10\x00\x80\x00\x00\xaa\x00\x38\x9b\x71"
        b"fact\x04\x00\x00\x00\x01\x00\x00\x00"
        b"data\x06\x00\x00\x00\x00\x00\x00\x40\xff\x7f"
    )


def test_endless_wav_has_ones_in_both_sizes_and_the_count() -> None:
    assert stream_header(SoundFormat.WAV, 48000, 1, METADATA) == (
        b"RIFF\xff\xff\xff\xffWAVEfmt \x12\x00\x00\x00\x03\x00\x01\x00"
        b"\x80\xbb\x00\x00\x00\xee\x02\x00\x04\x00\x20\x00\x00\x00"
        b"fact\x04\x00\x00\x00\xff\xff\xff\xff" + LIST + b"data\xff\xff\xff\xff"
    )
    assert stream_header(SoundFormat.WAV16, 8000, 1) == (
        b"RIFF\xff\xff\xff\xffWAVEfmt \x10\x00\x00\x00\x01\x00\x01\x00"
        b"\x40\x1f\x00\x00\x80\x3e\x00\x00\x02\x00\x10\x00data\xff\xff\xff\xff"
    )


@pytest.mark.parametrize("channels", [1, 2, 3, 8])
@pytest.mark.parametrize("sound_format", [SoundFormat.WAV, SoundFormat.WAV16, SoundFormat.WAV24])
def test_every_format_code_but_1_has_the_number_of_frames(sound_format: SoundFormat, channels: int) -> None:
    block = np.zeros((41, channels), dtype=np.float32)
    late = io.BytesIO()  # the number of frames is known at the end
    with open_writer(late, sound_format, 48000, channels) as writer:
        writer.write(block)
    for made, frames in (
        (encode_all(block, sound_format, 48000, METADATA), 41),
        (late.getvalue(), 41),
        (stream_header(sound_format, 48000, channels, METADATA, 41), 41),
        (stream_header(sound_format, 48000, channels, METADATA), 0xFFFFFFFF),
    ):
        chunks = chunks_of(made)
        code = int.from_bytes(chunks[b"fmt "][:2], "little")
        assert chunks.get(b"fact") == (None if code == 1 else frames.to_bytes(4, "little"))


def chunks_of(wav: bytes) -> dict[bytes, bytes]:
    """Return the chunks of a WAV file before its samples."""
    found, at = {}, 12
    while wav[at : at + 4] != b"data":
        size = int.from_bytes(wav[at + 4 : at + 8], "little")
        found[wav[at : at + 4]] = wav[at + 8 : at + 8 + size]
        at += 8 + size + size % 2
    return found


@pytest.mark.parametrize(
    ("sound_format", "samples"),
    [
        (SoundFormat.WAV, FLOAT_SAMPLES),
        (SoundFormat.F32LE, FLOAT_SAMPLES),
        (SoundFormat.WAV16, b"\x00\x40\x00\x80\xff\x7f"),
        (SoundFormat.L16, b"\x40\x00\x80\x00\x7f\xff"),
        (SoundFormat.WAV24, b"\x00\x00\x40\x00\x00\x80\xff\xff\x7f"),
    ],
)
def test_a_block_of_a_stream(sound_format: SoundFormat, samples: bytes) -> None:
    assert block_bytes(mono(), sound_format) == samples


@pytest.mark.parametrize("sound_format", [one for one in SoundFormat if one is not SoundFormat.FLAC])
def test_a_block_has_the_bytes_of_its_samples(sound_format: SoundFormat) -> None:
    block = np.linspace(-1.0, 1.0, 21, dtype=np.float32).reshape(7, 3)
    assert len(block_bytes(block, sound_format)) == block.size * sound_format.bytes_per_sample


def test_channels_are_interleaved() -> None:
    block = np.array([[0.5, -0.5], [0.25, -0.25]], dtype=np.float32)
    assert block_bytes(block, SoundFormat.L16) == b"\x40\x00\xc0\x00\x20\x00\xe0\x00"
    assert block_bytes(np.asfortranarray(block), SoundFormat.L16) == b"\x40\x00\xc0\x00\x20\x00\xe0\x00"


@pytest.mark.parametrize("sound_format", [SoundFormat.L16, SoundFormat.F32LE])
def test_raw_formats_are_samples_and_nothing_else(sound_format: SoundFormat) -> None:
    assert stream_header(sound_format, 48000, 1, METADATA) == b""
    assert encode_all(mono(), sound_format, 48000, METADATA) == block_bytes(mono(), sound_format)


def test_flac_opens_as_flac_with_rate_channels_bits_and_length() -> None:
    header = encode_all(np.zeros((100, 2), dtype=np.float32), SoundFormat.FLAC, 48000)[:26]
    assert header[:8] == b"fLaC\x00\x00\x00\x22"
    fields = int.from_bytes(header[18:26], "big")
    assert (fields >> 44, (fields >> 41 & 7) + 1, (fields >> 36 & 31) + 1, fields & (1 << 36) - 1) == (
        48000,
        2,
        24,
        100,
    )


def test_flac_does_not_stream() -> None:
    with pytest.raises(InvalidRequest, match="wav24"):
        stream_header(SoundFormat.FLAC, 48000, 1)


@pytest.mark.parametrize("sound_format", list(SoundFormat))
def test_the_same_sound_is_the_same_bytes(sound_format: SoundFormat) -> None:
    block = np.random.default_rng(3).uniform(-1.2, 1.2, (5000, 2)).astype(np.float32)
    metadata = Metadata((1e-6, 2.0), ("displacement", "velocity"), {})
    first = encode_all(block, sound_format, 44100, metadata)
    assert first == encode_all(block.copy(), sound_format, 44100, metadata)


def test_media_types() -> None:
    assert media_type(SoundFormat.WAV24, 96000, 2) == "audio/wav"
    assert media_type(SoundFormat.FLAC, 96000, 2) == "audio/flac"
    assert media_type(SoundFormat.L16, 48000, 2) == "audio/L16;rate=48000;channels=2"
    assert media_type(SoundFormat.F32LE, 96000, 2) == "application/octet-stream"
    with pytest.raises(InvalidRequest, match="48000 Hz"):
        media_type(SoundFormat.L16, 96000, 2)


def test_the_ending_and_the_subtype_choose_the_format() -> None:
    assert choose_format("a.wav") is SoundFormat.WAV
    assert choose_format("A.WAV", "pcm16") is SoundFormat.WAV16
    assert choose_format("a.wav", "pcm24") is SoundFormat.WAV24
    assert choose_format("a.flac") is SoundFormat.FLAC
    assert choose_format("a.raw") is SoundFormat.F32LE
    assert choose_format("a.l16") is SoundFormat.L16
    with pytest.raises(InvalidRequest, match=r"\.wav, \.flac, \.raw"):
        choose_format("a.mp3")
    with pytest.raises(InvalidRequest, match="pcm24"):
        choose_format("a.flac", "float")


FLOATS = st.one_of(
    st.floats(width=32, allow_nan=False),
    st.floats(-1.5, 1.5, width=32),
    st.integers(-70000, 70000).map(lambda half_steps: half_steps / 65536),  # the ties at 16 bit
    st.sampled_from([0.0, -0.0, 1.0, -1.0, 1.401298464324817e-45, 0.9999999403953552, -1.0000001192092896]),
)


def twin(sample: float, bits: int) -> int:
    """Return the integer by exact decimal arithmetic."""
    steps = 2 ** (bits - 1)
    if np.isinf(sample):
        return int(steps - 1 if sample > 0 else -steps)
    rounded = int((Decimal(sample) * steps).to_integral_value(ROUND_HALF_EVEN))
    return int(max(-steps, min(steps - 1, rounded)))


@given(st.lists(FLOATS, min_size=1, max_size=20), st.sampled_from([16, 24]))
def test_the_rule_is_exact(samples: list[float], bits: int) -> None:
    block = np.array(samples, dtype=np.float32)[:, np.newaxis]
    assert quantise(block, bits)[:, 0].tolist() == [twin(float(sample), bits) for sample in block[:, 0]]


@given(st.lists(st.floats(-2, 2, width=32), min_size=1, max_size=50))
def test_stream_file_and_byte_order_hold_the_same_integers(samples: list[float]) -> None:
    block = np.array(samples, dtype=np.float32)[:, np.newaxis]
    little = block_bytes(block, SoundFormat.WAV16)
    assert encode_all(block, SoundFormat.WAV16, 8000)[-len(little) :] == little
    big = block_bytes(block, SoundFormat.L16)
    np.testing.assert_array_equal(np.frombuffer(little, "<i2"), np.frombuffer(big, ">i2"))
    packed = np.frombuffer(block_bytes(block, SoundFormat.WAV24), np.uint8).reshape(-1, 3)
    wide = np.pad(packed, ((0, 0), (1, 0))).copy().view("<i4")[:, 0] >> 8
    np.testing.assert_array_equal(wide, quantise(block, 24)[:, 0])


def test_the_input_is_left_alone() -> None:
    block = np.array([[0.3], [2.0]], dtype=np.float32)
    for sound_format in set(SoundFormat) - {SoundFormat.FLAC}:
        block_bytes(block, sound_format)
    assert block.tolist() == np.array([[0.3], [2.0]], dtype=np.float32).tolist()


@pytest.mark.parametrize("sound_format", list(SoundFormat))
def test_nan_is_our_bug_in_every_format(sound_format: SoundFormat) -> None:
    with pytest.raises(AssertionError, match="NaN"):
        encode_all(np.array([[0.0], [np.nan]], dtype=np.float32), sound_format, 8000)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=20,
)
METADATAS = st.lists(
    st.tuples(st.floats(allow_nan=False, allow_infinity=False), st.sampled_from(("velocity", "tangential_force"))),
    min_size=1,
    max_size=4,
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


RATES = [1, 65_535, 65_536, 65_537, 65_540, 88_200, 96_001, 192_000, 655_349, 655_350, 655_360, 1_048_570]


def test_flac_refuses_the_rates_that_libsndfile_refuses() -> None:
    drawn = np.random.default_rng(20261128)
    scenes, beyond, tens = ((1_000, 192_001, 30), (60_000, 700_000, 15), (6_500, 70_000, 15))
    random = [*drawn.integers(*scenes), *drawn.integers(*beyond), *(10 * drawn.integers(*tens))]
    for rate in [*RATES, *map(int, random)]:
        try:
            body = io.BytesIO()
            soundfile.write(body, np.zeros((16, 1)), rate, format="FLAC", subtype="PCM_24")
        except soundfile.LibsndfileError:
            with pytest.raises(
                InvalidRequest, match=rf"got {rate} Hz; .*multiples of 10 Hz up to 655350 Hz.*Write WAV"
            ):
                encode_all(SILENCE, SoundFormat.FLAC, rate)
        else:
            read = soundfile.SoundFile(io.BytesIO(encode_all(SILENCE, SoundFormat.FLAC, rate)))
            assert read.samplerate == rate


def test_the_rate_that_a_refusal_offers_is_one_that_flac_holds() -> None:
    for rate in (65_536, 65_537, 99_999, 655_351, 10**6):
        with pytest.raises(InvalidRequest) as refused:
            encode_all(SILENCE, SoundFormat.FLAC, rate)
        offered = int(refused.value.faults[0].hint.split(" or ")[1].split()[0])
        assert encode_all(SILENCE, SoundFormat.FLAC, offered)
