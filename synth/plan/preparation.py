"""What a scene needs to sound, solved once: the series of its response, its full scale, its tables, and what they hold.

Stage   2, the part that calculates; `plan` tells it to people.
Model   Harmonics below 0.40 of the rate (and below the bandwidth) at the scan's speed are kept. The tolerance is
        shared: ALIAS_SHARE for the series; what that leaves, for the harmonics cut off and the reader (`channels`); the
        rest is the rounding to float32. A scan that moves is solved along its motion (`frame_plan`), or, by hand and
        where blocks have deadlines, read from the response table.
Source  design, section 4.
Limits  no more than N_MAX harmonics; a moving scan at a constant load keeps those up to MOVING_REACH times its fastest
        speed's, which `reach` tells.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np

from synth.contact.balance import Contact
from synth.contact.geometry import Geometry
from synth.contact.stiffness import Stiffness
from synth.effects.effect import AddedChannel
from synth.motion.motion import LARGEST_LOAD, ScanMotion
from synth.perception.threshold import imperceptible_tolerance
from synth.plan.channels import APPROACH, NEARLY, ORDERS, UNITS, ChannelPlan, Steady, silent_channel, spendable
from synth.plan.effects_preparation import PreparedEffects, effects_of, left_out, shape_for, simulated_channel
from synth.plan.frame_plan import FramePlan, plan_frames
from synth.plan.frame_solver import WITH_MEAN
from synth.plan.method_choice import cheapest_spectrum, fine_enough
from synth.plan.motion_peak import differs_from_cruise, peaks_along
from synth.plan.scene_table import kept_table, read_error
from synth.plan.start_up import begun
from synth.response.cache import ResponseCache
from synth.response.mean_approach import Mean, mean_curve
from synth.response.spectrum import Demand, Spectrum, curves, points_for, solve_spectrum
from synth.response.table import ResponseTable
from synth.scene.output_section import BAND, FULL_BAND
from synth.scene.scene import Scene

N_MAX = 4096  # harmonics (design, section 4); more cost time in proportion and are far above what skin feels
MOVING_REACH = 8  # a moving scan keeps the harmonics of this many times its fastest speed's: at u / 8 nothing is lost
FEWEST_MOVING = 64  # harmonics that a moving scan keeps at least, however fast: it is slow where it turns
ALIAS_SHARE = 0.7  # of the tolerance, for the series
FEW, ALIAS_SHARE_OF_FEW = 8, 0.95  # so few harmonics are summed, which is exact: they leave all to the series
TIGHTEST, LOOSEST = 1e-7, 3e-2  # between which "imperceptible" is translated: the range of accuracy.tolerance
SLOWEST_FOLD = 3.0  # Hz: below it no threshold is known
HAND_LOADS = (0.05, 1.8)  # N of usual hands (Fagiani & Barbieri, 2016, section 2)
FELT = 0.1  # of the peak-to-peak: a hand tells amplitudes apart by 0.1 to 0.25, so less is not worth a warning
EXACT = 1e-6  # the tolerance of "exact": what folds below 0.40 of the rate (design, section 4)


@dataclass(frozen=True, slots=True)
class Preparation:
    """A scene, solved.

    contact: None where nothing is solved. spectrum: the series at the scan's load. turns: texture periods a second at
    the scan's speed, signed. highest: harmonics kept at that speed. tolerance: as a number. silence: why nothing
    sounds, or "".
    moving: the scan changes speed or load by itself. loads: smallest and largest load of the scan (N). reach: harmonics
    that a moving voice keeps at most. by_hand: a hand moves, and `scene` holds its nominal scan. frames: how a
    moving scan is solved, None where a table is read. table_limit: what tables may err by.
    effects: what the scene's effects became, None where it has none. mean: of z over a period (m), over the cube root
    of the load, where frames are solved, the scan's own motion decides the full scale, or the approach is asked for.
    paced, exact: see `prepare`. table: what a moving voice reads, None where none does.
    """

    scene: Scene
    contact: Contact | None
    spectrum: Spectrum | None
    turns: float
    highest: int
    tolerance: float
    channels: tuple[ChannelPlan, ...]
    silence: str
    warnings: tuple[str, ...]
    moving: bool
    loads: tuple[float, float]
    reach: int
    by_hand: bool = False
    frames: FramePlan | None = None
    table_limit: float = math.inf
    effects: PreparedEffects | None = None
    mean: Mean | None = None
    paced: bool = False
    exact: bool = False
    table: ResponseTable | None = None

    @property
    def all_channels(self) -> tuple[ChannelPlan | AddedChannel, ...]:
        """The channels of the response, and those that effects add."""
        return self.channels if self.effects is None else (*self.channels, *self.effects.channels)

    @property
    def simulated(self) -> bool:
        """True where a simulation takes the place of the response."""
        plan = None if self.effects is None else self.effects.simulation
        return plan is not None and not plan.added

    @property
    def load_varies(self) -> bool:
        """True where the scan, or a hand, changes its load."""
        return self.loads[0] != self.loads[1]

    @property
    def told_loads(self) -> tuple[float, float]:
        """The loads (N) over which the error of a table is told: those of the scan, or of usual hands."""
        low, high = ScanMotion(self.scene).recorded_loads()
        return (min(low, HAND_LOADS[0]), max(high, HAND_LOADS[1])) if self.by_hand else (low, high)

    @property
    def memory_bytes(self) -> int:
        """Bytes that the preparation holds, but for its table, which others share."""
        held = 0 if self.spectrum is None else self.spectrum.harmonics.nbytes + self.spectrum.slopes.nbytes
        held += sum(channel.reader.nbytes for channel in self.channels if channel.reader is not None)
        held += 0 if self.effects is None else self.effects.memory_bytes
        return held + (0 if self.contact is None else self.contact.nbytes) + 1024

    def demand(self) -> Demand:
        """Return what every series of this scene must hold."""
        orders = orders_of(self.scene, moving=True)
        return Demand(max(self.highest, 1), orders, ALIAS_SHARE * spendable(self.tolerance))


def orders_of(scene: Scene, *, moving: bool) -> tuple[int, ...]:
    """Return the time derivatives that a scene's channels need, rising; a finger that stands still needs none."""
    orders = {ORDERS[channel.quantity] for channel in scene.output.channel_list}
    return tuple(sorted(orders)) if moving or scene.scan.speed != 0.0 else (0,)


def harmonics_below(frequency: float, limit: float, most: int = N_MAX) -> int:
    """Return how many harmonics of `frequency` (Hz, at least 0) lie below `limit` (Hz), `most` at most."""
    if frequency * most < limit:
        return most
    return max(0, math.ceil(limit / frequency * (1.0 - 1e-12)) - 1)


def prepare(
    scene: Scene,
    cache: ResponseCache | None = None,
    *,
    by_hand: bool = False,
    paced: bool = False,
    exact: bool = False,
) -> Preparation:
    """Return `scene` solved; what was solved before comes from `cache`.

    by_hand: for any speed and load, round those of a constant scan that is not silent. paced: its blocks have
    deadlines, so that a simulation takes no more steps than can be played live beside others; otherwise it takes those
    that the tolerance asks for. exact: what moves reads a table that is made to the tolerance, however long that takes.
    """
    begun()
    kept = cache or ResponseCache()
    output = (scene.output.channel_list, scene.output.sample_rate, scene.output.bandwidth)
    asked = (scene.finger, scene.texture, scene.scan, scene.effects, output, scene.accuracy)
    paced = paced and (bool(scene.effects) or scene.scan.stroke is not None or scene.scan.trajectory is not None)
    key: Hashable = ("preparation", by_hand, paced, exact, asked)
    return replace(
        kept.get(key, lambda: _prepared(scene, kept, by_hand=by_hand, paced=paced, exact=exact)), scene=scene
    )


def band_limit(scene: Scene) -> float:
    """Return the frequency (Hz) below which harmonics keep the tolerance."""
    return scene.output.band_limit


def _prepared(scene: Scene, cache: ResponseCache, *, by_hand: bool, paced: bool, exact: bool) -> Preparation:
    geometry, stiffness = Geometry.of_scene(scene), Stiffness.of_scene(scene)
    turns = scene.scan.speed / scene.texture.period
    motion = ScanMotion(scene)
    loads = (0.0, LARGEST_LOAD) if by_hand else motion.load_range()
    varies = loads[0] != loads[1]
    moving = by_hand or scene.scan.stroke is not None or scene.scan.trajectory is not None
    highest = harmonics_below(abs(turns), band_limit(scene))
    reach = highest
    if moving:
        highest = max(highest, 1)
        reach = min(N_MAX, max(MOVING_REACH * highest, FEWEST_MOVING))
    orders = orders_of(scene, moving=moving)
    silence = _silence(scene, geometry, highest)
    contact, spectrum, frames, tolerance, of_tables = None, None, None, _number(scene), math.inf
    shapes, mean = None, None
    if not silence:
        contact = Contact.of(geometry, stiffness)
        if scene.accuracy.tolerance == "imperceptible":
            rough = _solved(contact, scene, Demand(highest, orders, 1e-2), 0, cache)
            tolerance, of_tables = _imperceptible(rough, turns, orders, scene.accuracy.threshold)
        if scene.effects:
            contact, shapes = shape_for(contact, scene, Demand(max(highest, 1), orders, tolerance), loads, turns)
            contact.geometry_at(max(*loads, scene.scan.lift_load))  # refuses a shape that is too long under it
        share = ALIAS_SHARE_OF_FEW if highest <= FEW and not moving else ALIAS_SHARE
        demand = Demand(highest if varies else reach, orders, share * spendable(tolerance))
        if varies or scene.effects:
            contact = fine_enough(contact, _judged(scene, loads), demand)
        spectrum = _solved(contact, scene, demand, reach, cache) if moving else _cheapest(contact, scene, demand, cache)
        if moving and not by_hand and not paced:
            scale = min(1.0, band_limit(scene) / (BAND * scene.output.sample_rate))
            frames = plan_frames(contact, scene, demand, tolerance, scale)
        if not by_hand and moving and (differs_from_cruise(scene) or _asks_approach(scene)):
            mean = mean_curve(contact, loads, _pressed(scene), tolerance)
    found = Preparation(
        scene=scene,
        contact=contact,
        spectrum=spectrum,
        turns=turns,
        highest=highest,
        tolerance=tolerance,
        channels=(),
        silence=silence,
        warnings=motion.warnings(),
        moving=moving,
        loads=loads,
        reach=reach,
        by_hand=by_hand,
        frames=frames,
        table_limit=of_tables,
        mean=mean,
        paced=paced,
        exact=exact,
    )
    solved = _with_channels(found)
    return _with_motion(_with_effects(solved, shapes, cache) if scene.effects else solved, cache)


def _with_motion(solved: Preparation, cache: ResponseCache) -> Preparation:
    """Return a moving scan with the table that its voice reads, unless its frames are solved, and its errors."""
    if not solved.moving or solved.spectrum is None or solved.contact is None or solved.simulated:
        return solved
    if solved.frames is not None:
        errors = dict(zip(solved.demand().orders, solved.frames.errors, strict=True))
        limit, table, where = NEARLY * solved.tolerance, None, ""
    else:
        rate = solved.scene.output.sample_rate
        tolerance = solved.tolerance if solved.exact else None
        table = kept_table(solved.contact, solved.scene, cache, tolerance=tolerance)
        low, high = solved.told_loads
        told = {ORDERS[name]: name for name in UNITS if name != APPROACH}
        errors = {n: read_error(table, name, rate, (low, high), solved.highest) for n, name in told.items()}
        limit = NEARLY * solved.tolerance if solved.exact else max(FELT, solved.tolerance)
        where = f" at loads from {low:.4g} to {high:.4g} N"
    channels = tuple(replace(one, error=one.error + errors[one.order]) for one in solved.channels)
    warnings = dict.fromkeys(
        f"The {one.quantity} of the moving scan may err by {one.error:.2g} of its peak-to-peak{where}, not by the "
        f"{solved.tolerance:.2g} asked for."
        for one in channels
        if one.error > limit
    )
    return replace(solved, table=table, channels=channels, warnings=(*solved.warnings, *warnings))


def _with_effects(solved: Preparation, shapes: PreparedEffects | None, cache: ResponseCache) -> Preparation:
    """Return `solved` with its effects, its channels as they are with them."""
    if solved.spectrum is None or shapes is None:
        return replace(solved, effects=left_out(solved.scene, solved.silence))
    effects = effects_of(solved, shapes, cache)
    warnings = (*solved.warnings, *effects.warnings(solved.tolerance))
    if effects.simulation is None:
        return replace(solved, effects=effects, warnings=warnings)
    listed = zip(solved.channels, solved.scene.output.channel_list, strict=True)
    along = not solved.by_hand and differs_from_cruise(solved.scene)
    channels = tuple(
        simulated_channel(channel, asked.full_scale, effects.simulation, along=along) for channel, asked in listed
    )
    return replace(solved, effects=effects, channels=channels, warnings=warnings)


def _peaks_of_motion(solved: Preparation, orders: tuple[int, ...]) -> dict[int, float]:
    """Return the peak of each order along the scan's own motion, nothing where it is that at its speed and load."""
    asked = all(channel.full_scale for channel in solved.scene.output.channel_list)
    if solved.mean is None or asked or solved.contact is None:
        return {}
    own = {WITH_MEAN} if _asks_approach(solved.scene) else set()
    known = tuple(sorted({0, *orders, *own}))
    return dict(zip(known, peaks_along(solved.contact, solved.scene, solved.mean, known).tolist(), strict=True))


def _asks_approach(scene: Scene) -> bool:
    return any(channel.quantity == APPROACH for channel in scene.output.channel_list)


def _number(scene: Scene) -> float:
    asked = scene.accuracy.tolerance
    return asked if isinstance(asked, float) else EXACT


def _silence(scene: Scene, geometry: Geometry, highest: int) -> str:
    if geometry.still:
        return "The texture has no height (texture.amplitude is 0 m): nothing moves."
    if scene.scan.load == 0.0:
        return "The finger does not touch (the load is 0 N): nothing moves."
    if highest == 0:
        return (
            f"Every harmonic is above the band: u / lambda2 is {abs(scene.scan.speed) / scene.texture.period:.6g} Hz, "
            f"and what is below {band_limit(scene):.6g} Hz is rendered.{_wider_band(scene)}"
        )
    return ""


def _wider_band(scene: Scene) -> str:
    output = scene.output
    if abs(scene.scan.speed) / scene.texture.period >= BAND * output.sample_rate or output.bandwidth == FULL_BAND:
        return ""
    return ' Write output.bandwidth "full" for all that the sample rate holds.'


def _pressed(scene: Scene) -> float:
    """Return the load (N) at which the response of `scene` is solved: a finger that pulls has none of its own."""
    return scene.scan.load if scene.scan.load > 0.0 else scene.scan.lift_load


def _judged(scene: Scene, loads: tuple[float, float]) -> tuple[float, ...]:
    """Return the loads (N) at which a discretisation is judged: the scan's own, its lightest and its heaviest."""
    return tuple(sorted({max(load, scene.scan.lift_load) for load in (*loads, _pressed(scene))}))


def _solved(contact: Contact, scene: Scene, demand: Demand, keep: int, cache: ResponseCache) -> Spectrum:
    load = _pressed(scene)
    key = ("spectrum", contact.key, load, demand, keep)
    return cache.get(key, lambda: solve_spectrum(contact, load, demand, keep))


def _cheapest(contact: Contact, scene: Scene, demand: Demand, cache: ResponseCache) -> Spectrum:
    load = _pressed(scene)
    key = ("cheapest spectrum", contact.key, load, demand)
    return cache.get(key, lambda: cheapest_spectrum(contact, load, demand, demand.highest))


def _imperceptible(spectrum: Spectrum, turns: float, orders: tuple[int, ...], threshold: str) -> tuple[float, float]:
    """Return the tolerance of which nothing is felt at the harmonics, and that of tables, wherever it folds."""
    harmonics = np.arange(1, len(spectrum.harmonics)) * max(abs(turns), 1e-9)
    folded = np.geomspace(SLOWEST_FOLD, max(harmonics[-1], 2.0 * SLOWEST_FOLD), 200)
    tolerance, of_tables = LOOSEST, math.inf
    for order in orders:
        extent = float(np.ptp(curves(spectrum.harmonics, order, points_for(len(spectrum.harmonics) - 1))))
        extent *= abs(turns) ** order
        tolerance = min(tolerance, imperceptible_tolerance(harmonics, order, extent, threshold))
        of_tables = min(of_tables, imperceptible_tolerance(folded, order, extent, threshold))
    return max(tolerance, TIGHTEST), max(of_tables, TIGHTEST)


def _with_channels(solved: Preparation) -> Preparation:
    """Return `solved` with its channels and warnings, and silent where the motion is below 1 nm."""
    listed = solved.scene.output.channel_list
    if solved.spectrum is None:
        silent = tuple(silent_channel(channel) for channel in listed)
        return replace(solved, channels=silent, warnings=(*solved.warnings, solved.silence))
    orders = orders_of(solved.scene, moving=solved.moving)
    steady = Steady(
        solved.scene,
        solved.spectrum,
        solved.highest,
        solved.turns,
        solved.tolerance,
        orders,
        solved.moving,
        solved.table_limit,
    )
    peaks = _peaks_of_motion(solved, orders)
    silence = steady.silence(peaks)
    if silence and not solved.by_hand:
        return _with_channels(replace(solved, spectrum=None, silence=silence))
    channels = tuple(steady.planned(channel, peaks, still=bool(silence)) for channel in listed)
    warnings = [*solved.warnings, *(text for text in map(steady.warning, channels) if text)]
    if solved.scene.accuracy.tolerance == "imperceptible" and solved.tolerance <= TIGHTEST:
        warnings.append(f"A tolerance of {TIGHTEST:g}, the tightest there is, may leave an error that is felt.")
    return replace(solved, channels=channels, warnings=tuple(warnings))
