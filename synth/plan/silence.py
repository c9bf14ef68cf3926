"""Find out why a scene is silent, before anything is solved.

Stage   2 (PLAN), used by `prepare`. A finger that moves too little is found later (`channels`).
"""

from __future__ import annotations

from synth.contact.geometry import Geometry
from synth.motion.scan_motion import ScanMotion
from synth.plan.request import Request, harmonics_in_band
from synth.scene.output_section import BAND, FULL_BAND
from synth.scene.texture_registry import DEFAULT

RESTS = "The finger rests while the output lasts, so its quantities do not change."


def silence_of(asked: Request, geometry: Geometry) -> str:
    """Return why the finger of the request does not move at all, or ""."""
    if geometry.texture_amplitude == 0.0:
        named = " (texture.amplitude is 0 m)" if asked.scene.texture.kind == DEFAULT else ""
        return f"The texture has no height{named}, so the finger does not move up and down."
    if asked.scene.scan.load == 0.0:
        return "The finger does not touch the texture (the load is 0 N), so it does not move."
    motion = ScanMotion(asked.scene, whole=asked.live)
    low, high = motion.load_range()
    rests = asked.scene.scan.trajectory is not None and motion.fastest() == 0.0 and low == high
    return RESTS if rests and 0 not in asked.orders and not asked.by_hand and not asked.scene.effects else ""


def above_band(asked: Request) -> str:
    """Return what `beyond_band` does; "" for a moving scan, which has lower speeds."""
    return "" if asked.highest > 0 else beyond_band(asked)


def beyond_band(asked: Request) -> str:
    """Return the sentence that every harmonic is above the band at the scan's own speed, or ""."""
    output = asked.scene.output
    if harmonics_in_band(asked.scene, 1):
        return ""
    text = (
        f"Every harmonic is above the band: u / lambda2 is {abs(asked.turns):.6g} Hz, "
        f"and only harmonics below {output.band_limit:.6g} Hz are rendered."
    )
    if abs(asked.turns) < BAND * output.sample_rate and output.bandwidth != FULL_BAND:
        text += ' Write output.bandwidth "full" for the whole band of the sample rate.'
    return text
