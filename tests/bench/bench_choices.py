"""The choice of a texture of the catalogue, under the finger with which the page begins, to the first block.

Model: every third texture is opened for a hand, first into an empty folder of kept files, then once more with new
    caches, as after a restart. Kernels are loaded. Times are processor times of this process.
Limits: what the service, the network and a browser add is not included.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import process_time

from synth.response.kept_files import KeptFiles
from synth.response.response_cache import ResponseCache
from synth.scene.catalogue import FINGER, CatalogueEntry, catalogue
from synth.scene.scene import parse_scene
from synth.voice.hand_voice import HandVoice
from tests.bench.timing import Figure, figure

SECONDS, BLOCK = 0.3, 480
KINDS = "sinusoid", "grating", "rough", "dots"


def figures(quick: bool) -> list[Figure]:
    """Return the lines of first and later choices; quick: of two textures."""
    chosen = catalogue()[:: 50 if quick else 3]
    for kind in KINDS:
        HandVoice(parse_scene({"finger": FINGER, "texture": {"kind": kind}}), cache=ResponseCache())  # loads kernels
    with tempfile.TemporaryDirectory() as name:
        first, later = ([opened(entry, Path(name)) for entry in chosen] for _ in range(2))
    how = f"{len(chosen)} textures, processor time"
    return [
        figure("choice of a texture, first", first, "s", None, f"{how}; largest {max(first):.2f} s"),
        figure("choice of a texture, kept", later, "s", SECONDS, f"{how}; largest {max(later):.2f} s"),
    ]


def opened(entry: CatalogueEntry, folder: Path) -> float:
    """Return the processor time (s) from the scene to the first block."""
    scene, began = parse_scene({"finger": FINGER, **entry.document}), process_time()
    HandVoice(scene, cache=ResponseCache(files=KeptFiles(folder))).render(BLOCK)
    return process_time() - began
