"""The audio output devices of this machine, and PortAudio itself, which is loaded on first use.

Source: python-sounddevice over PortAudio.
Limits: PortAudio looks for devices once, when it is loaded; only a new process sees one that is plugged in later.
    Loading may take a second where many devices are probed: call it from a thread.
"""

from __future__ import annotations

import atexit
import ctypes.util
import importlib.util
from typing import Any, TypedDict

from synth.errors import CannotRender, Fault, InvalidRequest, shown

INSTALL_PORTAUDIO = (
    "audio devices need PortAudio, which is not installed here: apt-get install libportaudio2 (Debian, Ubuntu), "
    "dnf install portaudio (Fedora) or brew install portaudio (macOS)"
)


class DeviceDescription(TypedDict):
    """One output device, as `GET /v1/devices` and `ridgewave devices` show it."""

    name: str
    index: int
    channels: int
    default_sample_rate: float
    default: bool


def portaudio() -> Any:
    """Return the sounddevice module. Raises CannotRender that says what to install."""
    try:
        import sounddevice
    except ImportError as error:
        raise CannotRender("audio devices need the Python package sounddevice: pip install sounddevice.") from error
    except OSError as error:  # PortAudio is missing
        raise CannotRender(f"{INSTALL_PORTAUDIO} ({error}).") from error
    except Exception as error:  # its PortAudioError, which cannot be imported
        raise CannotRender(f"PortAudio did not start: {error}.") from error
    return sounddevice


def missing_portaudio() -> str | None:
    """Return why audio devices are not available; None if PortAudio is installed. Loads nothing."""
    if importlib.util.find_spec("sounddevice") is None:
        return "audio devices need the Python package sounddevice: pip install sounddevice."
    if importlib.util.find_spec("_sounddevice_data") is None and ctypes.util.find_library("portaudio") is None:
        return f"{INSTALL_PORTAUDIO}."
    return None


def let_go_at_exit() -> None:
    """Do not end PortAudio's streams at exit: with a stalled device the process would never exit."""
    handler = getattr(portaudio(), "_exit_handler", None)
    if handler is not None:
        atexit.unregister(handler)


def list_devices() -> list[DeviceDescription]:
    """Return the output devices in PortAudio's order. Raises CannotRender without PortAudio."""
    sounddevice = portaudio()
    default = sounddevice.default.device[1]
    hosts = sounddevice.query_hostapis()
    chosen = default if default >= 0 else next((host["default_output_device"] for host in hosts), -1)
    return [
        DeviceDescription(
            name=str(device["name"]),
            index=int(device["index"]),
            channels=int(device["max_output_channels"]),
            default_sample_rate=float(device["default_samplerate"]),
            default=device["index"] == chosen,
        )
        for device in sounddevice.query_devices()
        if device["max_output_channels"] > 0
    ]


def find_device(wanted: str | int | None) -> DeviceDescription:
    """Return the device with this index, name or unique part of a name; for None the default device.

    Raises InvalidRequest that lists the devices, CannotRender if there are none.
    """
    devices = list_devices()
    if not devices:
        raise CannotRender("this machine has no audio output device. Write the device file:NAME.wav for a file.")
    if wanted is None:
        return next((device for device in devices if device["default"]), devices[0])
    found = _matching(devices, wanted)
    if len(found) != 1:
        names = ", ".join(f"{device['index']} {device['name']!r}" for device in devices)
        hint = "Write the whole name or the index." if found else "Write one of these, or file:NAME.wav."
        raise InvalidRequest([Fault("/device", shown(wanted), names, hint)])
    return found[0]


def _matching(devices: list[DeviceDescription], wanted: str | int) -> list[DeviceDescription]:
    """Return the devices with this index, else with this name, else with this part of a name."""
    text = str(wanted).strip().casefold()
    by_index = [device for device in devices if str(device["index"]) == text]
    by_name = [device for device in devices if device["name"].casefold() == text]
    by_part = [device for device in devices if text and text in device["name"].casefold()]
    return by_index or by_name or by_part
