"""The catalogue: named textures, each with the source of its numbers.

On the command line a name can replace a scene file. In a scene it can be the value of `texture.kind`. The height in a
name is the distance from valley to crest, twice the amplitude of eq. 2.

Source: an entry whose period is the subject of a published experiment cites it. The other values were chosen, and the
entry states that. No height is measured.
Limits: every entry is a sinusoid, as in Fagiani & Barbieri 2016, eq. 2; machined gratings have flatter tops.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass

from synth.errors import Fault, SceneError, shown

_BENSMAIA = "Bensmaia & Hollins 2003 (PMC2074877)"
_OWN_TABLE = "this project's own table of worked magnitudes (computed, not measured)"
_CHOSEN_HEIGHT = "height chosen for this catalogue (no source)"


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """A named texture.

    name: the name that a scene or the command line writes.
    title: one line for a list of textures.
    document: a partial scene with the texture section.
    source: the source of each number.
    """

    name: str
    title: str
    document: dict[str, dict[str, str]]
    source: str


_GRATINGS: tuple[tuple[str, str, dict[str, str], str], ...] = (
    (
        "grating-100um-10um",
        "Fine: at the lower end of what is felt as a pattern",
        {"period": "100 um", "amplitude": "5 um"},
        f"period: elements above 100 um are felt through a spatial mechanism too, {_BENSMAIA}; {_CHOSEN_HEIGHT}",
    ),
    (
        "grating-200um-20um",
        "The duplex boundary: finer ones are felt by vibration alone",
        {"period": "200 um", "amplitude": "10 um"},
        f"period: below 200 um roughness follows Pacinian-weighted vibration power, {_BENSMAIA}; {_CHOSEN_HEIGHT}",
    ),
    (
        "grating-250um-31um",
        "Half the usual ridge period: locks to the ridges, second harmonic of them",
        {"period": "250 um", "roughness": "10 um"},
        f"period and Ra 10 um: {_OWN_TABLE}",
    ),
    (
        "grating-400um-30um",
        "Between the locked periods: a quiet one",
        {"period": "400 um", "amplitude": "15 um"},
        "chosen for this catalogue to cover periods just below the ridge period (no source)",
    ),
    (
        "grating-500um-40um",
        "The usual ridge period: the strongest locking",
        {"period": "500 um", "amplitude": "20 um"},
        "period: equal to the usual ridge period of about 0.5 mm, Handbook of Fingerprint Recognition 2009, ch. 3"
        f" (doi 10.1007/978-1-84882-254-2_3); {_CHOSEN_HEIGHT}",
    ),
    (
        "grating-800um-40um",
        "The texture of the default scene",
        {"period": "800 um", "amplitude": "20 um"},
        "chosen for this catalogue to cover the default scene, whose period locks to no ridge period (no source)",
    ),
    (
        "grating-1mm-31um",
        "Twice the usual ridge period: locks to the ridges",
        {"period": "1 mm", "roughness": "10 um"},
        f"period and Ra 10 um: {_OWN_TABLE}",
    ),
    (
        "grating-2mm-157um",
        "Coarse and deep: felt as a pattern as much as a vibration",
        {"period": "2 mm", "roughness": "50 um"},
        f"period and Ra 50 um: {_OWN_TABLE}",
    ),
    (
        "grating-5mm-200um",
        "Two periods in a usual contact length",
        {"period": "5 mm", "amplitude": "100 um"},
        "chosen for this catalogue to cover periods of the order of the contact length (no source)",
    ),
    (
        "grating-20mm-400um",
        "Longer than the contact: the finger rides up and down the profile",
        {"period": "20 mm", "amplitude": "200 um"},
        "chosen for this catalogue to cover periods beyond the contact length (no source)",
    ),
)


def catalogue() -> tuple[CatalogueEntry, ...]:
    """Return every entry, finest first. Each call returns new documents: changing one does not affect other callers."""
    return tuple(
        CatalogueEntry(name, title, {"texture": {"kind": "sinusoid", **texture}}, source)
        for name, title, texture, source in _GRATINGS
    )


def catalogue_names() -> tuple[str, ...]:
    """Return the name of every entry, finest first."""
    return tuple(row[0] for row in _GRATINGS)


def lookup(name: str) -> CatalogueEntry:
    """Return the entry called `name`. If there is none, raise SceneError with the nearest name."""
    for entry in catalogue():
        if entry.name == name:
            return entry
    near = difflib.get_close_matches(name[:64], catalogue_names(), n=1, cutoff=0.0)
    hint = f'The nearest name is "{near[0]}".'
    raise SceneError([Fault("", shown(name), f"a catalogue name: {', '.join(catalogue_names())}", hint)])
