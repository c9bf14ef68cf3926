"""The commands, in the order of `--help`: the summary, the description and the arguments of each."""

from __future__ import annotations

import argparse
import textwrap
from typing import Any

from clients.command_line.help_examples import epilog
from clients.command_line.shared_arguments import add_no_clobber, add_progress, add_recording, add_scene

WIDTH = 100  # characters per line of a description


def add_commands(commands: Any) -> None:
    """Add every command to `commands`, the subparsers of the program."""
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


def _add_command(commands: Any, name: str, summary: str, description: str) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=summary,
        description=textwrap.fill(description, WIDTH),
        epilog=epilog(name),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(command_module=f"clients.commands.{name}")
    parser.add_argument("--json", action="store_true", help="print results and messages as JSON")
    return parser


def _add_render(commands: Any) -> None:
    parser = _add_command(
        commands,
        "render",
        "render a scene to a file",
        "Render a scene to a sound file. The file gets its name only when it is complete; it then replaces an existing "
        "file.",
    )
    add_scene(parser)
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
    add_no_clobber(parser)
    add_progress(parser)


def _add_explain(commands: Any) -> None:
    parser = _add_command(
        commands,
        "explain",
        "print what would be simulated, why, and at what cost",
        "Print the plan of a scene: what is simulated and why, what is left out, the cost and the error.",
    )
    add_scene(parser)
    add_progress(parser)


def _add_accuracy(commands: Any) -> None:
    parser = _add_command(
        commands,
        "accuracy",
        "measure what accuracy costs in time",
        "Compute a scene with every method, and report the error of each and its cost on this machine. Takes up to a "
        "minute.",
    )
    add_scene(parser)
    parser.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        help="a folder, created if it does not exist, for accuracy.json, accuracy.svg and accuracy.png; the figures "
        "require the extra plots",
    )
    parser.add_argument("--quantity", metavar="Q", help="a quantity of the scene's channels; default: the first")
    parser.add_argument("--live", action="store_true", help="measure a live voice, behind a hand, in place of a file")
    add_no_clobber(parser)
    add_progress(parser)


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
    add_scene(parser)
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
    add_progress(parser)


def _add_table(commands: Any) -> None:
    parser = _add_command(
        commands,
        "table",
        "write the response table of a scene to a file",
        "Write the response table of a scene to a file that other programs can read (docs/table.md). The speed and the "
        "load of the scene do not matter.",
    )
    add_scene(parser)
    parser.add_argument("-o", "--output", metavar="NAME", required=True, help="a file that ends in .safetensors")
    add_no_clobber(parser)
    add_progress(parser)


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
    add_progress(parser)


def _add_analyze(commands: Any) -> None:
    parser = _add_command(
        commands,
        "analyze",
        "tell what is felt of a scene or a recording",
        "Tell what is felt of a steady scene: the motion of the whole finger, the vibration of the skin under its "
        "ridges, and the spatial pattern, each over its threshold. SCENE may be a recorded vibration, too: a WAV, "
        "FLAC, CSV or Parquet file with a known scale (docs/study.md).",
    )
    add_scene(parser)
    parser.add_argument(
        "--beside", metavar="SCENE", help="another scene or recording: is it told from the first? --set is for both"
    )
    add_recording(parser)


def _add_compare(commands: Any) -> None:
    parser = _add_command(
        commands,
        "compare",
        "set measured vibrations beside the model",
        "Set measured vibrations beside the model's: the lines at multiples of speed over period in both, the speed "
        "that fits them, and the difference of each line in dB (docs/compare.md).",
    )
    add_scene(parser)
    parser.add_argument("recordings", metavar="RECORDING", nargs="+", help="WAV, FLAC, CSV or Parquet files")
    add_recording(parser)
    parser.add_argument("-o", "--output", metavar="FIGURE", help="a figure that ends in .svg, .png or .pdf")


def _add_completion(commands: Any) -> None:
    parser = _add_command(
        commands,
        "completion",
        "print the script for completion with TAB",
        "Print the script with which a shell completes commands, options, textures and scene fields with TAB.",
    )
    parser.add_argument("shell", metavar="SHELL", choices=("bash", "zsh", "fish"), help="bash, zsh or fish")
