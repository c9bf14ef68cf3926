"""Typical faults of recordings: steps, jitter, gaps, pairs, reversals, lifts and landings."""

from __future__ import annotations

import numpy as np

Points = list[list[float]]


def steady(interval: float, count: int, speed: float = 0.08, load: float = 0.3) -> Points:
    """Return `count` points every `interval` (s) at one speed and load."""
    return [[interval * place, speed * interval * place, load] for place in range(count)]


def random_recording(seed: int) -> Points:
    """Return a recording of 0.05 to 0.4 s with up to four faults; the same seed gives the same recording."""
    draw = np.random.default_rng(seed)
    interval = float(draw.choice([1e-3, 4e-3, 8e-3, 2e-2]))
    count = int(draw.integers(4, max(5, min(100, int(0.4 / interval)))))
    times = interval * np.arange(count) + (draw.uniform(0.0, 0.05) if draw.integers(2) else 0.0)
    places = draw.uniform(-0.15, 0.15) * times
    loads = draw.uniform(0.1, 2.0) * (1.0 + 0.3 * np.sin(draw.uniform(1.0, 40.0) * times))
    for trouble in draw.choice(8, size=int(draw.integers(0, 5)), replace=False):
        at = int(draw.integers(1, count - 1))
        if trouble == 0:  # a step of the load
            loads[at:] *= draw.choice([0.1, 0.5, 3.0])
        elif trouble == 1:  # positions of a mouse
            places = np.round(places, 4)
        elif trouble == 2:  # rough time stamps, all in order
            times = np.sort(times + draw.uniform(-0.49, 0.49, count) * interval)
        elif trouble == 3:  # a gap in which the finger rests
            times[at:] += draw.uniform(0.05, 0.2)
        elif trouble == 4:  # a reversal
            places[at:] = 2.0 * places[at] - places[at:]
        elif trouble == 5:  # off the surface, and down again
            loads[at : at + 3] = 0.0
        elif trouble == 6:  # a report that comes twice, 2 us to 0.2 ms later
            late = 10.0 ** draw.uniform(-5.7, -3.7)
            times, places = (
                np.insert(times, at + 1, times[at] + late),
                np.insert(places, at + 1, places[at] + 5.0 * late),
            )
            loads = np.insert(loads, at + 1, loads[at] * draw.choice([1.0, 2.0]))
            count += 1
        else:  # the finger comes down with the first point and leaves with the last
            loads[0] = loads[-1] = 0.0
    keep = np.concatenate([[True], np.diff(times) > 1e-6])
    times, places, loads = times[keep] - min(0.0, float(times[0])), places[keep], loads[keep]
    fastest = float(np.max(np.abs(np.diff(places)) / np.diff(times)))
    places *= min(1.0, 9.9 / max(fastest, 1e-9))
    found: Points = np.stack([times, places, np.clip(loads, 0.0, 20.0)], axis=1).tolist()
    return found
