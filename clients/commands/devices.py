"""`ridgewave devices`: lists the audio devices of this machine that `play` can use."""

from __future__ import annotations

import argparse

from clients.command_line.exit_codes import DONE
from clients.command_line.printing import print_json, print_table
from service.sinks import list_devices


def run(arguments: argparse.Namespace) -> int:
    """Carry out the command; raises CannotRender without PortAudio."""
    devices = list_devices()
    if arguments.json:
        print_json({"devices": devices})
    elif not devices:
        print("This machine has no audio output device; `ridgewave play SCENE --device file:NAME.wav` records instead.")
    else:
        rows = [
            (
                str(device["index"]),
                device["name"],
                str(device["channels"]),
                f"{device['default_sample_rate']:.0f} Hz",
                "yes" if device["default"] else "",
            )
            for device in devices
        ]
        print_table("", ("index", "name", "channels", "usual rate", "default"), rows)
    return DONE
