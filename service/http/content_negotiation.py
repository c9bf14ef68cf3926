"""What a request's headers ask of its answer: the sound format, packing by gzip, and nothing at all where it is known.

Model: `?format=` comes first, since players cannot set Accept, then Accept (RFC 9110, 12.5.1): each media type that a
    sound can be sent as is weighed by the most specific range that covers it; the largest weight wins, the earlier row
    of `OFFERS` where they tie, so `*/*` and no Accept at all mean float32 WAV. Text is packed by Starlette's own layer,
    which is asked only where Accept-Encoding allows gzip ("gzip;q=0" does not); sound never is. An ETag that
    If-None-Match names (RFC 9110, 13.1.2) is answered 304.
Limits: `audio/L16` needs its rate and channels to be those of the scene where Accept names them, and a rate of 48 kHz
    at most. The sample types wav16 and wav24 share their media type with wav, so only `?format=` names them. What a
    route has packed itself goes out as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

from starlette.datastructures import Headers
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipMiddleware
from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send

from service.problems import Problem
from synth.encode.formats import L16_RATE_LIMIT_HZ, SoundFormat

OFFERS: tuple[tuple[SoundFormat, tuple[str, ...]], ...] = (
    (SoundFormat.WAV, ("audio/wav", "audio/x-wav", "audio/wave", "audio/vnd.wave")),
    (SoundFormat.FLAC, ("audio/flac", "audio/x-flac")),
    (SoundFormat.L16, ("audio/l16",)),
    (SoundFormat.F32LE, ("application/octet-stream",)),
)


FLAC_CHANNELS = 8  # the most the format has (RFC 9639, 9.1.3)


@dataclass(frozen=True, slots=True)
class MediaRange:
    """One element of Accept: type and subtype (either may be "*"), parameters without q, and the weight q."""

    kind: str
    subtype: str
    parameters: tuple[tuple[str, str], ...]
    weight: float

    def covers(self, media_type: str, shape: dict[str, str]) -> bool:
        """Return whether the range covers `media_type` of a sound whose rate and channels are `shape`."""
        kind, subtype = media_type.split("/")
        if self.kind not in ("*", kind) or self.subtype not in ("*", subtype):
            return False
        return all(shape.get(name, value) == value for name, value in self.parameters)

    @property
    def precision(self) -> tuple[bool, bool, int]:
        """Return what orders ranges from the vaguest to the most specific."""
        return self.kind != "*", self.subtype != "*", len(self.parameters)


def parse_accept(header: str) -> list[MediaRange]:
    """Return the ranges of an Accept header; elements that make no sense are left out."""
    ranges = [_parse_range(element) for element in header.lower().split(",")]
    return [entry for entry in ranges if entry is not None]


def choose_format(
    wanted: str | None, accept: str | None, sample_rate: int, channels: int, *, endless: bool = False
) -> SoundFormat:
    """Return the format of an answer.

    wanted: the value of `?format=`, already known to be a format's name, or None.
    endless: the answer is a stream, which FLAC is not.
    Raises Problem (406) where Accept leaves nothing. L16 above 48 kHz by `?format=` is refused where its media type is
    made.
    """
    if wanted is not None:
        return SoundFormat(wanted)
    ranges = parse_accept(accept) if accept and accept.strip() else [MediaRange("*", "*", (), 1.0)]
    best, best_weight = None, 0.0
    possible = _possible(sample_rate, channels, endless)
    for sound_format in possible:
        weight = _weight(sound_format, ranges, {"rate": str(sample_rate), "channels": str(channels)})
        if weight > best_weight:
            best, best_weight = sound_format, weight
    if best is None:
        offers = ", ".join(_offer_text(offer, sample_rate, channels) for offer in possible)
        raise Problem("not-acceptable", f"Accept leaves nothing. This sound can be sent as {offers}; or use ?format=.")
    return best


def _possible(sample_rate: int, channels: int, endless: bool) -> list[SoundFormat]:
    impossible = {SoundFormat.FLAC} if endless or channels > FLAC_CHANNELS else set()
    if sample_rate > L16_RATE_LIMIT_HZ:
        impossible.add(SoundFormat.L16)
    return [sound_format for sound_format, _ in OFFERS if sound_format not in impossible]


def _weight(sound_format: SoundFormat, ranges: list[MediaRange], shape: dict[str, str]) -> float:
    """Return the weight of the most specific range that covers `sound_format`; 0 where none does."""
    names = next(names for offer, names in OFFERS if offer is sound_format)
    shape = shape if sound_format is SoundFormat.L16 else {}
    covering = [entry for entry in ranges if any(entry.covers(name, shape) for name in names)]
    return max(covering, key=lambda entry: entry.precision).weight if covering else 0.0


def _offer_text(sound_format: SoundFormat, sample_rate: int, channels: int) -> str:
    name = next(names[0] for offer, names in OFFERS if offer is sound_format)
    return f"audio/L16;rate={sample_rate};channels={channels}" if sound_format is SoundFormat.L16 else name


def _parse_range(element: str) -> MediaRange | None:
    media_type, *rest = [part.strip() for part in element.split(";")]
    kind, slash, subtype = media_type.partition("/")
    if not (kind and slash and subtype) or (kind == "*" and subtype != "*"):
        return None
    weight, parameters = 1.0, []
    for part in rest:
        name, _, value = part.partition("=")
        if name.strip() != "q":
            parameters.append((name.strip(), value.strip().strip('"')))
            continue
        try:
            weight = float(value)
        except ValueError:
            return None
        if not 0.0 <= weight <= 1.0:
            return None
    return MediaRange(kind, subtype, tuple(parameters), weight)


NEVER_PACKED = (*DEFAULT_EXCLUDED_CONTENT_TYPES, "application/octet-stream")  # sound, which is sent block by block
SHORTEST = 1000  # bytes of an answer: less fits into a packet or two
LEVEL = 5  # of gzip: a picture of 70 kB takes 1 ms and becomes 20 kB; higher levels gain a percent
NONE = ("q=0", "q=0.0", "q=0.00", "q=0.000")


class Compression:
    """The layer."""

    def __init__(self, app: ASGIApp) -> None:
        self._plain = app
        self._packed = GZipMiddleware(app, SHORTEST, LEVEL, exclude_content_types=NEVER_PACKED)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request, packed or not."""
        packs = scope["type"] == "http" and takes_gzip(Headers(scope=scope))
        await (self._packed if packs else self._plain)(scope, receive, send)


def takes_gzip(headers: Headers) -> bool:
    """Return whether Accept-Encoding allows gzip (RFC 9110, 12.5.3)."""
    for entry in ",".join(headers.getlist("accept-encoding")).split(","):
        coding, _, parameter = entry.partition(";")
        if coding.strip().lower() in ("gzip", "*"):
            return parameter.replace(" ", "").lower() not in NONE
    return False


def is_known(request: Request, tag: str) -> bool:
    """Return whether If-None-Match names `tag`, in a weak comparison."""
    tags = ",".join(request.headers.getlist("if-none-match")).split(",")
    return any(one.strip().removeprefix("W/") in ("*", f'"{tag}"') for one in tags)
