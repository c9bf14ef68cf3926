"""Prepare a scene for rendering: solve its response once, and choose full scales, readers and errors.

Stage   2, the part that computes. `plan` describes the result for people.
Model   Harmonics below 0.40 of the rate, and below the bandwidth, are kept at the speed of the scan. A constant scan is
        read from the series of these harmonics. The series is solved to the tolerance, minus the rounding to float32.
        A moving scan is solved along its motion (`frame_solver`). A hand, and a moving scan whose blocks have
        deadlines, read the response table instead, or are solved directly where it is too coarse and over an area
        (`direct_plan`).
        If the period of a surface is too long, the series is that of a stretch (`stretch`) and gives levels only.
Source  design, section 4.
Limits  `request` limits the number of harmonics.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace

from synth.arrays import Array
from synth.contact.geometry import Geometry
from synth.effects.effect import Kind
from synth.errors import Fault, SceneError
from synth.motion.motion import LARGEST_LOAD
from synth.motion.moved_skin import mover_of
from synth.motion.recorded_motion import rendered_part
from synth.motion.scan_motion import ScanMotion
from synth.plan.channels import NEARLY, ChannelPlan, extent_and_peak
from synth.plan.contact_choice import beside_cells, contact_in_cells, shape_in_cells
from synth.plan.direct_plan import beyond_table, direct_plan, follows_path
from synth.plan.effect_choice import LONGEST_WHOLE, SimulationCase, outputs_of
from synth.plan.effect_choice import asked as asked_effects
from synth.plan.effects_preparation import PreparedEffects, effects_of, left_out, simulated_channel
from synth.plan.frame_plan import FramePlan, plan_frames
from synth.plan.mean_choice import has_approach
from synth.plan.motion_peak import differs_from_cruise
from synth.plan.own_motion import own_motion
from synth.plan.preparation import Preparation
from synth.plan.process_start import begun
from synth.plan.request import N_MAX, Request, above_band, harmonics_in_band, silence_of
from synth.plan.scene_series import TIGHTEST, imperceptible, series_of, shaped_contact
from synth.plan.scene_table import kept_table, read_error
from synth.plan.stretch import Stretch, on_whole, stretch_of
from synth.plan.warnings import level_of_effects, uncertain_level
from synth.response.demand import Demand
from synth.response.reading_filter import ORDERS
from synth.response.table_error import QUANTITIES
from synth.response_cache import SHARED, ResponseCache
from synth.scene.line_scan import along_x
from synth.scene.output_section import BAND
from synth.scene.scene import Scene

WIDE = 64  # harmonics in the band: a live scan of an area with more is solved along its path, as its series takes long
FELT = 0.1  # of the peak-to-peak: smaller errors cause no warning, as a hand distinguishes amplitudes by 0.1 to 0.25
OVER_PLACES = 1.0, 1.0, 2.0
"""Error of each order over that of a steady scan in other places: up to 0.9 of them were seen, on short waves."""
EXACT = 1e-6  # tolerance of "exact": the folded error below 0.40 of the rate (design, section 4)


def prepare(
    scene: Scene,
    cache: ResponseCache | None = None,
    *,
    by_hand: bool = False,
    paced: bool = False,
    exact: bool = False,
) -> Preparation:
    """Return `scene` solved. Results that are in `cache` are reused.

    cache: None for the shared one.
    by_hand: prepare for any speed and load of a hand. `scene` then has a constant scan that is not silent.
    paced: the blocks have deadlines. A simulation then takes no more steps than can be played live with other voices.
        Otherwise it takes the steps that the tolerance requires.
    exact: a moving scan reads a table that is made to the tolerance, however long that takes.
    """
    begun()
    kept = cache or SHARED
    told: tuple[str, ...] = ()
    scene = along_x(scene)
    if not by_hand and not paced:
        scene, told = rendered_part(scene)
    output = (scene.output.channel_list, scene.output.sample_rate, scene.output.bandwidth)
    parts = (scene.finger, scene.texture, scene.scan, scene.effects, output, scene.accuracy)
    stretch = _stretch(scene)
    scan = scene.scan
    moves = scan.stroke is not None or scan.trajectory is not None or not scan.along_x or stretch is not None
    moves = moves or mover_of(scene) is not None
    heard = by_hand or paced  # while it is rendered
    area = heard and follows_path(scene)
    area = area and (by_hand or moves or harmonics_in_band(scene, WIDE + 1) > WIDE)
    paced = paced and (bool(scene.effects) or moves or area)
    file = not heard or exact
    lasting = None if heard else (scene.output.duration, scene.output.fade)  # they decide the full scale
    key: Hashable = ("preparation", by_hand, paced, exact, file, lasting, parts)

    def build() -> Preparation:
        loads = (0.0, LARGEST_LOAD) if by_hand else ScanMotion(scene, whole=heard).load_range()
        return _prepared(Request(scene, by_hand, paced, loads, stretch, area), kept, exact=exact, file=file)

    found = kept.get(key, build)
    return replace(found, scene=scene, warnings=(*told, *found.warnings))


def _prepared(asked: Request, cache: ResponseCache, *, exact: bool, file: bool) -> Preparation:
    scene, geometry = asked.scene, Geometry.of_scene(asked.scene)
    tolerance = scene.accuracy.tolerance if isinstance(scene.accuracy.tolerance, float) else EXACT
    solved = Preparation(*asked.request, tolerance, ScanMotion(scene, whole=asked.live).warnings())
    silence = silence_of(asked, geometry) or ("" if has_approach(scene) else above_band(asked))
    if silence:
        return _silent(solved, silence, cache)
    contact, cells = contact_in_cells(asked, cache, tolerance, file=file)
    if scene.accuracy.tolerance == "imperceptible":
        tolerance = imperceptible(contact, asked)
    contact, shapes, demand, more = shaped_contact(asked, contact, tolerance, beside_cells(tolerance, cells))
    contact, cells = shape_in_cells(asked, cache, tolerance, contact, cells + more, file=file)
    spectrum = series_of(asked, contact, demand, cache)
    on_surface = None if asked.stretch is None else on_whole(contact, scene)
    solved = replace(solved, tolerance=tolerance, contact=contact, on_surface=on_surface, spectrum=spectrum)
    solved = _planned(solved, demand, cells, cache, file=file)
    if solved.silence:
        return solved
    if shapes is not None:
        solved = _with_effects(solved, shapes)
        if solved.simulated:
            solved = replace(solved, channels=tuple(one.with_error(cells) for one in solved.channels))
    if solved.moving and not solved.simulated:
        solved = _with_motion(solved, cache, exact=exact)
    if solved.effects is None:
        return solved
    prepared = solved.effects
    moved = next((one.motion for one in prepared.called if one.motion is not None), None)
    if moved is not None:
        solved = _with_places(solved, float(moved["place_error"]), float(moved.get("force_error", 0.0)))
    solved, effects = _with_stages(solved, prepared, cache, exact=exact)
    level = () if solved.live else level_of_effects(scene, effects, stepped=solved.stepped)
    return replace(solved, warnings=(*solved.warnings, *level))


def _planned(solved: Preparation, demand: Demand, cells: Array, cache: ResponseCache, *, file: bool) -> Preparation:
    """Return `solved` with its frames, mean and channels, before effects; silent if it moves too little.

    cells: error of each order by the size of the cells.
    """
    scene, tolerance, steady = solved.scene, solved.tolerance, solved.steady
    assert solved.contact is not None
    frames = _frames(solved, demand, cells) if solved.moving and not solved.live else None
    contact, mean, frames, peaks, partly = own_motion(steady, solved.contact, solved.whole, tolerance, frames)
    solved = replace(solved, **{"contact" if solved.on_surface is None else "on_surface": contact})
    still = above_band(solved) or steady.silence(peaks)
    if still and not solved.by_hand:
        if not has_approach(scene):
            moves = not above_band(solved) and any(peaks.get(order, 1.0) > 0.0 for order in solved.orders)
            return _silent(replace(solved, spectrum=None), still, cache, 1.0 if moves else 0.0)
        solved = replace(solved, warnings=(*solved.warnings, still))
    extents = {} if frames is None else dict(zip(solved.orders, frames.extents, strict=False))
    channels = tuple(steady.planned(one, peaks, extents, still=bool(still)) for one in scene.output.channel_list)
    if not solved.moving:
        channels = tuple(one.with_error(cells) for one in channels)
    reported = tuple(one for one in channels if one.error > FELT or file or not cells.any())
    missed = tuple(text for text in (steady.warning(channel, tolerance) for channel in reported) if text)
    if scene.accuracy.tolerance == "imperceptible" and tolerance <= TIGHTEST:
        missed += (f"A tolerance of {TIGHTEST:g}, the tightest allowed, may leave an error that is felt.",)
    warnings = (*solved.warnings, *missed, *([partly] if partly else []))
    return replace(solved, channels=channels, warnings=warnings, mean=mean, frames=frames)


def _frames(solved: Preparation, demand: Demand, cells: Array) -> FramePlan | None:
    """Return how a moving file is solved, or None if that would take too long."""
    scene, contact, spectrum = solved.scene, solved.contact, solved.spectrum
    assert contact is not None and spectrum is not None
    scale = min(1.0, scene.output.band_limit / (BAND * scene.output.sample_rate))
    frames = plan_frames(solved, contact, demand, spectrum, scale)
    if frames is None or solved.load_varies or solved.over_area:  # then `own_motion` finds the error by cells too
        return frames
    return frames.with_errors(cells[list(solved.orders)])


def _stretch(scene: Scene) -> Stretch | None:
    """Return the stretch of a long surface, or None. Raises SceneError where an effect needs a shorter period."""
    balance = list(asked_effects(scene, Kind.BALANCE))
    needing = [effect.name for effect, _settings, auto in balance if not auto]
    needing += [effect.name for effect, _settings in outputs_of(scene) if effect.has_table]
    if not needing and (not balance or scene.texture.period > LONGEST_WHOLE):
        return stretch_of(scene, harmonics_in_band(scene, N_MAX + 1), N_MAX)
    if scene.texture.period > LONGEST_WHOLE:
        allowed = f"{LONGEST_WHOLE:g} m or less, because {needing[0]} is solved over a whole period"
        hint = f"Write a shorter texture, or leave {needing[0]} out."
        raise SceneError([Fault("/texture", f"a period of {scene.texture.period:.4g} m", allowed, hint)])
    return None


def _silent(solved: Preparation, silence: str, cache: ResponseCache, error: float = 0.0) -> Preparation:
    """Return the preparation of a scene whose z is silent. Effects that move the skin still add their channels.

    error: of its quantities, relative to their peak-to-peak; 1 where a motion is left out.
    """
    scene = solved.scene
    channels = tuple(
        ChannelPlan(one.quantity, ORDERS[one.quantity], one.full_scale or 1.0, error, 0.0, None)
        for one in scene.output.channel_list
    )
    solved = replace(solved, channels=channels, warnings=(*solved.warnings, silence), silence=silence)
    if not scene.effects:
        return solved
    moving = tuple(one for one in outputs_of(scene) if one[0].kind == Kind.MOTION)
    stages = tuple(effect.prepare(solved, settings, cache) for effect, settings in moving)
    effects = replace(left_out(scene, silence, error, by_hand=solved.by_hand), stages=stages)
    more = effects.warnings(solved.tolerance, max(FELT, solved.tolerance), ())
    return replace(solved, effects=effects, warnings=(*solved.warnings, *more))


def _with_motion(solved: Preparation, cache: ResponseCache, *, exact: bool) -> Preparation:
    """Return a moving scan with its errors and, unless its frames are solved, the table or direct plan of its voice."""
    assert solved.contact is not None
    wanted, table, direct = solved.tolerance if exact else None, None, None
    frames = solved.frames
    if frames is not None:
        errors = dict(zip(solved.orders, frames.errors, strict=True))
        limit, where = NEARLY * solved.tolerance, ""
    else:
        rate, (low, high) = solved.scene.output.sample_rate, solved.reported_loads
        if beyond_table(solved, solved.contact):
            direct = direct_plan(solved, solved.contact, solved.whole, cache, wanted)
            errors, low, high = dict(enumerate(direct.errors)), direct.loads[0], direct.loads[-1]
        else:
            table = kept_table(solved.contact, solved.scene, cache, tolerance=wanted)
            errors = {
                order: read_error(table, name, rate, (low, high), solved.highest)
                for order, name in enumerate(QUANTITIES)
            }
        limit = max(FELT, solved.tolerance) if solved.live and not exact else NEARLY * solved.tolerance
        where = f" at loads from {low:.4g} to {high:.4g} N"
    channels = tuple(replace(one, error=one.error + errors[one.order]) for one in solved.channels)
    told = dict.fromkeys(
        f"The error of the {one.quantity} of the moving scan may be {one.error:.2g} of its peak-to-peak{where}; the "
        f"tolerance is {solved.tolerance:.2g}."
        for one in channels
        if one.error > limit
    )
    level = () if solved.live else uncertain_level(channels, solved.scene.output.channel_list, read=frames is None)
    warnings = (*solved.warnings, *told, *level)
    return replace(solved, table=table, direct=direct, channels=channels, warnings=warnings)


def _with_effects(solved: Preparation, shapes: PreparedEffects) -> Preparation:
    """Return `solved` with its effects, and with channels that take a simulation into account."""
    assert solved.contact is not None
    case = SimulationCase(*solved.request, solved.contact, solved.tolerance, solved.mean, solved.spectrum)
    effects = effects_of(case, shapes)
    if effects.simulation is None:
        return replace(solved, effects=effects)
    before = {solved.steady.warning(channel, solved.tolerance) for channel in solved.channels}
    warnings = tuple(text for text in solved.warnings if text not in before)  # the simulation tells its own errors
    listed = zip(solved.channels, solved.scene.output.channel_list, strict=True)
    along = not solved.by_hand and differs_from_cruise(solved.scene)
    channels = tuple(
        simulated_channel(channel, asked.full_scale, effects.simulation, solved, along=along)
        for channel, asked in listed
    )
    return replace(solved, effects=effects, channels=channels, warnings=warnings)


def _with_places(solved: Preparation, shift: float, late: float) -> Preparation:
    """Return `solved` with the errors of its channels where the places of the skin err by `shift` (m).

    They are relative to the peak-to-peak along the skin's own motion. Where waves are longer than slips, the error is
    of the moments of slips, as that of the force is: `late`, relative to its peak-to-peak.
    """
    if (shift == 0.0 and late == 0.0) or solved.turns == 0.0:
        return solved
    steady, turn, changed = solved.steady, abs(solved.turns) * solved.period, []
    for one in solved.channels:
        extent, slope = extent_and_peak(steady.series(one.order))[0], extent_and_peak(steady.series(one.order + 1))[1]
        more = OVER_PLACES[one.order] * slope * shift / (turn * extent) if extent > 0.0 else 0.0
        changed.append(replace(one, error=one.error + more + late))
    limit = max(FELT, solved.tolerance) if solved.live else NEARLY * solved.tolerance
    told = dict.fromkeys(
        f"The error of the {one.quantity} is {one.error:.2g} of its peak-to-peak; the tolerance is "
        f"{solved.tolerance:.2g}. The rest is that of the moments at which the skin sticks and slips."
        for one, before in zip(changed, solved.channels, strict=True)
        if one.error > limit >= before.error
    )
    return replace(solved, channels=tuple(changed), warnings=(*solved.warnings, *told))


def _with_stages(
    solved: Preparation, effects: PreparedEffects, cache: ResponseCache, *, exact: bool
) -> tuple[Preparation, PreparedEffects]:
    """Return `solved` with the stages of the effects on the output, which read its channels, and the effects."""
    stages = tuple(effect.prepare(solved, settings, cache) for effect, settings in outputs_of(solved.scene))
    effects = replace(effects, stages=stages)
    read = solved.table is not None or solved.direct is not None
    limit = NEARLY * solved.tolerance if not read or exact else max(FELT, solved.tolerance)
    warnings = (*solved.warnings, *effects.warnings(solved.tolerance, limit, solved.channels))
    return replace(solved, effects=effects, warnings=warnings), effects
