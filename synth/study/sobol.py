"""Sobol indices of a study whose scenes are drawn by `saltelli`.

Stage   STUDY.
Source  Saltelli et al. (2010), Comput. Phys. Commun. 181, as scipy.stats.sobol_indices has it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synth.arrays import Array

RESAMPLES, SEED = 400, 7  # of the bootstrap


def indices_of(answer: Array, parameters: int) -> tuple[Any, Any]:
    """Return the Sobol indices of `answer`, in the order of the sample, and their bootstrap (`confidence_interval`)."""
    from scipy.stats import sobol_indices

    sets = answer.reshape(parameters + 2, -1)
    sources = {"f_A": sets[:1], "f_B": sets[1:2], "f_AB": sets[2:, np.newaxis]}
    found = sobol_indices(func=sources, n=sets.shape[1])
    np.random.seed(SEED)  # `bootstrap` of the result takes no other generator
    return found, found.bootstrap(n_resamples=RESAMPLES)
