"""The arguments that several commands have: the scene, how a recording is read, existing files, progress."""

from __future__ import annotations

import argparse

SCENE_HELP = "a JSON file, - for standard input, or a texture's name (see `ridgewave textures`)"


def add_scene(parser: argparse.ArgumentParser) -> None:
    """Add the scene, and what changes it."""
    parser.add_argument("scene", metavar="SCENE", help=SCENE_HELP)
    parser.add_argument(
        "--set",
        metavar="FIELD=VALUE",
        action="append",
        default=[],
        dest="changes",
        help="change one field, as in texture.period=0.6mm; VALUE is JSON if it parses, otherwise a string; repeatable",
    )
    parser.add_argument(
        "--everyday",
        action="store_true",
        help="of a texture's name: its everyday scan by a fingertip, in place of the texture alone",
    )
    parser.add_argument("--duration", metavar="TIME", help="seconds, or with a unit, as in 2min; sets output.duration")


def add_no_clobber(parser: argparse.ArgumentParser) -> None:
    """Add the option that keeps existing files."""
    parser.add_argument(
        "--no-clobber", action="store_true", help="keep existing files: stop before anything is computed"
    )


def add_progress(parser: argparse.ArgumentParser) -> None:
    """Add the option that shows or hides the progress."""
    parser.add_argument(
        "--progress",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="show progress on standard error; default: only on a terminal",
    )


def add_recording(parser: argparse.ArgumentParser) -> None:
    """Add what tells how a recording is read."""
    parser.add_argument(
        "--quantity",
        metavar="NAME",
        help="of a recording: displacement, velocity, acceleration; of compare also tangential_force",
    )
    parser.add_argument("--column", metavar="NAME", help="of a table: the column of the samples")
    parser.add_argument("--channel", type=int, metavar="N", help="of a sound: the channel, from 0")
    parser.add_argument("--rate", type=float, metavar="HZ", help="of a table without times: samples per second")
    parser.add_argument("--scale", type=float, metavar="SI", help="of a recording: SI value of a sample of 1")
