"""A prepared scene: what was solved and chosen for it, as one frozen value that the plan tells and voices share.

Stage   2 (PLAN). `prepare` makes it.
Source  design, section 4.
"""

from __future__ import annotations

from dataclasses import dataclass

from synth.contact.load_balance import Contact
from synth.effects.effect import AddedChannel
from synth.plan.channels import ChannelPlan, SteadyScan
from synth.plan.direct_plan import DirectPlan
from synth.plan.effects_preparation import PreparedEffects
from synth.plan.frame_plan import FramePlan
from synth.plan.request import Request
from synth.response.demand import Complex
from synth.response.mean_approach import Mean
from synth.response.spectrum import Spectrum
from synth.response.table import ResponseTable


@dataclass(frozen=True, slots=True)
class Preparation(Request):
    """A solved scene.

    tolerance: tolerance as a number.
    warnings: sentences.
    contact: the contact; on a long surface that of its stretch. None if nothing is solved.
    on_surface: the contact on the whole of a long surface; None otherwise.
    spectrum: series of z at the scan's load; None if the scene is silent.
    channels: plans of the channels.
    silence: why the scene is silent, or "".
    mean: mean of z over a period (m), over the cube root of the load (N^(1/3)). It is None unless the scan moves, and
        its own motion determines the full scale, the surface is long, or the scene has an approach channel.
    frames: how a moving scan is solved; None if a table is read.
    table: table that a moving voice reads, or None.
    direct: how a moving voice is solved directly, or None.
    effects: the prepared effects; None if the scene has none.
    """

    tolerance: float
    warnings: tuple[str, ...] = ()
    contact: Contact | None = None
    on_surface: Contact | None = None
    spectrum: Spectrum | None = None
    channels: tuple[ChannelPlan, ...] = ()
    silence: str = ""
    mean: Mean | None = None
    frames: FramePlan | None = None
    table: ResponseTable | None = None
    direct: DirectPlan | None = None
    effects: PreparedEffects | None = None

    @property
    def all_channels(self) -> tuple[ChannelPlan | AddedChannel, ...]:
        """The channels of the response, then those that effects add."""
        return self.channels if self.effects is None else (*self.channels, *self.effects.channels)

    @property
    def simulated(self) -> bool:
        """True if a simulation replaces the response."""
        return self.effects is not None and self.effects.simulation is not None

    @property
    def stepped(self) -> bool:
        """True if a simulation is run step by step, instead of being read from the series of its period."""
        plan = None if self.effects is None else self.effects.simulation
        return plan is not None and not plan.of_series

    @property
    def steady(self) -> SteadyScan:
        """The scan's own speed and load, of a scene that is not silent."""
        assert self.spectrum is not None
        return SteadyScan(*self.request, self.spectrum)

    def series(self, order: int) -> Complex:
        """Return the series of a quantity at the scan's own speed and load (SI), of a scene that is not silent.

        It is that of the simulation if there is one whose motion repeats.
        """
        plan = None if self.effects is None else self.effects.simulation
        found = None if plan is None else plan.series(order)
        return self.steady.series(order) if found is None else found

    @property
    def whole(self) -> Contact:
        """The contact on the whole surface, of a scene that is not silent."""
        found = self.on_surface or self.contact
        assert found is not None
        return found
