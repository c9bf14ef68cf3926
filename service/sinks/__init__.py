"""Where audio goes on the server's or the listener's own machine: a device, or a file in the one folder for it.

Model: sound leaves in three ways, all behind the live voice's limiter. They differ in who keeps the time. A device
    (`audio_device`) keeps it: a thread fills a ring ahead of its callback. A file (`file_sink`) keeps none, and is
    written at the pace of a clock. A network peer (`http.paced_stream`, and the live protocol) is no `Sink`: the event
    loop writes to it, by the server's clock or as the peer asks for more, so that many peers need no threads. A failure
    in one of them ends that one; the session and the others go on.
    `open_sink` turns the `device` of a request into a `sink.Sink`: "file:NAME" is a file sink in the folder that the
    settings name, anything else is an audio device. PortAudio is loaded with the first device, not before.
"""

from __future__ import annotations

from pathlib import Path

from service.sinks.audio_device import DeviceSink
from service.sinks.device_access import Claims, DeviceBusy
from service.sinks.device_list import DeviceDescription, list_devices
from service.sinks.file_sink import FileSink
from service.sinks.sink import Sink
from synth.errors import CannotRender

__all__ = ["Claims", "DeviceBusy", "DeviceDescription", "DeviceSink", "FileSink", "Sink", "list_devices", "open_sink"]

FILE_PREFIX = "file:"


def open_sink(device: str | int | None, folder: Path | None, claims: Claims | None = None) -> Sink:
    """Return the sink, not yet started, for `device`: "file:NAME", the name or index of a device, None = the default.

    folder: where file sinks may write; None where this service has none. claims: the devices that play in this process.
    A file sink made here keeps real time, as a device would. Raises InvalidRequest for a bad NAME, CannotRender where
    there is no folder.
    """
    if isinstance(device, str) and device.startswith(FILE_PREFIX):
        if folder is None:
            raise CannotRender("this service has no folder for recordings: it plays on devices only.")
        return FileSink(folder, device.removeprefix(FILE_PREFIX), realtime=True)
    return DeviceSink(device, claims=claims)
