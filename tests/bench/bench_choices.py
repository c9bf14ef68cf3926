"""The time from the choice of a texture, under the finger with which the page begins, to the first block.

Model: every third texture of the catalogue is opened for a hand, first into an empty folder of kept files, then in
    another process, as after a restart. A random profile of 10 mm and random maps of 10 mm x 10 mm are imported and
    solved ahead, as the service does after an import, then opened in other processes, as the page and as `/vr` open
    them. Kernels are loaded. Times are processor times.
Limits: the time that the service, the network and a browser add is not included.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from service.compute.texture_preparation import SCANS, solve_ahead
from service.store.data_folder import tables_folder
from service.store.store import Quota, Store
from synth.kept_files import KeptFiles
from synth.response_cache import ResponseCache
from synth.scene.catalogue import FINGER, catalogue
from synth.scene.scene import parse_scene
from synth.surfaces.surface_data import SurfaceData, add_source
from synth.voice.hand_voice import HandVoice
from tests.bench.timing import Figure, figure

SECONDS, BLOCK = 0.3, 480
KINDS = "sinusoid", "grating", "rough", "dots"
IMPORTED = (("profile", (2000,)), ("heightmap", (500, 500)), ("heightmap", (2000, 2000)))  # kinds, and points
SIZE = 10e-3  # m


def figures(quick: bool) -> list[Figure]:
    """Return the lines of first and later choices; quick: of two textures, and of fewer imported ones."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of the fresh processes, as of the service
    documents = [entry.document for entry in catalogue()[:: 50 if quick else 3]]
    with tempfile.TemporaryDirectory() as name:
        first, later = opened(documents, Path(name)), opened_afresh(documents, Path(name))
    how = f"{len(documents)} textures, processor time"
    lines = [
        figure("choice of a texture, first", first, "s", None, f"{how}; largest {max(first):.2f} s"),
        figure("choice of a texture, kept", later, "s", SECONDS, f"{how}; largest {max(later):.2f} s"),
    ]
    for kind, points in IMPORTED[: 2 if quick else 3]:
        with tempfile.TemporaryDirectory() as name:
            texture, began = imported(kind, points, Path(name)), process_time()
            solve_ahead(texture, Path(name))
            ahead = process_time() - began
            times = [opened_afresh([texture | scan], Path(name))[0] for scan in SCANS for _ in range(1 if quick else 3)]
        how = f"{' x '.join(map(str, points))} points, after {ahead:.1f} s ahead"
        lines.append(figure(f"choice of an imported {kind}", times, "s", SECONDS, how))
    return lines


def imported(kind: str, points: tuple[int, ...], folder: Path) -> dict[str, Any]:
    """Keep a random surface with waves of 20 um to 10 mm, 8 um rms, in the data folder; return its partial scene."""
    hertz = np.sqrt(sum(np.meshgrid(*(np.fft.fftfreq(count, SIZE / count) ** 2 for count in points))))
    sizes = np.where(hertz > 0.0, np.maximum(hertz, 1.0) ** (-0.8 - 0.5 * len(points)), 0.0)
    sizes[hertz > 5e4] = 0.0
    heights = np.fft.ifftn(sizes * np.exp(2j * np.pi * np.random.default_rng(1).random(points))).real
    surface = SurfaceData((8e-6 / np.std(heights) * heights).astype(np.float32), tuple(SIZE / n for n in points))
    store = Store(folder)
    add_source(store.surface)
    return store.keep("", "surface", surface, kind, {"file": kind}, Quota()).document


def opened_afresh(textures: Sequence[dict[str, Any]], folder: Path) -> list[float]:
    """Return what `opened` does, in a fresh process."""
    with ProcessPoolExecutor(1, get_context("spawn")) as fresh:
        return fresh.submit(opened, textures, folder).result()


def opened(textures: Sequence[dict[str, Any]], folder: Path) -> list[float]:
    """Return the processor time (s) from each partial scene to the first block, with the data folder `folder`."""
    add_source(Store(folder).surface)
    files, times = KeptFiles(tables_folder(folder)), []
    for kind in KINDS:  # loads kernels
        HandVoice(parse_scene({"finger": FINGER, "texture": {"kind": kind}}), cache=ResponseCache(files=files))
    for texture in textures:
        began = process_time()
        HandVoice(parse_scene({"finger": FINGER, **texture}), cache=ResponseCache(files=files)).render(BLOCK)
        times.append(process_time() - began)
    return times
