"""How a study draws its scenes, where they are not every combination of the axes, and the Sobol indices of a sample.

Stage   STUDY, used by `spec`.
Model   {"kind": "latin_hypercube" | "sobol", "count": n, "seed": 0}: n scenes between the ends of each axis.
        {"kind": "saltelli", "count": n, "seed": 0}: n (d + 2) scenes of d axes, from which Sobol indices follow. Two
        sets of n scenes, A and B, come first; then for each axis the set A with that axis as in B.
        {"kind": "points"}: scene m has the mth value of every axis.
Source  scipy.stats.qmc and sobol_indices; the design: Saltelli et al. (2010), Comput. Phys. Commun. 181.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from synth.arrays import Array
from synth.errors import Fault, SceneError, shown

FIELDS = ("kind", "count", "seed")
KINDS, POINTS, SALTELLI = ("latin_hypercube", "sobol", "saltelli"), "points", "saltelli"
LARGEST = 1 << 31
RESAMPLES, SEED = 400, 7  # of the bootstrap


@dataclass(frozen=True, slots=True)
class Sample:
    """How scenes are drawn between the ends of the axes; with POINTS, how many values each axis has."""

    kind: str
    count: int
    seed: int

    def scenes(self, axes: int) -> int:
        """Return the number of scenes of a study with `axes` axes."""
        return self.count * (axes + 2) if self.kind == SALTELLI else self.count

    def drawn(self, axes: int) -> Array:
        """Return the samples [scenes, axes], each from 0 to 1."""
        from scipy.stats import qmc

        if self.kind == "latin_hypercube":
            return np.asarray(qmc.LatinHypercube(axes, seed=self.seed).random(self.count))
        sets, power = (2 if self.kind == SALTELLI else 1), math.ceil(math.log2(self.count))
        drawn = np.asarray(qmc.Sobol(sets * axes, seed=self.seed).random_base2(power)[: self.count])
        if self.kind != SALTELLI:
            return drawn
        first, second = drawn[:, :axes], drawn[:, axes:]
        mixed = [np.where(np.arange(axes) == one, second, first) for one in range(axes)]
        return np.concatenate([first, second, *mixed])


def read_sample(written: object) -> Sample | None:
    """Return how scenes are drawn, as a spec writes it; None for every combination. Raises SceneError."""
    if written is None:
        return None
    if not isinstance(written, Mapping) or any(name not in FIELDS for name in written):
        hint = 'Write {"kind": "latin_hypercube", "count": 1000, "seed": 0}.'
        raise _refused("", written, f"null, or an object with {', '.join(FIELDS)}", hint)
    kind = written.get("kind")
    if kind == POINTS:
        for name in (one for one in ("count", "seed") if one in written):
            raise _refused(f"/{name}", written[name], "nothing with points", "The axes list every scene.")
        return Sample(POINTS, 0, 0)
    if kind not in KINDS:
        raise _refused("/kind", kind, f"{', '.join(KINDS)} or {POINTS}", "Check the spelling.")
    count = whole_number(written, "count", None, 1, LARGEST, "/sample")
    if kind == SALTELLI and count & (count - 1):
        raise _refused("/count", count, "a power of two with saltelli", f"Write {1 << count.bit_length()}.")
    return Sample(str(kind), count, whole_number(written, "seed", 0, 0, LARGEST, "/sample"))


def whole_number(
    written: Mapping[Any, Any], name: str, default: int | None, low: int, high: int, above: str = ""
) -> int:
    """Return a whole number of a spec. Raises SceneError."""
    value = written.get(name, default)
    value = default if value is None else value
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        allowed = f"a whole number from {low} to {high}"
        raise SceneError([Fault(f"{above}/{name}", shown(value), allowed, f"Write {default or 1000}.")])
    return value


def _refused(where: str, value: object, allowed: str, hint: str) -> SceneError:
    return SceneError([Fault(f"/sample{where}", shown(value), allowed, hint)])


def indices_of(answer: Array, parameters: int) -> tuple[Any, Any]:
    """Return the Sobol indices of `answer`, in the order of the sample, and their bootstrap (`confidence_interval`)."""
    from scipy.stats import sobol_indices

    sets = answer.reshape(parameters + 2, -1)
    sources = {"f_A": sets[:1], "f_B": sets[1:2], "f_AB": sets[2:, np.newaxis]}
    found = sobol_indices(func=sources, n=sets.shape[1])
    np.random.seed(SEED)  # `bootstrap` of the result takes no other generator
    return found, found.bootstrap(n_resamples=RESAMPLES)
