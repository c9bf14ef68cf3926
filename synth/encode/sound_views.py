"""Show a `Sound`: in a notebook, and as an xarray object.

Stage: part of STAGE 4 (encode).
Model: the notebook view is HTML without scripts: the waveform as SVG (lowest and highest value per column), a player,
    and level and scale in words. The player's sound is normalised, so that quiet sounds are heard; the words say so.
Limits: the player has at most LONGEST_PLAYED seconds of the first two channels, because a notebook stores it as text.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np

from synth.encode.formats import SoundFormat, encode_all
from synth.encode.scaled_frames import UNSCALED, ScaledFrames
from synth.errors import CannotRender

LONGEST_PLAYED = 30.0  # s; 4 MB of text at 48 kHz
COLUMNS, HEIGHT = 600, 80
PLAYED_PEAK = 0.5  # of full scale, in the player: loud enough, and no shock
NO_XARRAY = "cannot make an xarray object: xarray is not installed. Run: pip install 'ridgewave[xarray]'."


def to_xarray(sound: ScaledFrames, scene: str | None) -> Any:
    """Return a DataArray [time] of one channel, or a Dataset of several, with units. scene: JSON text."""
    try:
        import xarray
    except ImportError as error:
        raise CannotRender(NO_XARRAY) from error
    time = ("time", sound.times, {"units": "s"})
    attributes: dict[str, Any] = {"sample_rate": sound.sample_rate}
    if scene is not None:
        attributes["scene"] = scene
    channels: dict[str, Any] = {}
    for number, (quantity, unit) in enumerate(zip(sound.quantities, sound.units, strict=True)):
        own = {"units": unit, "full_scale": sound.full_scale[number]}
        name = quantity if quantity not in channels else f"{quantity} {number + 1}"
        channels[name] = xarray.DataArray(
            sound.values[:, number], dims="time", coords={"time": time}, name=name, attrs=own | attributes
        )
    return next(iter(channels.values())) if len(channels) == 1 else xarray.Dataset(channels, attrs=attributes)


def notebook_view(sound: ScaledFrames, warnings: Sequence[str]) -> str:
    """Return the HTML of a notebook cell."""
    rows = []
    for number, (quantity, unit) in enumerate(zip(sound.quantities, sound.units, strict=True)):
        peak, rms, scale = sound.peak[number], sound.rms[number], sound.full_scale[number]
        level = f"peak {peak:.3g} {unit}, rms {rms:.3g} {unit}"
        scaled = "no scale: the samples as they are" if quantity == UNSCALED else f"1.0 in a file is {scale:.3g} {unit}"
        rows.append(f"<div>{escape(quantity)}: {level}; {scaled}</div>{_waveform(sound.values[:, number])}")
    warned = "".join(f"<div>Warning: {escape(sentence)}</div>" for sentence in warnings)
    title = f"<div><b>{sound.seconds:.6g} s at {sound.sample_rate} Hz</b></div>"
    return f'<div style="max-width:{COLUMNS}px">{title}{"".join(rows)}{_player(sound)}{warned}</div>'


def _waveform(values: np.ndarray[Any, np.dtype[np.float64]]) -> str:
    """Return an SVG of one channel, from its lowest to its highest value in each column."""
    columns = [part for part in np.array_split(values, min(COLUMNS, max(1, len(values)))) if len(part)]
    finite = [part[np.isfinite(part)] for part in columns]
    reach = max((float(np.abs(part).max(initial=0.0)) for part in finite), default=0.0) or 1.0
    middle = HEIGHT / 2
    highs = [middle - (middle - 2) * part.max(initial=-reach) / reach for part in finite]
    lows = [middle - (middle - 2) * part.min(initial=reach) / reach for part in finite]
    step = COLUMNS / max(1, len(finite))
    there = [f"{step * place:.1f},{high:.1f}" for place, high in enumerate(highs)]
    back = [f"{step * place:.1f},{low:.1f}" for place, low in reversed(list(enumerate(lows)))]
    shape = f'<polygon points="{" ".join(there + back)}" fill="#2a6fbb" stroke="#2a6fbb" stroke-width="0.7"/>'
    box = f'viewBox="0 0 {COLUMNS} {HEIGHT}" width="100%" height="{HEIGHT}" preserveAspectRatio="none"'
    return f'<svg role="img" aria-label="waveform" {box} style="background:#f4f6f8;display:block">{shape}</svg>'


def _player(sound: ScaledFrames) -> str:
    """Return an audio element of the normalised sound, and a sentence that says so."""
    frames = sound.frames[: round(LONGEST_PLAYED * sound.sample_rate), :2]
    peaks = np.abs(frames).max(axis=0, initial=0.0)
    if not len(frames) or not np.isfinite(peaks).all() or not peaks.any():
        return "<div>Nothing to play: the sound is silent.</div>"
    gain = np.where(peaks > 0.0, PLAYED_PEAK / np.where(peaks > 0.0, peaks, 1.0), 1.0)
    body = encode_all((frames * gain).astype(np.float32), SoundFormat.WAV16, sound.sample_rate)
    source = f"data:audio/wav;base64,{base64.b64encode(body).decode()}"
    decibels = ", ".join(f"{20.0 * np.log10(one):+.1f} dB" for one in gain)
    cut = f" The first {LONGEST_PLAYED:g} s." if len(frames) < len(sound.frames) else ""
    first = " The first two channels, left and right." if sound.frames.shape[1] > 2 else ""
    told = (
        f"Normalised for listening ({decibels} against a file): loudness here tells nothing of the level.{cut}{first}"
    )
    return f'<audio controls style="width:100%" src="{source}"></audio><div>{told}</div>'
