"""The request headers that choose the form of an answer: Accept, Accept-Encoding and If-None-Match (RFC 9110).

Model: `?format=` wins over Accept, because players cannot set Accept. The most specific range of Accept that covers a
    media type gives its weight (12.5.1). The largest weight wins; of equal weights, the first row of `OFFERS` wins, so
    `*/*` and no Accept both select float32 WAV. Text is compressed where Accept-Encoding allows gzip; sound never is.
Limits: where Accept names a rate or channels for `audio/L16`, they must be those of the scene. Only `?format=` selects
    wav16 and wav24: they share their media type with wav.
"""

from __future__ import annotations

from dataclasses import dataclass

from starlette.datastructures import Headers
from starlette.middleware.gzip import DEFAULT_EXCLUDED_CONTENT_TYPES, GZipResponder, IdentityResponder
from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send

from service.problems import Problem, refused
from synth.encode.containers import media_types
from synth.encode.flac import fits_flac
from synth.encode.formats import L16_RATE_LIMIT_HZ, SoundFormat

FIRST = {media_types(kind): kind for kind in reversed(SoundFormat)}
OFFERS = {kind: tuple(map(str.lower, media_types(kind))) for kind in SoundFormat if kind is FIRST[media_types(kind)]}
"""The media types of each format that Accept can choose: the first of the formats that share a media type."""
NEVER_COMPRESSED = (*DEFAULT_EXCLUDED_CONTENT_TYPES, "application/octet-stream")  # sound, which is sent in blocks
SHORTEST = 1000  # bytes of a compressed answer; a shorter one fits into a packet or two
LEVEL = 5  # of gzip: a picture of 70 kB takes 1 ms and becomes 20 kB; higher levels gain a percent
APART = 1 << 15  # bytes of an answer that a thread compresses: it takes 1 ms, and a megabyte 30 ms
ZERO_WEIGHTS = ("q=0", "q=0.0", "q=0.00", "q=0.000")


@dataclass(frozen=True, slots=True)
class MediaRange:
    """One element of Accept.

    kind, subtype: either may be "*".
    parameters: all but q.
    weight: q.
    """

    kind: str
    subtype: str
    parameters: tuple[tuple[str, str], ...]
    weight: float

    def covers(self, media_type: str, shape: dict[str, str]) -> bool:
        """Return whether the range covers `media_type`; shape: the values of its parameters, for those it has."""
        kind, subtype = media_type.split("/")
        if self.kind not in ("*", kind) or self.subtype not in ("*", subtype):
            return False
        return all(shape.get(name, value) == value for name, value in self.parameters)

    @property
    def precision(self) -> tuple[bool, bool, int]:
        """A key that sorts ranges from the least to the most specific."""
        return self.kind != "*", self.subtype != "*", len(self.parameters)


def choose_format(
    wanted: str | None, accept: str | None, sample_rate: int, channels: int, *, endless: bool = False
) -> SoundFormat:
    """Return the format of an answer.

    wanted: the value of `?format=`, the name of a format, or None.
    accept: the header Accept, or None.
    endless: the answer is a stream, so it cannot be FLAC.
    Raises Problem: 406 where Accept covers no possible format, 422 for FLAC as an endless answer.
    """
    if wanted == SoundFormat.FLAC and endless:
        allowed = ", ".join(kind for kind in SoundFormat if kind is not SoundFormat.FLAC)
        raise refused("?format", "'flac'", allowed, "Write wav24: it has the same samples.")
    if wanted is not None:
        return SoundFormat(wanted)
    ranges = [entry for element in (accept or "").lower().split(",") if (entry := _parse_range(element))]
    if not (accept or "").strip():
        ranges = [MediaRange("*", "*", (), 1.0)]
    possible = dict(OFFERS)
    if endless or not fits_flac(sample_rate, channels):
        del possible[SoundFormat.FLAC]
    if sample_rate > L16_RATE_LIMIT_HZ:
        del possible[SoundFormat.L16]
    shape = {"rate": str(sample_rate), "channels": str(channels)}
    weights = {
        offer: _weight(names, ranges, shape if offer is SoundFormat.L16 else {}) for offer, names in possible.items()
    }
    best = max(weights, key=lambda offer: weights[offer])
    if weights[best] == 0.0:
        shown = {**possible, SoundFormat.L16: (f"audio/L16;rate={sample_rate};channels={channels}",)}
        offers = ", ".join(shown[offer][0] for offer in possible)
        detail = f"Accept covers no possible format. This sound can be sent as {offers}; or use ?format=."
        raise Problem("not-acceptable", detail)
    return best


def _weight(names: tuple[str, ...], ranges: list[MediaRange], shape: dict[str, str]) -> float:
    """Return the weight of the most specific range that covers one of the media types `names`; 0 if none does."""
    covering = [entry for entry in ranges if any(entry.covers(name, shape) for name in names)]
    return max(covering, key=lambda entry: entry.precision).weight if covering else 0.0


def _parse_range(element: str) -> MediaRange | None:
    """Return an element of Accept; None for an invalid one."""
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


class Compression:
    """The layer that compresses text by gzip."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
        elif _allows_gzip(Headers(scope=scope)):
            excluded = NEVER_COMPRESSED
            packed = GZipResponder(
                self._app, SHORTEST, LEVEL, thread_minimum_size=APART, exclude_content_types=excluded
            )
            await packed(scope, receive, send)
        else:  # adds `Vary`
            await IdentityResponder(self._app, SHORTEST, exclude_content_types=NEVER_COMPRESSED)(scope, receive, send)


def _allows_gzip(headers: Headers) -> bool:
    """Return whether Accept-Encoding allows gzip (12.5.3)."""
    for entry in ",".join(headers.getlist("accept-encoding")).split(","):
        coding, _, parameter = entry.partition(";")
        if coding.strip().lower() in ("gzip", "*"):
            return parameter.replace(" ", "").lower() not in ZERO_WEIGHTS
    return False


def is_known(request: Request, tag: str) -> bool:
    """Return whether If-None-Match names `tag`, in a weak comparison (13.1.2)."""
    tags = ",".join(request.headers.getlist("if-none-match")).split(",")
    return any(one.strip().removeprefix("W/") in ("*", f'"{tag}"') for one in tags)
