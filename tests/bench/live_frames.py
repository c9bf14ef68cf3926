"""The client's half of a WebSocket for the load generator: it sends whole frames, and reads frames from any chunks.

Model: RFC 6455. Many contact updates are built at once: one array of 34-byte frames, each with its own random mask, so
    that sending one is a slice of bytes. Received data is cut into frames, wherever the network cut it.
Source: RFC 6455, sections 4.1 (handshake), 5.2 (frames), 5.3 (masks); the live protocol for the 28 bytes of an update.
Limits: no extensions, no fragmented messages (without an offered extension a server has no reason to fragment).
"""

from __future__ import annotations

import base64
import json
import os
import struct
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

TEXT, BINARY, CLOSE, PING, PONG = 0x1, 0x2, 0x8, 0x9, 0xA
SUBPROTOCOL = "ridgewave.v1"
LONGEST = 1 << 24  # bytes of a frame: the largest block is 48000 frames of a few channels; more is a framing error
CONTACT = np.dtype(
    {
        "names": ["opening", "mask", "version", "flags", "contact", "seq", "time", "value", "load"],
        "formats": [">u2", ("u1", 4), "u1", "u1", "<u2", "<u4", "<f8", "<f8", "<f4"],
        "offsets": [0, 2, 6, 7, 8, 10, 14, 22, 30],
        "itemsize": 34,
    }
)
CONTACT_FRAME_BYTES = CONTACT.itemsize
_OPENING = 0x8280 + CONTACT_FRAME_BYTES - 6  # FIN, binary, masked, 28 bytes


class FrameError(Exception):
    """The server sent data that is not a frame of this protocol."""


def handshake(host: str, path: str = "/v1/live", key: str | None = None) -> bytes:
    """Return the request that opens a live connection; key: one of RIDGEWAVE_API_KEYS."""
    lines = [
        f"GET {path} HTTP/1.1",
        f"Host: {host}",
        "Upgrade: websocket",
        "Connection: Upgrade",
        f"Sec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}",
        "Sec-WebSocket-Version: 13",
        f"Sec-WebSocket-Protocol: {SUBPROTOCOL}",
        *([] if key is None else [f"Authorization: Bearer {key}"]),
    ]
    return "\r\n".join([*lines, "", ""]).encode("ascii")


def frame(kind: int, payload: bytes) -> bytes:
    """Return one masked frame."""
    size = len(payload)
    if size < 126:
        opening = struct.pack("!BB", 0x80 | kind, 0x80 | size)
    elif size < 1 << 16:
        opening = struct.pack("!BBH", 0x80 | kind, 0x80 | 126, size)
    else:
        opening = struct.pack("!BBQ", 0x80 | kind, 0x80 | 127, size)
    mask = os.urandom(4)
    keys = np.frombuffer(mask * (size // 4 + 1), np.uint8)[:size]
    return opening + mask + (np.frombuffer(payload, np.uint8) ^ keys).tobytes()


def message(**fields: object) -> bytes:
    """Return a text frame with `fields` as its JSON object."""
    return frame(TEXT, json.dumps(fields).encode())


def contact_frames(
    first_seq: int,
    times: npt.NDArray[np.float64],
    positions: npt.NDArray[np.float64],
    loads: npt.NDArray[np.float64],
    random: np.random.Generator,
) -> bytes:
    """Return consecutive frames of `CONTACT_FRAME_BYTES` each, for updates from `first_seq` on (s, m, N)."""
    frames = np.zeros(len(times), CONTACT)
    frames["opening"] = _OPENING
    frames["mask"] = random.integers(0, 256, (len(times), 4), np.uint8)
    frames["version"] = 1
    frames["seq"] = np.arange(first_seq, first_seq + len(times))
    frames["time"], frames["value"], frames["load"] = times, positions, loads
    raw = frames.view(np.uint8).reshape(len(times), CONTACT_FRAME_BYTES)
    raw[:, 6:] ^= np.tile(raw[:, 2:6], (1, (CONTACT_FRAME_BYTES - 6) // 4))
    return raw.tobytes()


class FrameReader:
    """Cuts a server's data into frames, wherever the network cut it."""

    def __init__(self) -> None:
        self._waiting = b""

    def frames(self, chunk: bytes) -> Iterator[tuple[int, int, int, bytes]]:
        """Yield each complete frame: kind, start and end of its payload, and the bytes that contain it.

        A payload is given by its place, so that one that is only counted is not copied. Raises FrameError.
        """
        held = self._waiting + chunk if self._waiting else chunk
        place, total = 0, len(held)
        while total - place >= 2:
            kind, size = held[place], held[place + 1]
            start = place + 2
            if size == 126:
                size = held[place + 2] << 8 | held[place + 3] if total - place >= 4 else LONGEST
                start = place + 4
            elif size == 127:
                size = int.from_bytes(held[place + 2 : place + 10], "big") if total - place >= 10 else LONGEST
                start = place + 10
            elif size > 127:
                raise FrameError("a frame from the server is masked")
            if kind & 0xF0 != 0x80:
                raise FrameError(f"a frame begins with {kind:#x}: fragmented, or of an extension")
            if size > LONGEST:
                raise FrameError(f"a frame of {size} bytes")
            if start + size > total:
                break
            place = start + size
            yield kind & 0x0F, start, place, held
        self._waiting = held[place:]
