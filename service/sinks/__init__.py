"""Outputs on the machine itself: audio devices, and files in one folder.

Model: sound leaves the service in three ways, all behind the limiter of the live voice. They differ in what sets the
    pace. A device (`audio_device`) sets it: a thread fills a ring buffer ahead of the device's callback. A file
    (`file_sink`) is written at the pace of a clock. A network peer (`http.paced_stream`, and the live protocol) is not
    a `Sink`: the event loop writes to it, so that many peers need no threads. If one output fails, the session and
    its other outputs continue.
    PortAudio is loaded with the first device.
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
    """Return the sink for `device`, not yet started. File sinks keep real time, as devices do.

    device: "file:NAME", or the name or index of a device; None for the default device.
    folder: the folder of file sinks; None if there is none.
    claims: the devices that are in use by this process.
    Raises InvalidRequest for an invalid NAME, CannotRender if there is no folder.
    """
    if isinstance(device, str) and device.startswith(FILE_PREFIX):
        if folder is None:
            raise CannotRender("this service has no folder for recordings: it plays on devices only.")
        return FileSink(folder, device.removeprefix(FILE_PREFIX), realtime=True)
    return DeviceSink(device, claims=claims)
