"""The interface of effects: the four ways in which a physical cause enters a render.

Stage   2 and 3. `effect_choice` reads reasons and estimates, `prepare` solves, and only `voice` steps.
Model   The whole model is one balance, m z'' + c z' = sum of the pressure over the contact - w, and the outputs read
        from it. An effect is of one of four kinds, which run in this order:
        MOTION    moves the skin in place of the hand (`motion.moved_skin`). Everything after it reads that motion. It
                  adds channels as an OUTPUT effect does, which sound on a smooth surface too.
        SHAPE     replaces the contact: where it touches, and how deep. The new contact is still solved once.
        BALANCE   replaces a term of the balance (`simulation.terms`): mass, damping, or the law of the pressure. z is
                  then simulated step by step, by one simulation for all such effects together.
        OUTPUT    reads the result and adds channels, or changes the channels before them, block by block.
        Within a kind, effects run in the order of their names. Two effects that replace the same thing are refused
        together (`Declaration.replaces`); of two on "auto" the larger is taken. All others combine: each acts on the
        result of those before it.
Source  The design has reason, prepare, start and step. Kinds SHAPE and BALANCE have no step of their own: a contact has
        one response and a finger one balance, however many effects take part.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from synth.effects.simulation.terms import Terms
from synth.scene.finger_section import STRAIGHT
from synth.scene.scene import Scene
from synth.scene.section import Section

if TYPE_CHECKING:
    from synth.arrays import Array, Block
    from synth.contact.load_balance import Contact
    from synth.effects.simulation.running import Signal
    from synth.motion.motion import Motion
    from synth.motion.moved_skin import Mover
    from synth.response_cache import ResponseCache

Solved = TypeVar("Solved")


class Kind(IntEnum):
    """How an effect enters the model, in the order in which kinds run."""

    MOTION = 0
    SHAPE = 1
    BALANCE = 2
    OUTPUT = 3


@dataclass(frozen=True, slots=True)
class Price:
    """Cost of a voice with this effect alone, in the default scene along a stroke, for people to read.

    No decision depends on it. `python -m tests.bench effects` measured both once (docs/benchmarks.md).

    ns_per_frame: processor time, in blocks of 480 frames at 48 kHz.
    memory_bytes: memory of the voice.
    """

    ns_per_frame: float
    memory_bytes: int


class Effect(ABC):
    """One physical cause. `effects_section.Declaration` explains the attributes that are not listed here.

    kind: how it enters the model.
    price: its rough cost.
    """

    name: str
    summary: str
    settings: type[Section]
    kind: Kind
    price: Price
    replaces: str = ""
    without_auto: str = ""
    lowest_load: float = 0.0
    fingers: tuple[str, ...] = STRAIGHT
    why_fingers: str = ""
    units: Mapping[str, str] = MappingProxyType({})

    def added(self, settings: Any) -> int:
        """Return the number of channels that the effect adds."""
        return 0

    def mover(self, scene: Scene, settings: Any, *, by_hand: bool) -> Mover | None:
        """Return what moves the skin in place of the hand, or None. `settings` may be "auto".

        by_hand: whether a hand sets the motion, instead of the scan.
        """
        return None

    def clash(self, settings: Any, others: Mapping[str, Any]) -> tuple[str, str] | None:
        """If these settings conflict with another effect, return what is allowed and what to write instead."""
        return None

    @abstractmethod
    def reason(self, scene: Scene, settings: Any) -> str:
        """Return a sentence for the plan: what is simulated with these settings."""


class ShapeEffect(Effect):
    """Replaces the contact of the scene.

    moves_ends: whether the ends of the contact move with the load.
    """

    kind = Kind.SHAPE
    moves_ends: bool = False

    @abstractmethod
    def shaped(self, contact: Contact, settings: Any) -> Contact:
        """Return the contact with the effect. Raise SceneError if there is no such contact."""


class BalanceEffect(Effect):
    """Replaces a term of the balance.

    needs_fixed_ends: whether it needs a contact whose ends do not move with the load.
    """

    kind = Kind.BALANCE
    needs_fixed_ends: bool = False

    @abstractmethod
    def balanced(self, terms: Terms, settings: Any) -> Terms:
        """Return `terms` with those of the effect in place."""


class OutputEffect(Effect, Generic[Solved]):
    """Adds channels, or changes the channels before them. Has no "auto": there is no difference to measure.

    Solved: type of the prepared scene, which later stages define.
    has_table: whether a moving voice reads a table of the effect's own.
    """

    kind = Kind.OUTPUT
    has_table = False

    @abstractmethod
    def channels(self, scene: Scene, settings: Any) -> tuple[str, ...]:
        """Return the quantities of the added channels, in order; `units` has the unit of each.

        Raises SceneError if the effect reads a channel that `scene` does not have.
        """

    def added(self, settings: Any) -> int:
        """See `Effect`."""
        return len(self.scales(settings))

    def reads_across(self, settings: Any) -> bool:
        """Return whether it reads the force of the slopes along y, which only points over an area have."""
        return False

    @abstractmethod
    def scales(self, settings: Any) -> tuple[float | None, ...]:
        """Return the full scale that the settings give each added channel; None: not given."""

    @abstractmethod
    def scaled(self, settings: Any, full_scale: tuple[float | None, ...]) -> Any:
        """Return the settings with the full scale of each added channel."""

    @abstractmethod
    def prepare(self, solved: Solved, settings: Any, cache: ResponseCache) -> OutputStage:
        """Return the stage that all voices of the scene share.

        solved: the prepared scene, with its channels as a voice has them, errors included.
        cache: solved responses.
        """


class MotionEffect(OutputEffect[Solved]):
    """Moves the skin in place of the hand, and adds channels. They sound also where z is silent.

    replaces: all of them replace the motion of the skin.
    """

    kind = Kind.MOTION
    replaces = "the motion of the skin"

    @abstractmethod
    def mover(self, scene: Scene, settings: Any, *, by_hand: bool) -> Mover | None:
        """See `Effect`; None where "auto" leaves the effect out."""

    @abstractmethod
    def told(self, scene: Scene, settings: Any, *, by_hand: bool) -> dict[str, Any]:
        """Return what the plan tells of the motion, as JSON: numbers and sentences by name.

        "reason" is a sentence. At the scan's own speed and load, "place_error" is the error of the places of the skin
        (m), and "force_error", if there is a force, that of the force at any time, relative to its peak-to-peak.
        """


@dataclass(frozen=True, slots=True)
class AddedChannel:
    """A channel that an effect adds.

    quantity: name of the quantity.
    full_scale: SI value of a sample of 1.0.
    extent: peak-to-peak at the scan's own speed and load, as in `channels.ChannelPlan`; 0 if the channel is silent.
    error: largest error relative to that peak-to-peak.
    method: how the channel is computed, in words.
    unfelt: error below which nobody is warned, whatever the tolerance.
    work: measured processor time of a second of sound (s), of what is solved live for this channel and those beside it.
    of_own_motion: whether the full scale is the peak of all frames of a file, before its fades.
    """

    quantity: str
    full_scale: float
    extent: float
    error: float
    method: str
    unfelt: float = 0.0
    work: float = 0.0
    of_own_motion: bool = False


class OutputStage(Protocol):
    """An output effect prepared for one scene; frozen."""

    @property
    def channels(self) -> tuple[AddedChannel, ...]:
        """The added channels."""

    @property
    def signals(self) -> tuple[Signal, ...]:
        """Signals that it reads if a simulation runs. `Passage.signals` has their frames, in this order."""

    def louder(self, times: float, moved: tuple[float, ...]) -> OutputStage:
        """Return the stage with larger full scales, where the scene does not set them, for the motions of a hand.

        times: ratio of the largest usual load to that of the scan.
        moved: ratio of the peak of a usual hand to that of the scan, for each channel of the scene.
        """

    def start(self, phase: int) -> Any:
        """Return the state of a voice whose texture is at `phase` (a 64-bit fraction of a turn) at frame 0."""

    def begin_at(self, state: Any, phase: int) -> None:
        """Set the phase of the texture at frame 0, in a state that has not stepped."""

    def delay(self, state: Any) -> int:
        """Return the delay behind a hand in frames, if the stage has a reader of its own."""
        return 0

    def step(self, state: Any, passage: Passage, block: Block) -> None:
        """Write the added channels of `block`, float32 [frames, channels], from column `passage.column` on.

        May also change the channels before them.
        """


@dataclass(frozen=True, slots=True)
class Passage:
    """The input of an output effect for one block.

    frame: first frame of the block, counted from the start of the scan.
    phase: phase of the texture at that frame (64-bit fraction of a turn), in a constant scan.
    step: change of the phase per frame (64-bit fraction of a turn), in a constant scan.
    motion: motion of the finger, in any other scan.
    by_hand: whether the motion is that of a hand.
    signals: float64 [signals, frames] of a simulation, if one runs.
    late: delay of the signals, and of the channels of the scene, behind a hand, in frames. A channel that is made from
        `motion` is delayed by it, to stay in time with the others (`voice.table_reading.delayed`).
    column: index of the effect's first channel.
    full_scale: SI value of 1.0 in each channel of the scene; these channels come first in the block.
    """

    frame: int
    phase: int
    step: int
    motion: Motion | None
    by_hand: bool
    signals: Array | None
    late: int
    column: int
    full_scale: tuple[float, ...]
