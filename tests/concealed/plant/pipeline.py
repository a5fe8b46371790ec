"""From a session and its effects to the true force, and the strength of an effect.

Strength: RMS of (true force with the effect - true force without) over RMS of the true force without, both over the
recorded samples that move faster than 3e-5 m/s. Of a converter effect the same difference is taken on the noise-free
force; of an encoder effect it is the difference of the nominal force at the recorded and at the true motion, above 2 mm/s.
"""
import numpy as np
from scipy.signal import savgol_filter
from . import noise
from .effect import Effect
from .session import RATE_MOVING, walther_of


class ParameterShift(Effect):
    """Effect: a constant of the law that is off by more than its tolerance."""
    id, name_k, first, limit, equivalents = "parameter-shift", "relative_change", 0.03, 3.0, ()

    def draw(self, rng, world, design):
        choice = ["preload", "friction", "viscosity"] if world.law == "guide" else ["coulomb", "viscous", "mass", "offset"]
        self.param = design.get("shift_param") or str(rng.choice(choice))
        self.p = {"sign": rng.choice([-1.0, 1.0])}
        if self.param in ("preload", "friction"):
            self.equivalents = ("force-gain",)
        if self.param == "offset":
            self.unit, self.equivalents = "N", ("force-offset", "gravity-tilt")

    def describe(self, k):
        return [{"name": "parameter", "value": self.param, "unit": ""}, {"name": "change", "value": self.change(k), "unit": self.unit}]

    def change(self, k):
        return float(k * self.p["sign"] if self.param == "offset" else max(k * self.p["sign"], -0.9))


def _gain(w, effects, name):
    g = w.gains.get(name, 1.0)
    for e, k in effects:
        if isinstance(e, ParameterShift) and e.param == name and name != "offset":
            g *= 1 + e.change(k)
    return g


def true_force(c, w, effects):
    """Noise-free reading of the force channel at the internal rate; `effects` is a list of (effect, k)."""
    if w.law == "guide":
        g, q = w.guide, w.guide.ball_load(c.preload * _gain(w, effects, "preload"))
        q = np.broadcast_to(q, c.v.shape) if any(e.preload.__func__ is not Effect.preload for e, _ in effects) else q
        rows = [(1.0, 1.0)]
        for e, k in effects:
            rows = e.rows(c, w, k, q) or rows
        for e, k in effects:
            q = q * e.preload(c, w, k, q)
        law = walther_of(w)
        nu = (law(c.t_block) if law else w.viscosity) * _gain(w, effects, "viscosity")
        if any(e.oil.__func__ is not Effect.oil for e, _ in effects):
            heat = 0.0025 * 52 * np.broadcast_to(q, c.v.shape) * np.abs(c.v)
            for e, k in effects:
                nu = e.oil(c, w, k, nu, heat)
        f = 0.0
        for share, factor in rows:
            qr = q * factor
            h = g.film(qr, c.v, nu)
            parts = g.mu_parts(h)
            for e, k in effects:
                parts = e.mu(c, w, k, parts, h, qr)
            f = f + share * 4 * g.balls * qr * (parts[0] + parts[1] + parts[2])
        f = f * _gain(w, effects, "friction")
    else:
        q = np.full((len(c.v), 1), 1.0)
        f = w.coulomb * _gain(w, effects, "coulomb") + w.viscous * _gain(w, effects, "viscous") * np.abs(c.v)
    for e, k in effects:
        f = e.magnitude(c, w, k, f, q)
    f = np.maximum(f, 0.0)
    force = f * c.sign
    for e, k in effects:
        force = e.friction(c, w, k, f, force)
    force = force + w.mass * _gain(w, effects, "mass") * c.a + w.offset
    for e, k in effects:
        if isinstance(e, ParameterShift) and e.param == "offset":
            force = force + k * e.p["sign"]
    for e, k in effects:
        force = force + e.add(c, w, k, force)
    for e, k in effects:
        force = e.sensor(c, w, k, force)
    return force


def stated_force(c, w, v, a):
    """Force that the simulation file predicts for the recorded samples with motion (v, a)."""
    if w.law == "guide":
        law = walther_of(w)
        nu = law(c.rec(c.t_block)) if law else w.viscosity
        q = w.guide.ball_load(c.preload)
        f = 4 * w.guide.balls * q * sum(w.guide.mu_parts(w.guide.film(q, v, nu))) * np.sign(v)
    else:
        f = (w.coulomb + w.viscous * np.abs(v)) * np.sign(v)
    return f + w.mass * a + w.offset


def difference(c, w, e, k, without):
    """Change by effect e at scale k at the recorded samples; `without` is the recorded true force without it."""
    if type(e).after_noise is not Effect.after_noise:
        return e.after_noise(c, w, k, without) - without
    if type(e).channels is not Effect.channels:
        y, v = e.channels(c, w, k, c.rec(c.y), c.rec(c.v))
        rate = c.fs / c.keep
        a, true_a = (savgol_filter(x, 21, 3, deriv=2, delta=1 / rate, axis=1) for x in (y, c.rec(c.y)))
        fast = np.abs(c.rec(c.v)) > 2e-3  # below that a coarse encoder stands still and the law has no value
        return np.where(fast, stated_force(c, w, v, a) - stated_force(c, w, c.rec(c.v), true_a), 0.0)
    return c.rec(true_force(c, w, [(e, k)])) - without


def solve(c, w, e, percent):
    """Scale k that gives the asked strength; returns k, the strength reached (%), the difference and the RMS of the base."""
    without = c.rec(true_force(c, w, []))
    moving = np.abs(c.rec(c.v)) > RATE_MOVING
    base = float(np.sqrt(np.mean(without[moving] ** 2)))

    def strength(k):
        d = difference(c, w, e, k, without)
        return 100 * float(np.sqrt(np.mean(d[moving] ** 2))) / base, d
    k, seen, low, high = min(e.first, e.limit), [], 0.0, np.inf
    for _ in range(40):
        s, d = strength(k)
        seen.append((abs(s / percent - 1), k, s, d))
        if seen[-1][0] < 3e-4 or (k >= e.limit and s < percent) or high / max(low, 1e-300) < 1 + 1e-9:
            break
        low, high = (max(low, k), high) if s < percent else (low, min(high, k))
        slope = 1.0
        if len(seen) > 1 and min(s, seen[-2][2]) > 0 and abs(np.log(k / seen[-2][1])) > 1e-12:
            slope = np.clip(np.log(s / seen[-2][2]) / np.log(k / seen[-2][1]), 0.3, 3.0)
        k = k * np.clip((percent / s) ** (1 / slope), 0.05, 20) if s > 0 else 4 * k
        if not low < k < high or len(seen) % 4 == 0 and low > 0 and np.isfinite(high):
            k = np.sqrt(low * high) if low > 0 and np.isfinite(high) else (4 * low if low > 0 else high / 4)
        k = min(k, e.limit)
    _, k, s, d = min(seen, key=lambda x: x[0])
    return k, s, d, base


def tangents(c, w):
    """Columns d force / d ln(gain) of the gains that the tolerance speaks of, over the moving samples, and their names."""
    base, cols = c.rec(true_force(c, w, [])), []
    names = ("preload", "friction", "viscosity") if w.law == "guide" else ("coulomb", "viscous", "mass")
    for name in names:
        keep = dict(w.gains)
        w.gains[name] = w.gains.get(name, 1.0) * 1.001
        cols.append((c.rec(true_force(c, w, [])) - base) * 1000)
        w.gains.clear()
        w.gains.update(keep)
    if w.law == "axis":
        cols.append(np.ones_like(base))
    return names, cols


def whitened(c, sigma, law):
    """Function that whitens a column at the recorded samples for the noise of a law; samples at rest count as 0."""
    m = np.abs(c.rec(c.v)) > RATE_MOVING

    def white(a):
        return noise.white(law, np.where(m, a, 0.0) / sigma[:, None], c.fs / c.keep).ravel()
    return white


def absorbed(c, w, d, sigma, law, tolerance):
    """Part of a difference d that calibration absorbs.

    Returns (1) the share of its energy that free gains on preload, friction, viscosity (axis: Coulomb, viscous, mass,
    offset) take; (2) the size of the rest when the gains are held by their tolerance: z = RMS of whitened rest times
    sqrt(samples), the score that an ideal analyser who knew the shape could reach; (3) that rest itself at the recorded
    samples. Below a score of about 4 nothing can be seen.
    """
    m = np.abs(c.rec(c.v)) > RATE_MOVING
    names, cols = tangents(c, w)
    x, y = np.stack([q[m] for q in cols], 1), d[m]
    fit = x @ np.linalg.lstsq(x, y, rcond=None)[0]
    share = float(1 - np.sum((y - fit) ** 2) / max(np.sum(y**2), 1e-30))
    white = whitened(c, sigma, law)
    x, y = np.stack([white(q) for q in cols], 1), white(d)
    tol = [max(tolerance.get(n, tolerance.get("friction", 0.03)), 1e-6) for n in names] + [1e3] * (x.shape[1] - len(names))
    prior = np.diag(1 / np.array(tol) ** 2)
    g = np.linalg.solve(x.T @ x + prior, x.T @ y)
    return share, float(np.sqrt(np.sum((y - x @ g) ** 2) + g @ prior @ g)), d - sum(a * q for a, q in zip(g, cols))
