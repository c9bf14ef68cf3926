"""The grammar of the command line: every command, argument and option, and the text of `--help`.

This module imports argparse and nothing of ridgewave, so that `--help` answers at once. The parsed arguments name the
module of the command, which `clients.command_line` then imports.
"""

from __future__ import annotations

import argparse
import os
import textwrap
from collections.abc import Sequence
from typing import Any

WIDTH = 100  # characters per line of a description
SCENE_HELP = "a JSON file, - for standard input, or a texture's name (see `ridgewave textures`)"
EXIT_CODES = "Exit codes: 0 done, 1 cannot be done, 2 invalid request, 130 interrupted."
EXAMPLES = {
    "": (
        ("render grating-800um-40um -o out.wav", "a texture of the catalogue as a sound file"),
        ("explain scene.json", "what would be simulated, why, and at what cost"),
        ("serve", "the web page and the HTTP service"),
    ),
    "render": (
        ("render grating-800um-40um -o out.wav", "two seconds, float WAV"),
        ("render denim-72x56 --everyday -o jeans.wav", "as a fingertip feels it"),
        ("render scene.json -o out.flac --set texture.period=0.6mm --duration 5", "with changes, as FLAC"),
        ("render scene.json -o - | sox - -d", "to a player"),
    ),
    "explain": (
        ("explain grating-800um-40um", "as tables"),
        ("explain scene.json --set 'effects.inertia={}' --json", "with an effect, as JSON"),
    ),
    "accuracy": (
        ("accuracy grating-800um-40um", "as a table"),
        ("accuracy scene.json --quantity displacement -o report", "with figures, in the folder report"),
        ("accuracy grating-1mm-31um --live", "of a live voice, behind a hand"),
    ),
    "serve": (
        ("serve", "on http://127.0.0.1:8000"),
        ("serve --port 0", "on a free port"),
    ),
    "play": (
        ("play grating-1mm-31um --endless", "until Ctrl-C"),
        ("play scene.json --device file:sound.wav", "into a file instead of a device"),
    ),
    "import": (
        ("import scan.csv --unit um --pixel 5um --dry-run", "what is in the file; nothing is kept"),
        ("import scan.csv --unit um --pixel 5um --level tilt --name cloth", "keep it, as the texture cloth"),
        ("import wood.png --pixel 50um --height 120um --picture wood-lit.png", "a displacement map"),
        ("import wall_2k.zip --width 2m --part 80mm --name wall", "a set of maps of a material"),
    ),
    "devices": (("devices --json", "for a program"),),
    "textures": (
        ("textures", "the catalogue, and what was imported"),
        ("textures denim-72x56", "one entry: its scene, and the source of each number"),
        ("textures denim-72x56 --everyday > scene.json", "its everyday scan, as a scene to edit"),
        ("textures cloth --export cloth.x3p", "the heights of an imported texture"),
        ("textures --prepare", "make the tables of all textures, so that the page plays each at once"),
    ),
    "table": (
        ("table grating-800um-40um -o grating.safetensors", "its response table, for another program"),
        ("table scene.json -o scene.safetensors --set output.bandwidth=500Hz", "with a narrower band"),
    ),
    "analyze": (
        ("analyze grating-1mm-31um --everyday", "by vibration, by its spatial pattern, or not at all"),
        ("analyze scene.json --set scan.speed=40mm/s --json", "for a program"),
        ("analyze scan.wav --quantity acceleration --scale 98.1", "of a recording whose full scale is 10 g"),
        ("analyze denim-72x56 --everyday --beside corduroy-14-wale", "whether two textures are told apart"),
    ),
    "compare": (
        ("compare scene.json scan1.wav scan2.csv --quantity acceleration", "measurements beside the model"),
        ("compare scene.json scan.csv --column az --rate 10000 -o scan.svg", "with a figure"),
    ),
    "study": (
        ("study duplex -o duplex.nc --figure duplex.svg", "a ready study, with its figure"),
        ("study map.json -o map.nc", "solve every scene of a study, as one dataset"),
        ("study map.json -o map.csv --workers 4", "as a table, in four processes"),
        ("study map.json -o map.zarr --scheduler tcp://lab:8786", "on a Dask cluster"),
    ),
    "completion": (
        ("completion bash >> ~/.bashrc", "for every new bash"),
        ("completion zsh >> ~/.zshrc", "for every new zsh"),
        ("completion fish > ~/.config/fish/completions/ridgewave.fish", "for fish"),
    ),
}
"""The examples in the `--help` of each command: the words after `ridgewave`, and what they do."""


class _Version(argparse.Action):
    """Prints the version. Reading the metadata of the package is slow, so only this option does it."""

    def __call__(self, parser: argparse.ArgumentParser, *_rest: Any) -> None:
        from importlib.metadata import PackageNotFoundError, version

        try:
            number = version("ridgewave")
        except PackageNotFoundError:
            number = "(a checkout that is not installed)"
        print(f"ridgewave {number}")
        parser.exit()


def build_parser() -> argparse.ArgumentParser:
    """Return the parser; `command_module` of the parsed arguments is the module of the command."""
    parser = argparse.ArgumentParser(
        prog="ridgewave",
        description="The vibration that a finger feels on a texture: as a file, a stream, or on an audio device.",
        epilog=_epilog(""),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(command_module=None)
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND")
    _add_render(commands)
    _add_explain(commands)
    _add_accuracy(commands)
    _add_serve(commands)
    _add_play(commands)
    _add_import(commands)
    _add_devices(commands)
    _add_textures(commands)
    _add_table(commands)
    _add_study(commands)
    _add_analyze(commands)
    _add_compare(commands)
    _add_completion(commands)
    return parser


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Parse `arguments` (None: those of this process). Invalid arguments end the process with 2.

    Without arguments this prints the help and ends the process with 0.
    """
    parser = build_parser()
    if "_ARGCOMPLETE" in os.environ:  # set by the shell when TAB is pressed
        from clients.command_line.tab_completion import complete

        complete(parser)
    parsed = parser.parse_args(arguments)
    if parsed.command_module is None:
        parser.print_help()
        parser.exit()
    return parsed


def _epilog(command: str) -> str:
    """Return the examples of a command and the exit codes."""
    width = max(len(words) for words, _ in EXAMPLES[command])
    lines = [f"  ridgewave {words:{width}}  # {what}" for words, what in EXAMPLES[command]]
    return "\n".join(["examples:", *lines, "", EXIT_CODES])


def _add_command(commands: Any, name: str, summary: str, description: str) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=textwrap.fill(description, WIDTH),
        epilog=_epilog(name),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(command_module=f"clients.commands.{name}")
    parser.add_argument("--json", action="store_true", help="print results and messages as JSON")
    return parser


def _add_scene(parser: argparse.ArgumentParser) -> None:
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


def _add_render(commands: Any) -> None:
    parser = _add_command(
        commands,
        "render",
        "render a scene to a file",
        "Render a scene to a sound file. The file gets its name only when it is complete; it then replaces an existing "
        "file.",
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
    parser.add_argument(
        "--exact",
        action="store_true",
        help="for a recording: solve it to its tolerance instead of rendering what was heard; takes some seconds",
    )
    _add_no_clobber(parser)
    _add_progress(parser)


def _add_no_clobber(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--no-clobber", action="store_true", help="keep existing files: stop before anything is computed"
    )


def _add_progress(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--progress",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="show progress on standard error; default: only on a terminal",
    )


def _add_explain(commands: Any) -> None:
    parser = _add_command(
        commands,
        "explain",
        "print what would be simulated, why, and at what cost",
        "Print the plan of a scene: what is simulated and why, what is left out, the cost and the error.",
    )
    _add_scene(parser)
    _add_progress(parser)


def _add_accuracy(commands: Any) -> None:
    parser = _add_command(
        commands,
        "accuracy",
        "measure what accuracy costs in time",
        "Compute a scene with every method, and report the error of each and its cost on this machine. Takes up to a "
        "minute.",
    )
    _add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        help="a folder, created if it does not exist, for accuracy.json, accuracy.svg and accuracy.png; the figures "
        "require the extra plots",
    )
    parser.add_argument("--quantity", metavar="Q", help="a quantity of the scene's channels; default: the first")
    parser.add_argument("--live", action="store_true", help="measure a live voice, behind a hand, in place of a file")
    _add_no_clobber(parser)
    _add_progress(parser)


def _add_serve(commands: Any) -> None:
    parser = _add_command(
        commands,
        "serve",
        "run the HTTP service",
        "Run the HTTP service. The environment variables RIDGEWAVE_* set it up; these options override them.",
    )
    parser.add_argument("--host", help="the address to bind; any other than loopback requires RIDGEWAVE_API_KEYS")
    parser.add_argument("--port", type=int, help="the port to bind; 0 chooses a free one")
    parser.add_argument("--uds", metavar="PATH", help="a Unix socket to bind, in place of an address and a port")
    parser.add_argument("--workers", type=int, help="number of server processes")


def _add_play(commands: Any) -> None:
    parser = _add_command(
        commands,
        "play",
        "play a scene on this machine",
        "Play a scene on an audio device of this machine. The sound is faded in and out and passes the safety limiter. "
        "Ctrl-C fades out and stops.",
    )
    _add_scene(parser)
    parser.add_argument("--device", metavar="D", help="name or number of the device (see `ridgewave devices`)")
    parser.add_argument("--endless", action="store_true", help="play until interrupted")


def _add_import(commands: Any) -> None:
    parser = _add_command(
        commands,
        "import",
        "import a measured surface as a texture",
        "Read a file of heights, report what is in it, and keep it as a texture that scenes can name. What the file "
        "does not state, such as a unit, has to be given: nothing is guessed.",
    )
    parser.add_argument(
        "file",
        metavar="FILE",
        help="text, NPY, an image, or a format that SurfaceTopography reads; or a set of maps: a folder or a ZIP file",
    )
    parser.add_argument(
        "--unit",
        metavar="UNIT",
        help="unit of the numbers: m, cm, mm, um, nm or inch; or two, as in 'mm, um': of x, and of the heights",
    )
    parser.add_argument("--pixel", metavar="LENGTH", help="distance between points, as in 5um or '5 um, 10 um' (x, y)")
    parser.add_argument("--height", metavar="LENGTH", help="height of a displacement map, from black to white")
    parser.add_argument(
        "--level",
        choices=("none", "tilt", "curvature"),
        help="form to remove before the surface is kept; default: none",
    )
    parser.add_argument(
        "--missing",
        choices=("refuse", "fill", "crop"),
        help="missing points: refuse the file (default), fill them from their neighbours, or crop to the largest part "
        "without them",
    )
    parser.add_argument(
        "--resample",
        metavar="LENGTH",
        help="interpolate a profile linearly to points at this distance, as in 5um: for steps of x that are not equal",
    )
    parser.add_argument("--width", metavar="LENGTH", help="of a set of maps: the width of the sample, as in 2m")
    parser.add_argument("--part", metavar="LENGTH", help="of a set: keep a square of this side from its middle")
    parser.add_argument(
        "--slope", metavar="NUMBER", help="of a set: rms slope of synthetic waves below the pixel; 0: none"
    )
    parser.add_argument("--hurst", metavar="NUMBER", help="of a set: Hurst exponent of these waves, instead of --slope")
    parser.add_argument("--shortest", metavar="LENGTH", help="of a set: the shortest of these waves; default: 60um")
    parser.add_argument("--name", metavar="NAME", help="name of the texture; default: that of the file")
    parser.add_argument("--picture", metavar="OUT.png", help="also write a picture of the surface")
    parser.add_argument("--dry-run", action="store_true", help="report only; keep nothing")


def _add_devices(commands: Any) -> None:
    _add_command(
        commands, "devices", "list this machine's audio devices", "List the audio devices that `play` can use."
    )


def _add_textures(commands: Any) -> None:
    parser = _add_command(
        commands,
        "textures",
        "list the catalogue of textures",
        "List the catalogue and the imported textures, or print one entry's scene as JSON, ready to be saved, edited "
        "and rendered. The sources of its numbers go to standard error.",
    )
    parser.add_argument("name", metavar="NAME", nargs="?", help="the entry to print")
    change = parser.add_mutually_exclusive_group()
    change.add_argument("--everyday", action="store_true", help="print the everyday scan instead of the texture alone")
    change.add_argument("--export", metavar="OUT", help="write the heights of an imported texture: .npy (in m) or .x3p")
    change.add_argument("--rename", metavar="NEW", help="give an imported texture another name")
    change.add_argument("--delete", action="store_true", help="delete an imported texture")
    change.add_argument(
        "--prepare",
        action="store_true",
        help="make the tables with which the page plays a texture at once, of NAME or of all; a minute or two, once",
    )
    _add_progress(parser)


def _add_table(commands: Any) -> None:
    parser = _add_command(
        commands,
        "table",
        "write the response table of a scene to a file",
        "Write the response table of a scene to a file that other programs can read (docs/table.md). The speed and the "
        "load of the scene do not matter.",
    )
    _add_scene(parser)
    parser.add_argument("-o", "--output", metavar="NAME", required=True, help="a file that ends in .safetensors")
    _add_no_clobber(parser)
    _add_progress(parser)


def _add_study(commands: Any) -> None:
    parser = _add_command(
        commands,
        "study",
        "solve many scenes: parameter maps as one dataset",
        "Solve every combination of some fields of a scene, or samples between their ends, and write rms, lines, "
        "contact and what is felt as one labelled dataset (docs/study.md). An interrupted study goes on where it "
        "ended.",
    )
    parser.add_argument(
        "spec", metavar="SPEC",
        help="a JSON file with scene and axes, - for standard input, the name of a ready study, such as duplex, or a "
        "finished study (.nc, .zarr), which --figure draws",
    )  # fmt: skip
    parser.add_argument("-o", "--output", metavar="OUT", help="a name that ends in .zarr, .nc, .parquet or .csv")
    parser.add_argument(
        "--figure", metavar="FILE", action="append", help="draw it (.svg, .png or .pdf; extra `plots`); repeatable"
    )
    parser.add_argument(
        "--dataset", metavar="FOLDER", help="render every scene, too: FLAC files and manifest.jsonl, to train models"
    )
    parser.add_argument("--licence", metavar="TEXT", help="of the dataset: what its manifest says, such as CC0-1.0")
    parser.add_argument("--print", action="store_true", help="print the spec, to edit it, and solve nothing")
    parser.add_argument(
        "--accuracy", action="store_true", help="tell what fewer or more phases cost and change, from some scenes"
    )
    parser.add_argument("--workers", type=int, metavar="N", help="processes (default: one for each processor)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler, such as tcp://127.0.0.1:8786")
    parser.add_argument("--overwrite", action="store_true", help="replace OUT if it exists")
    _add_progress(parser)


def _add_analyze(commands: Any) -> None:
    parser = _add_command(
        commands,
        "analyze",
        "tell what is felt of a scene or a recording",
        "Tell what is felt of a steady scene: the motion of the whole finger, the vibration of the skin under its "
        "ridges, and the spatial pattern, each over its threshold. SCENE may be a recorded vibration, too: a WAV, "
        "FLAC, CSV or Parquet file with a known scale (docs/study.md).",
    )
    _add_scene(parser)
    parser.add_argument(
        "--beside", metavar="SCENE", help="another scene or recording: is it told from the first? --set is for both"
    )
    _add_recording(parser)


def _add_compare(commands: Any) -> None:
    parser = _add_command(
        commands,
        "compare",
        "set measured vibrations beside the model",
        "Set measured vibrations beside the model's: the lines at multiples of speed over period in both, the speed "
        "that fits them, and the difference of each line in dB (docs/compare.md).",
    )
    _add_scene(parser)
    parser.add_argument("recordings", metavar="RECORDING", nargs="+", help="WAV, FLAC, CSV or Parquet files")
    _add_recording(parser)
    parser.add_argument("-o", "--output", metavar="FIGURE", help="a figure that ends in .svg, .png or .pdf")


def _add_recording(parser: argparse.ArgumentParser) -> None:
    """Add what tells how a recording is read."""
    parser.add_argument(
        "--quantity",
        metavar="NAME",
        help="of a recording: displacement, velocity, acceleration; of compare also tangential_force",
    )
    parser.add_argument("--column", metavar="NAME", help="of a table: the column of the samples")
    parser.add_argument("--channel", type=int, default=0, metavar="N", help="of a sound: the channel, from 0")
    parser.add_argument("--rate", type=float, metavar="HZ", help="of a table without times: samples per second")
    parser.add_argument("--scale", type=float, metavar="SI", help="of a recording: SI value of a sample of 1")


def _add_completion(commands: Any) -> None:
    parser = _add_command(
        commands,
        "completion",
        "print the script for completion with TAB",
        "Print the script with which a shell completes commands, options, textures and scene fields with TAB.",
    )
    parser.add_argument("shell", metavar="SHELL", choices=("bash", "zsh", "fish"), help="bash, zsh or fish")
