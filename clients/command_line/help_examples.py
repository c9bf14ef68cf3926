"""The end of each `--help`: examples of the command, and the exit codes."""

from __future__ import annotations

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


def epilog(command: str) -> str:
    """Return the examples of a command and the exit codes."""
    width = max(len(words) for words, _ in EXAMPLES[command])
    lines = [f"  ridgewave {words:{width}}  # {what}" for words, what in EXAMPLES[command]]
    return "\n".join(["examples:", *lines, "", EXIT_CODES])
