"""An imported texture, as the store holds it, with the fields of an entry of the catalogue."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from synth.scene.catalogue import EVERYDAY, FINGER

GROUP = "Yours"  # of the list of textures


@dataclass(frozen=True, slots=True)
class StoredTexture:
    """A texture of the store.

    kind: "profile" or "heightmap".
    report: of its import (docs/import.md).
    created: time in UTC, ISO 8601.
    """

    name: str
    address: str
    kind: str
    report: dict[str, Any]
    created: str

    @property
    def texture(self) -> dict[str, Any]:
        """The texture section of its scene; a set of maps has more fields, which its report holds."""
        return {"kind": self.kind, "surface": self.address, **self.report.get("texture", {})}

    # The fields of an entry of the catalogue

    @property
    def title(self) -> str:
        """One line for a list of textures."""
        return f"Imported from {self.report['file']}"

    @property
    def group(self) -> str:
        """Title of its group."""
        return GROUP

    @property
    def note(self) -> str:
        """What a person should know who feels it."""
        return " ".join(f"{note}." for note in self.report.get("notes", ()))

    @property
    def document(self) -> dict[str, dict[str, Any]]:
        """A partial scene with the texture section."""
        return {"texture": self.texture}

    @property
    def everyday(self) -> dict[str, dict[str, Any]]:
        """A scene in which a fingertip scans the texture."""
        scan = {field: value for field, (value, _) in EVERYDAY.items()}
        return {"finger": dict(FINGER), "texture": self.texture, "scan": scan}

    @property
    def sources(self) -> dict[str, str]:
        """Empty: a measured surface has a report in place of numbers with their sources."""
        return {}

    def description(self) -> dict[str, Any]:
        """Return the texture as a JSON document, with the fields of an entry of the catalogue (docs/http.md)."""
        return {
            "name": self.name,
            "title": self.title,
            "group": self.group,
            "note": self.note,
            "scene": self.document,
            "everyday": self.everyday,
            "numbers": {},
            "address": self.address,
            "report": self.report,
            "created": self.created,
        }
