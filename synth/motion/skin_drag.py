"""Drags a fingertip along a surface: a mass on spring and damper, held by a bristle of skin that sticks and slips.

Stage   MOTION, a solver without knowledge of scenes. `dragged_motion` applies it to a motion.
Model   The lag d (m) of the mass behind the hand, its speed v (m/s) and the force f (N) of the bristle follow

            d' = u - v,    m v' = k d + c (u - v) - F,    f' = sigma0 b,    F = f + sigma_e(v) b

        with the speed u of the hand, and the speed b = v (1 - g) at which the bristle bends. g = alpha(r) r is the part
        that slips, with r = f sign(v) / A(v) and A = N (mu_d + (mu_s - mu_d) exp(-(v / v_s)^2)). alpha is 0 up to
        r = BREAKAWAY, where the skin sticks, and 1 from r = 1 on, where it slides. The place of the skin on the surface
        is that of the hand less d and less the bend f / sigma0, so it does not creep while the skin sticks.
        The damper of the bristle fades with speed: sigma_e = sigma1 A / (A + sigma1 |v|). Then F v is never less than
        the power that bends the bristle, so friction gives no energy. |f| is at most mu_s N, also under a falling load.
        Where the load is 0, the skin stands relaxed under the hand.
        Moisture q of the contact rises towards 1 while it lasts, and multiplies friction by 1 + (rise - 1) q.
        Each step is one of the 2-stage Radau IIA method: order 3, L-stable, and algebraically stable, so the steps give
        no energy either. Within a frame, a step is halved until its estimated error is below TOLERANCE. A step that
        cannot be halved again is one of Euler's implicit method, with the slope of friction held: it has one solution.
Source  Canudas de Wit et al. (1995), IEEE Trans. Autom. Control 40: LuGre. Dupont et al. (2002), IEEE Trans. Autom.
        Control 47: alpha. Olsson (1996): a damper that fades. Hairer & Wanner, Solving ODEs II, sections IV.5 and
        IV.12. All from general knowledge (unverified); tests/synth/motion/test_skin_drag.py checks them.
Limits  One mass, along one axis. The local error falls with the third power of the step only where friction is smooth.
"""

from __future__ import annotations

import math

import numpy as np

from synth.arrays import Array
from synth.kernels import inlined, inner, signed_kernel

BREAKAWAY = 0.7  # of sliding friction, unverified default: below it nothing slips; nearer to 1 steps are shorter
TOLERANCE = 2e-3  # of v_s and of mu_s N: estimated error of a step; a larger one shifts the frequency of stick-slip
TICKS = 64  # of a frame: the shortest step; fewer: friction that is stiff against a frame is solved by Euler's method
COARSER = 0.05  # of the tolerance: below this error the next step is twice as long, with 8 times the error
NEWTON, CLOSE = 8, 1e-5  # most iterations, and the change (of v_s and mu_s N) that ends them, as it falls by its square
LEAST = 1e-6  # N: a lighter load of a finger that touches counts as this; without one, friction has no slope
MASS, DAMPING, SPRING, BRISTLE, BRISTLE_DAMPING, STATIC, KINETIC, STRIBECK, RISE, WETTING, DRYING = range(11)
"""Parameters: m, c, k, sigma0, sigma1, mu_s, mu_d, v_s (SI); rise of friction; rates of wetting and drying (1/s)."""
LAG, SPEED, BEND, WET, STEP, TIME, HAND, LOAD = range(8)
"""State: d (m), v (m/s), f (N), q, ticks of the next step, and whether it has begun, u (m/s) and load (N) of the last
frame."""


@inlined
def slipping(r):
    """Return the part g of the speed at which the skin slips, and dg/dr."""
    if r <= BREAKAWAY:
        return 0.0, 0.0
    if r >= 1.0:
        return r, 1.0
    s = (r - BREAKAWAY) / (1.0 - BREAKAWAY)
    part = s * s * (3.0 - 2.0 * s)
    return part * r, part + r * 6.0 * s * (1.0 - s) / (1.0 - BREAKAWAY)


@inlined
def friction(p, load, v, f):
    """Return b, db/dv, db/df, F, dF/dv and dF/df at a speed v (m/s) and a force f (N) of the bristle.

    load: N, times the rise of friction.
    """
    speed, side = abs(v), math.copysign(1.0, v)
    fall = load * (p[STATIC] - p[KINETIC]) * math.exp(-((v / p[STRIBECK]) ** 2))
    most = load * p[KINETIC] + fall
    slope = -2.0 * speed / p[STRIBECK] ** 2 * fall
    r = f * side / most
    g, dg = slipping(r)
    bent, bent_v, bent_f = v * (1.0 - g), 1.0 - g + speed * dg * r * slope / most, -speed * dg / most
    span = 1.0 / (most + p[BRISTLE_DAMPING] * speed)
    damper = p[BRISTLE_DAMPING] * most * span
    damper_v = (p[BRISTLE_DAMPING] * span) ** 2 * (slope * speed - most) * side
    return bent, bent_v, bent_f, f + damper * bent, damper * bent_v + damper_v * bent, 1.0 + damper * bent_f


@inner
def stages(p, h, state, first, second):
    """Return v and f at both stages of a step of `h` (s), by Newton's method, and whether it has come to an end.

    first, second: speed of the hand (m/s) and load (N) after a third of the step, and at its end.
    The stages have the coefficients A = [5/12, -1/12; 3/4, 1/4]. The equations of v and f are multiplied by its
    inverse [3/2, 1/2; -9/2, 5/2]. d is linear in v, and f is eliminated from each iteration.
    """
    d, v, f, u1, u2 = state[LAG], state[SPEED], state[BEND], first[0], second[0]
    mass, bristle, pull, rubbed = h / p[MASS], h * p[BRISTLE], h * h * p[SPRING] / p[MASS], h * p[DAMPING] / p[MASS]
    known1 = mass * p[SPRING] * (d + h * (5.0 * u1 - u2) / 12.0) + rubbed * u1
    known2 = mass * p[SPRING] * (d + h * (3.0 * u1 + u2) / 4.0) + rubbed * u2
    v1, v2, f1, f2 = v, v, f, f
    near_v, near_f = CLOSE * p[STRIBECK], CLOSE * p[STATIC] * (LEAST + max(first[1], second[1]))
    for _ in range(NEWTON):
        b1, b1_v, b1_f, force1, force1_v, force1_f = friction(p, first[1], v1, f1)
        b2, b2_v, b2_f, force2, force2_v, force2_f = friction(p, second[1], v2, f2)
        left_v1 = 1.5 * (v1 - v) + 0.5 * (v2 - v) + rubbed * v1 + pull * (5.0 * v1 - v2) / 12.0 + mass * force1 - known1
        left_v2 = 2.5 * (v2 - v) - 4.5 * (v1 - v) + rubbed * v2 + pull * (3.0 * v1 + v2) / 4.0 + mass * force2 - known2
        left_f1 = 1.5 * (f1 - f) + 0.5 * (f2 - f) - bristle * b1
        left_f2 = 2.5 * (f2 - f) - 4.5 * (f1 - f) - bristle * b2
        own1, own2 = 1.5 - bristle * b1_f, 2.5 - bristle * b2_f
        part = 1.0 / (own1 * own2 + 2.25)  # df = to + by dv
        to1, to2 = -part * (own2 * left_f1 - 0.5 * left_f2), -part * (4.5 * left_f1 + own1 * left_f2)
        by11, by12 = part * own2 * bristle * b1_v, -part * 0.5 * bristle * b2_v
        by21, by22 = part * 4.5 * bristle * b1_v, part * own1 * bristle * b2_v
        q11 = 1.5 + rubbed + pull * 5.0 / 12.0 + mass * (force1_v + force1_f * by11)
        q12 = 0.5 - pull / 12.0 + mass * force1_f * by12
        q21 = -4.5 + pull * 0.75 + mass * force2_f * by21
        q22 = 2.5 + rubbed + pull * 0.25 + mass * (force2_v + force2_f * by22)
        right1, right2 = -left_v1 - mass * force1_f * to1, -left_v2 - mass * force2_f * to2
        whole = q11 * q22 - q12 * q21
        if whole == 0.0:
            break
        dv1, dv2 = (right1 * q22 - right2 * q12) / whole, (q11 * right2 - q21 * right1) / whole
        df1, df2 = to1 + by11 * dv1 + by12 * dv2, to2 + by21 * dv1 + by22 * dv2
        v1, v2, f1, f2 = v1 + dv1, v2 + dv2, f1 + df1, f2 + df2
        if max(abs(dv1), abs(dv2)) < near_v and max(abs(df1), abs(df2)) < near_f:
            return v1, v2, f1, f2, True
    return v1, v2, f1, f2, False


@inner
def radau(p, h, state, before, first, second):
    """Return d, v and f after a step of `h` (s), its error relative to the tolerance, and whether it was solved.

    before, first, second: speed of the hand (m/s) and load (N) at its beginning, after a third, and at its end.
    The error is the second difference of the rates, which an embedded rule of order 2 would leave out.
    """
    d, v, f = state[LAG], state[SPEED], state[BEND]
    v1, v2, f1, f2, solved = stages(p, h, state, first, second)
    bent, _, bent_f, force, force_v, _ = friction(p, before[1], v, f)
    rise = h / p[MASS] * (p[SPRING] * d + p[DAMPING] * (before[0] - v) - force)
    wrong_v = abs(rise - 4.5 * (v1 - v) + 0.5 * (v2 - v))
    wrong_f = abs(h * p[BRISTLE] * bent - 4.5 * (f1 - f) + 0.5 * (f2 - f))
    wrong_v /= (1.0 + h / p[MASS] * (p[DAMPING] + max(force_v, 0.0))) * (p[STRIBECK] + abs(v))
    wrong_f /= (1.0 - h * p[BRISTLE] * bent_f) * p[STATIC] * (LEAST + max(before[1], second[1]))
    return d + h * (0.75 * (first[0] - v1) + 0.25 * (second[0] - v2)), v2, f2, max(wrong_v, wrong_f) / TOLERANCE, solved


@inner
def euler(p, h, state, u, load):
    """Return d, v and f after a step of `h` (s), with the slope of friction of its beginning."""
    d, v, f = state[LAG], state[SPEED], state[BEND]
    most = load * (p[KINETIC] + (p[STATIC] - p[KINETIC]) * math.exp(-((v / p[STRIBECK]) ** 2)))
    g, _ = slipping(f * math.copysign(1.0, v) / most)
    slope = abs(v) * g / abs(f) if g > 0.0 else 0.0
    damper = p[BRISTLE_DAMPING] * most / (most + p[BRISTLE_DAMPING] * abs(v))
    part = 1.0 / (1.0 + h * p[BRISTLE] * slope)
    kept, given = f * part, h * p[BRISTLE] * part
    held = 1.0 - damper * slope
    against = p[MASS] / h + h * p[SPRING] + p[DAMPING] + given * held + damper
    after = (p[MASS] / h * v + p[SPRING] * (d + h * u) + p[DAMPING] * u - kept * held) / against
    return d + h * (u - after), after, kept + given * after


@inlined
def hand_at(part, speed, new_speed, mean):
    """Return the speed of the hand (m/s) at a part of a frame: a parabola with this mean."""
    return speed + part * (6.0 * mean - 4.0 * speed - 2.0 * new_speed + part * 3.0 * (speed + new_speed - 2.0 * mean))


@inner
def over_frame(p, frame, state, mean, speed, load, rise):
    """Step `state` over one frame.

    frame: s.
    mean, speed: of the hand over the frame and at its end (m/s).
    load: at its end (N).
    rise: factor on friction.
    """
    old_speed, old_load = state[HAND], state[LOAD]
    tick, step = 0, int(state[STEP])
    while tick < TICKS:
        while step > 1 and tick % step:
            step //= 2
        begin, third, end = tick / TICKS, (tick + step / 3.0) / TICKS, (tick + step) / TICKS
        before = hand_at(begin, old_speed, speed, mean), rise * max(LEAST, old_load + begin * (load - old_load))
        first = hand_at(third, old_speed, speed, mean), rise * max(LEAST, old_load + third * (load - old_load))
        second = hand_at(end, old_speed, speed, mean), rise * max(LEAST, old_load + end * (load - old_load))
        h = frame * step / TICKS
        d, v, f, wrong, solved = radau(p, h, state, before, first, second)
        if step > 1 and not (solved and wrong <= 1.0):
            step //= 2
            continue
        if not solved:
            d, v, f = euler(p, h, state, second[0], second[1])
        most = p[STATIC] * second[1]
        state[LAG], state[SPEED], state[BEND] = d, v, min(max(f, -most), most)
        tick += step
        if wrong < COARSER and step < TICKS:
            step *= 2
    state[STEP] = step


@signed_kernel("void(f8[::1], f8, f8[::1], f8[::1], f8[::1], f8[::1], f8[::1], f8[:,::1])", fused=False)
def drag(p, rate, state, travel, speed, load, share, out):
    """Drag the skin after a hand along one axis, frame by frame.

    p, state: as above; the state is updated.
    rate: frames per second.
    travel: of the hand since the frame before, m.
    speed, load: of the hand at each frame, m/s and N.
    share: part of the speed and of the load that the axis has, above 0. 1 for a motion along it.
    out: float64 [3, frames]: lag of the skin's place behind the hand (m), speed at which it slips (m/s), and the force
        of friction (N) at each frame.
    """
    frame, q = 1.0 / rate, p.copy()
    for i in range(len(travel)):
        touches = load[i] > 0.0 or state[LOAD] > 0.0
        toward, change = (1.0, p[WETTING]) if touches else (0.0, p[DRYING])
        wet = state[WET]
        state[WET] = toward + (wet - toward) * math.exp(-change * frame)
        rise = 1.0 + (p[RISE] - 1.0) * 0.5 * (wet + state[WET])
        pressed, q[STRIBECK] = share[i] * load[i], share[i] * p[STRIBECK]
        if touches and state[TIME] > 0.0:
            over_frame(q, frame, state, travel[i] * rate, speed[i], pressed, rise)
        else:
            state[LAG], state[SPEED], state[BEND], state[STEP], state[TIME] = 0.0, speed[i], 0.0, TICKS, 1.0
        state[HAND], state[LOAD] = speed[i], pressed
        v, f = state[SPEED], state[BEND]
        out[0, i] = state[LAG] + f / p[BRISTLE]
        out[1, i], out[2, i] = v, 0.0
        if load[i] > 0.0:
            bent, _, _, force, _, _ = friction(q, rise * max(pressed, LEAST), v, f)
            out[1, i], out[2, i] = v - bent, force


def at_rest() -> Array:
    """Return the state before the first frame, at which the skin stands relaxed under the hand."""
    return np.zeros(8)
