"""The discretisation of a force, which is that of its contact.

Stage   CONTACT, used by `forces` and `area_forces`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self


@dataclass(frozen=True, slots=True)
class ForceDiscretisation:
    """Base class of forces. Its members mean what they mean for a contact.

    contact: gives z and the pressure.
    """

    contact: Any

    @property
    def settles(self) -> float:
        """The value of its contact."""
        return float(self.contact.settles)

    @property
    def begins(self) -> float:
        """The value of its contact."""
        return float(self.contact.begins)

    @property
    def refines(self) -> bool:
        """The value of its contact."""
        return bool(self.contact.refines)

    def refined(self) -> Self | None:
        """Return the force on a finer discretisation; None where its contact has none."""
        return self._on(self.contact.refined())

    def halved(self) -> Self | None:
        """Return the force on one twice as fine; None where its contact has none."""
        return self._on(self.contact.halved())

    def doubled(self) -> Self | None:
        """Return the force on one half as fine; None where its contact has none."""
        return self._on(self.contact.doubled())

    def _on(self, contact: Any) -> Self | None:
        return None if contact is None else replace(self, contact=contact)
