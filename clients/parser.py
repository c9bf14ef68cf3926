"""The command line's grammar: every command, argument and option, and the words of `--help`.

Imports argparse and nothing of ridgewave, so that help answers before NumPy could even be found. A command is known
here by its name and by the module that carries it out; `clients.command_line` imports that module when it runs.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

SCENE_HELP = "a JSON file, - for standard input, or a name from the catalogue (see `ridgewave textures`)"
EXIT_CODES = "Exit codes: 0 done, 1 could not, 2 asked wrong, 130 interrupted."


class _Version(argparse.Action):
    """Prints the version; reading the package's metadata is slow, so it happens only here."""

    def __call__(self, parser: argparse.ArgumentParser, *_rest: Any) -> None:
        from importlib.metadata import PackageNotFoundError, version

        try:
            number = version("ridgewave")
        except PackageNotFoundError:
            number = "(a checkout that is not installed)"
        print(f"ridgewave {number}")
        parser.exit()


def build_parser() -> argparse.ArgumentParser:
    """Return the parser; the parsed namespace names the command's module in `command_module`."""
    parser = argparse.ArgumentParser(
        prog="ridgewave",
        description="The vibration a finger feels when it scans a texture: as a file, a stream, or on this machine.",
        epilog=EXIT_CODES,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_render(commands)
    _add_explain(commands)
    _add_accuracy(commands)
    _add_serve(commands)
    _add_play(commands)
    _add_devices(commands)
    _add_textures(commands)
    return parser


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Parse `arguments` (None: those of this process); ends the process with 2 where they make no sense."""
    return build_parser().parse_args(arguments)


def _add_command(commands: Any, name: str, summary: str, description: str) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(
        name, help=summary, description=description, epilog=EXIT_CODES
    )
    parser.set_defaults(command_module=f"clients.{name}_command")
    parser.add_argument("--json", action="store_true", help="machine-readable results, and messages too")
    return parser


def _add_scene(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", metavar="SCENE", help=SCENE_HELP)
    parser.add_argument(
        "--set",
        metavar="FIELD=VALUE",
        action="append",
        default=[],
        dest="changes",
        help="change one field, as in texture.period=0.6mm; VALUE is JSON where it parses, else a string; repeatable",
    )
    parser.add_argument("--duration", metavar="TIME", help="seconds, or with a unit, as in 2min; sets output.duration")


def _add_render(commands: Any) -> None:
    parser = _add_command(
        commands,
        "render",
        "render a scene to a file",
        "Render a scene to a sound file. The file appears under its name only when it is complete, and then replaces "
        "one that was there.",
    )
    _add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="OUT",
        required=True,
        help=".wav, .flac, .raw/.f32/.pcm (float32, little-endian) or .l16 (16 bit, big-endian); - streams WAV to "
        "standard output",
    )
    parser.add_argument(
        "--subtype",
        choices=("float", "pcm16", "pcm24"),
        help="sample type: WAV has all three (default float), FLAC is pcm24, raw is float, .l16 is pcm16. "
        "Integer files pass the safety limiter",
    )
    _add_progress(parser)


def _add_progress(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--progress",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="show progress on standard error; without either, only when that is a terminal",
    )


def _add_explain(commands: Any) -> None:
    parser = _add_command(
        commands,
        "explain",
        "say what would be simulated, why, and what it costs",
        "Build a scene's plan and print it: what is simulated and why, what is left out, the cost and the error.",
    )
    _add_scene(parser)


def _add_accuracy(commands: Any) -> None:
    parser = _add_command(
        commands,
        "accuracy",
        "measure what accuracy costs in time",
        "Compute a scene with every method there is, and say what each errs by and what it costs on this machine. "
        "Takes up to a minute.",
    )
    _add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        help="a folder, made where there is none, that gets accuracy.json, accuracy.svg and accuracy.png; the figures "
        "need the extra plots",
    )
    parser.add_argument("--quantity", metavar="Q", help="a quantity of the scene's channels; without it, the first")
    _add_progress(parser)


def _add_serve(commands: Any) -> None:
    parser = _add_command(
        commands,
        "serve",
        "run the HTTP service",
        "Run the HTTP service. Settings come from RIDGEWAVE_* in the environment; these options win over them.",
    )
    parser.add_argument("--host", help="the address to bind; beyond loopback RIDGEWAVE_API_KEYS must be set")
    parser.add_argument("--port", type=int, help="the port to bind; 0 picks a free one")
    parser.add_argument("--workers", type=int, help="how many server processes")


def _add_play(commands: Any) -> None:
    parser = _add_command(
        commands,
        "play",
        "play a scene on this machine",
        "Play a scene on an audio device of this machine, faded in and out and through the safety limiter. Ctrl-C "
        "fades out and stops.",
    )
    _add_scene(parser)
    parser.add_argument("--device", metavar="D", help="name or number of the device (see `ridgewave devices`)")
    parser.add_argument("--endless", action="store_true", help="play until interrupted")


def _add_devices(commands: Any) -> None:
    _add_command(
        commands, "devices", "list this machine's audio devices", "List the audio devices that `play` can use."
    )


def _add_textures(commands: Any) -> None:
    parser = _add_command(
        commands,
        "textures",
        "list the catalogue of textures",
        "List the catalogue, or print one entry's scene as JSON, ready to be saved, edited and rendered.",
    )
    parser.add_argument("name", metavar="NAME", nargs="?", help="the entry to print")
