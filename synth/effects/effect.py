"""What an effect does beyond being named: the three ways in which a physical cause enters a render.

Stage   2 and 3. `effect_choice` asks for reasons and estimates, `preparation` for what is solved, `voice` alone steps.
Model   All of the model is one balance, m z'' + c z' = sum of the pressure over the contact - w, and what is read from
        it. An effect is of one of three kinds, which run in this order:
        SHAPE     puts another contact in the place of the contact: where it touches, and how deep. Still solved once.
        BALANCE   replaces a term of the balance (`simulation.terms`): mass, damping, the law of the pressure. z is then
                  simulated step by step, by one simulation for all such effects together.
        OUTPUT    reads what is there and adds channels, or changes those before it, block by block.
        Effects of one kind follow each other in the order of their names. Two that
        replace the same thing are refused (`Declaration.replaces`); everything else combines, each acting on what
        those before it left.
Source  style: reason, prepare, start, step; kinds SHAPE and BALANCE have no step of their own, since a contact has one
        response and a finger one balance, however many effects take part.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from synth.effects.simulation.terms import Terms
from synth.scene.scene import Scene
from synth.scene.section import Section

if TYPE_CHECKING:
    from synth.arrays import Array, Block
    from synth.contact.load_balance import Contact
    from synth.effects.simulation.running import Signal
    from synth.motion.motion import Motion
    from synth.response.response_cache import ResponseCache

Solved = TypeVar("Solved")


class Kind(IntEnum):
    """Where an effect enters, in the order of the stages."""

    SHAPE = 0
    BALANCE = 1
    OUTPUT = 2


@dataclass(frozen=True, slots=True)
class Price:
    """What a voice costs with this effect alone in the default scene: ns a frame in blocks of 480 at 48 kHz, and bytes.

    `python -m tests.bench effects` measured both, once, on the machine of docs/benchmarks.md. Only ever told to people:
    nothing is decided by it.
    """

    ns_per_frame: float
    memory_bytes: int


class Effect(ABC):
    """One physical cause, as `effects_section.Declaration` says.

    kind: how it enters.
    price: what it costs, roughly.
    """

    name: str
    summary: str
    settings: type[Section]
    kind: Kind
    price: Price
    replaces: str = ""
    without_auto: str = ""
    lowest_load: float = 0.0
    units: Mapping[str, str] = MappingProxyType({})

    def added(self, settings: Any) -> int:
        """Return how many channels it adds."""
        return 0

    def clash(self, settings: Any, others: Mapping[str, Any]) -> tuple[str, str] | None:
        """Return what is allowed and what to write instead, where these settings cannot go with the other effects."""
        return None

    @abstractmethod
    def reason(self, scene: Scene, settings: Any) -> str:
        """Return what is simulated with these settings, a sentence for the plan."""


class ShapeEffect(Effect):
    """Puts another contact in the place of the scene's."""

    kind = Kind.SHAPE

    @abstractmethod
    def shaped(self, contact: Contact, settings: Any) -> Contact:
        """Return the contact with the effect; raises CannotRender where it cannot be."""


class BalanceEffect(Effect):
    """Replaces a term of the balance."""

    kind = Kind.BALANCE

    @abstractmethod
    def balanced(self, terms: Terms, settings: Any) -> Terms:
        """Return the terms with those of the effect."""


class OutputEffect(Effect, Generic[Solved]):
    """Adds channels, or changes those that are there. It has no "auto": there is nothing that it would change.

    Solved: the prepared scene that its stage is made of, which later stages define.
    """

    kind = Kind.OUTPUT

    @abstractmethod
    def channels(self, settings: Any) -> tuple[str, ...]:
        """Return the quantities of the channels that it adds, in order; `units` has the unit of each."""

    def added(self, settings: Any) -> int:
        """See `Effect`."""
        return len(self.channels(settings))

    @abstractmethod
    def scales(self, settings: Any) -> tuple[float | None, ...]:
        """Return the full scale that the settings ask for, of each channel that it adds."""

    @abstractmethod
    def scaled(self, settings: Any, full_scale: tuple[float | None, ...]) -> Any:
        """Return the settings with the full scale of each channel that it adds."""

    @abstractmethod
    def prepare(self, solved: Solved, settings: Any, cache: ResponseCache) -> OutputStage:
        """Return what its voices share; cache: of responses."""


@dataclass(frozen=True, slots=True)
class AddedChannel:
    """A channel that an effect adds: full_scale (SI value of 1.0), peak-to-peak and error at the scan's own speed and
    load, as of `channels.ChannelPlan`; method: how it is computed, in words.
    """

    quantity: str
    full_scale: float
    extent: float
    error: float
    method: str


class OutputStage(Protocol):
    """An output effect made ready for one scene; frozen."""

    @property
    def channels(self) -> tuple[AddedChannel, ...]:
        """The channels that it adds."""

    @property
    def signals(self) -> tuple[Signal, ...]:
        """What it wants of a simulation where one runs: `Passage.signals` brings frames of it, in this order."""

    @property
    def memory_bytes(self) -> int:
        """Bytes that it holds."""

    def louder(self, times: float) -> OutputStage:
        """Return it with every full scale that is not asked for so many times as large."""

    def start(self, phase: int) -> Any:
        """Return the state of a voice whose texture stands at `phase` (a 64-bit fraction of a turn) at frame 0."""

    def begin_at(self, state: Any, phase: int) -> None:
        """Have the texture stand at `phase` at frame 0 of a state that has not stepped."""

    def delay(self, state: Any) -> int:
        """Return the frames by which what follows a hand is late, beside a simulation's."""
        return 0

    def step(self, state: Any, passage: Passage, block: Block) -> None:
        """Write its channels of `block`, float32 [frames, channels]; it may change those before them.

        Those that it added begin at `passage.column`.
        """


@dataclass(frozen=True, slots=True)
class Passage:
    """What passes in one block.

    frame: the first, of a scan. phase, step: where the texture stands there and how far it moves a frame (64-bit
    fractions of a turn), where the scan is constant; motion: what the finger does, otherwise; by_hand: it is a hand's.
    signals: float64 [signals, frames] of a simulation; late: frames by which these are late behind a hand. column: the
    first channel of the effect.
    """

    frame: int
    phase: int
    step: int
    motion: Motion | None
    by_hand: bool
    signals: Array | None
    late: int
    column: int
