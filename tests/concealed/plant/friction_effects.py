"""Effects of seals, oil and rolling on the steady friction, and of memory on its sign and size."""
import numpy as np
from scipy.signal import lfilter
from .ballguide import walther
from .effect import Effect
from .session import walther_of


class SealDrag(Effect):
    """E1 (and E25): lips of nearly constant drag, slightly falling with speed, plus a cage that drags once per loop."""
    id, unit, name_k, first = "seal-drag", "N", "seal_n", 1.0
    plain = {"speed_exponent": 0.0, "cage_share": 0.0}

    def draw(self, rng, world, design):
        self.p = {"speed_exponent": rng.uniform(-0.02, 0.02), "cage_share": rng.uniform(0.0, 0.03), "cage_loop_m": rng.uniform(0.42, 0.48)}

    def magnitude(self, c, w, k, f, q):
        lips = (np.abs(c.v) / 0.05 + 1e-3) ** self.p["speed_exponent"]
        return f + k * lips * (1 + self.p["cage_share"] * np.sin(2 * np.pi * c.y / self.p["cage_loop_m"]))


class ViscousDrag(Effect):
    """E2 + E11: seal film c V^n and a share of grease churning nu(T) V^m, no load in either."""
    id, unit, name_k, first, near = "viscous-drag", "N at 1 m/s", "drag_at_1_m_s", 3.0, ("hydrodynamic-rolling",)

    def draw(self, rng, world, design):
        self.p = {"exponent": rng.uniform(0.55, 1.0), "churning_share": rng.uniform(0.0, 0.15), "churning_exponent": rng.uniform(0.8, 1.0)}

    def magnitude(self, c, w, k, f, q):
        v, s = np.abs(c.v), self.p["churning_share"]
        thin = walther(100, 11)(c.t_oil) / walther(100, 11)(25.0)
        return f + k * ((1 - s) * v ** self.p["exponent"] + s * thin * v ** self.p["churning_exponent"])


class ViscosityTemperature(Effect):
    """E3: Vogel oil whose temperature leads the block sensor; the simulation assumes a constant viscosity.

    The oil is an ordinary one: the strength scales how far the machine warms (see `warm`), not the oil.
    """
    id, name_k, first, limit, near = "viscosity-temperature", "warming_scale", 1.0, 5.0, ("self-heating",)

    def draw(self, rng, world, design):
        self.p = {"vogel_b_k": rng.uniform(800, 1000), "vogel_c_k": rng.uniform(100, 118), "reference_share": rng.uniform(0.3, 0.7)}

    def _reference(self, c, w):
        return w.gains.setdefault("_oil_reference", float(c.t_oil.min() + self.p["reference_share"] * np.ptp(c.t_oil)))

    def oil(self, c, w, k, nu, heat):
        b, t0, ref = self.p["vogel_b_k"], self.p["vogel_c_k"], self._reference(c, w)
        warm = ref + k * (c.t_oil - ref)
        return nu * np.exp(np.clip(b * (1 / (warm + t0) - 1 / (ref + t0)), -4, 4))

    def warm(self, c, w, k):
        """Give the session the warming that k stands for; afterwards k is 1."""
        ref = self._reference(c, w)
        for name in ("t_oil", "t_block", "t_rail", "t_ambient"):
            setattr(c, name, ref + k * (getattr(c, name) - ref))
        return 1.0


class SelfHeating(Effect):
    """E4: friction power warms the contact zone over its own node; the block sensor sits elsewhere and does not see it."""
    id, unit, name_k, first, limit, near = "self-heating", "K/W", "contact_resistance", 1.0, 60.0, ("viscosity-temperature", "starvation")

    def draw(self, rng, world, design):
        self.p = {"time_constant_s": rng.uniform(40, 240), "fast_share": rng.uniform(0.1, 0.25), "fast_time_constant_s": rng.uniform(4, 10)}

    def oil(self, c, w, k, nu, heat):
        hot = (1 - self.p["fast_share"]) * _warm(c, heat, self.p["time_constant_s"]) + self.p["fast_share"] * _warm(c, heat, self.p["fast_time_constant_s"])
        law = walther_of(w) or walther(100, 11)
        base = c.t_block if w.oil else 40.0
        return nu * law(base + np.minimum(k * hot, 60.0)) / law(base)


def _warm(c, power, tau):
    """First-order response to the friction power, across the pauses between runs."""
    out, state, g = np.empty_like(power), 0.0, np.exp(-1 / (tau * c.fs))
    for r in range(len(power)):
        if r:
            state *= np.exp(-(c.t[r, 0] - c.t[r - 1, -1]) / tau)
        out[r], _ = lfilter([1 - g], [1, -g], power[r], zi=[g * state])
        state = out[r, -1]
    return out


class HysteresisAndSlip(Effect):
    """E5 + E6: elastic hysteresis ~Q^(4/3) and Heathcote slip ~Q^(5/3) with exact Hertz axes."""
    id, name_k, first, near = "hysteresis-and-slip", "slip_friction", 0.02, ("seal-drag",)

    def draw(self, rng, world, design):
        self.p = {"hysteresis_ratio": rng.uniform(0.02, 0.15)}  # alpha per slip friction

    def magnitude(self, c, w, k, f, q):
        a, b = w.guide.half_axes(q)
        r0 = 0.5 * w.guide.diameter
        slip = 52 * q * a**2 * 0.161142 / (2 * w.guide.radius * r0)
        return f + k * (slip + self.p["hysteresis_ratio"] * 52 * (3 / 16) * q * b / r0)


class HydrodynamicRolling(Effect):
    """E8: rolling resistance of the film inlet ~(nu V)^0.66 Q^0.47 (Houpert's exponents), oil temperature included."""
    id, name_k, first, near = "hydrodynamic-rolling", "scale_of_houpert", 3.0, ("viscous-drag",)

    def draw(self, rng, world, design):
        self.p = {"speed_exponent": 0.66 + 0.01 * rng.standard_normal(), "load_exponent": 0.47 + 0.01 * rng.standard_normal()}

    def magnitude(self, c, w, k, f, q):
        # 0.45 N at 3 kN (165 N a ball), 0.1 m/s, 100 cSt (40 degC)
        law = walther_of(w)
        nu = law(c.t_block) if law else w.viscosity
        return f + k * 0.45 * (nu / 100.0 * np.abs(c.v) / 0.1) ** self.p["speed_exponent"] * (q / 165.0) ** self.p["load_exponent"]


class TractionSaturation(Effect):
    """E9: the viscous share bends over, asinh of Eyring, with a soft limiting shear stress on top."""
    id, name_k, first, limit = "traction-saturation", "inverse_film_at_eyring", 0.05, 50.0

    def draw(self, rng, world, design):
        self.p = {"load_exponent": rng.uniform(-0.1, 0.1), "limiting_share": rng.uniform(0.0, 0.05)}

    def mu(self, c, w, k, parts, h, q):
        x = k * (q / 165.0) ** self.p["load_exponent"] * h
        bend = np.where(x > 1e-6, np.arcsinh(x) / np.maximum(x, 1e-9), 1.0)
        return parts[0], parts[1] * bend / (1 + self.p["limiting_share"] * x), parts[2]


class Stribeck(Effect):
    """Friction falling with speed, for laws without such a term: exp(-(v/vs)^d), guide: in the film number."""
    id, name_k, first = "stribeck", "height", 3e-4

    def draw(self, rng, world, design):
        self.p = {"shape": rng.uniform(0.85, 1.3), "scale": rng.uniform(0.5, 1.6), "speed_m_s": np.exp(rng.uniform(np.log(0.008), np.log(0.03)))}
        if world.law == "axis":
            self.first, self.unit = 2.0, "N"

    def mu(self, c, w, k, parts, h, q):
        return parts[0], parts[1], parts[2] + k * np.exp(-((h / self.p["scale"]) ** self.p["shape"]))

    def magnitude(self, c, w, k, f, q):
        return f if w.law == "guide" else f + k * np.exp(-((np.abs(c.v) / self.p["speed_m_s"]) ** self.p["shape"]))


class Starvation(Effect):
    """E10: strokes push the oil away, a dwell lets it flow back; thin film and more metal contact."""
    id, name_k, first, limit, near = "starvation", "depth", 0.2, 0.98, ("self-heating",)

    def draw(self, rng, world, design):
        self.p = {"depletion_travel_m": rng.uniform(1.5, 5.0), "reflow_s": rng.uniform(8, 25), "metal_share": rng.uniform(0.4, 0.8)}

    def _full(self, c):
        step = 10
        v = np.abs(c.v[:, ::step])
        dt, phi, out = step / c.fs, 1.0, np.empty(v.shape)
        back = 1 - np.exp(-dt / self.p["reflow_s"])
        for r in range(len(v)):
            if r:
                phi = 1 - (1 - phi) * np.exp(-(c.t[r, 0] - c.t[r - 1, -1]) / self.p["reflow_s"])
            for i, x in enumerate(v[r].tolist()):
                phi = phi + (1 - phi) * back if x < 2e-3 else phi * (1 - min(x * dt / self.p["depletion_travel_m"], 0.5))
                phi = max(phi, 0.05)
                out[r, i] = phi
        return np.repeat(out, step, axis=1)[:, :c.v.shape[1]]

    def oil(self, c, w, k, nu, heat):
        if getattr(self, "_of", None) != c.seed:
            self._of, self.phi = c.seed, self._full(c)
        return nu * (1 - k * (1 - self.phi))

    def mu(self, c, w, k, parts, h, q):
        return parts[0] + self.p["metal_share"] * 0.0016 * k * (1 - self.phi), parts[1], parts[2]


class RunIn(Effect):
    """E12: extra drag after relubrication that decays with travel, over two lengths."""
    id, unit, name_k, first, near = "run-in", "N", "first_n", 2.0, ("preload-loss", "force-drift")

    def draw(self, rng, world, design):
        z = design.get("travel_scale", 1.0)
        self.p = {"travel_m": rng.uniform(3, 10) * z, "slow_share": rng.uniform(0.1, 0.3), "slow_travel_m": rng.uniform(15, 40) * z}

    def magnitude(self, c, w, k, f, q):
        s = self.p["slow_share"]
        return f + k * ((1 - s) * np.exp(-c.s / self.p["travel_m"]) + s * np.exp(-c.s / self.p["slow_travel_m"]))


class DirectionAsymmetry(Effect):
    """E19: one direction drags more, in the Coulomb and (differently) in the viscous share."""
    id, name_k, first = "direction-asymmetry", "asymmetry", 0.02

    def draw(self, rng, world, design):
        self.p = {"viscous_ratio": rng.uniform(0.7, 1.3) if world.law == "guide" else rng.uniform(4, 12), "sign": rng.choice([-1.0, 1.0])}

    def magnitude(self, c, w, k, f, q):
        x = np.abs(c.v) / (np.abs(c.v) + 0.05)
        return f * (1 + k * self.p["sign"] * np.sign(c.v) * (1 + (self.p["viscous_ratio"] - 1) * x))


class Contamination(Effect):
    """E24: dirt passes the contacts: isolated twin pulses of constant length in travel, at random places each time."""
    id, name_k, first = "contamination", "mean_share_of_friction", 0.1

    def draw(self, rng, world, design):
        self.p = {"per_metre": rng.uniform(8, 20) if world.law == "guide" else 30.0, "length_m": rng.uniform(0.6e-3, 1.6e-3)}

    def magnitude(self, c, w, k, f, q):
        rng, out, cell = c.rng(71), np.zeros(c.v.shape), 5e-5
        for r in range(len(out)):
            s = c.s[r] - c.s[r, 0]
            grid = np.zeros(int(s[-1] / cell) + 2)
            hits = rng.poisson(self.p["per_metre"] * max(s[-1], 0.05))
            np.add.at(grid, rng.integers(0, len(grid), hits), rng.exponential(1.0, hits))
            n = max(4, int(self.p["length_m"] / cell))
            pulse = np.concatenate([np.hanning(n), np.zeros(n // 2), 0.6 * np.hanning(n)])
            grid = np.convolve(grid, pulse)[:len(grid)]
            out[r] = np.interp(s / cell, np.arange(len(grid)), grid)
        return f * (1 + k * out)


class Presliding(Effect):
    """E34: 4 to 8 slip elements (Masing, non-local memory), or LuGre bristles; breakaway travel grows with the contact width.

    `k` is the share of the friction that has to be built up over travel; the rest (lips, sliding) turns at once.
    """
    id, name_k, first, limit, near = "presliding", "share_of_friction", 0.05, 1.0, ("force-lowpass",)

    def draw(self, rng, world, design):
        n = int(rng.integers(4, 9))
        self.p = {"travel_m": rng.uniform(0.6e-4, 2.5e-4), "elements": n, "travel_shares": np.geomspace(rng.uniform(0.05, 0.12), 1.0, n),
                  "force_shares": rng.dirichlet(np.full(n, 4.0)), "bristles": float(rng.random() < 0.3)}

    def _state(self, c, w):
        shape = np.ones((len(c.v), 1)) if w.law == "axis" else (c.preload / 3000.0) ** (1 / 3)
        dx = np.diff(c.y, axis=1, prepend=c.y[:, :1])
        if self.p["bristles"]:
            d, share = 0.35 * self.p["travel_m"] * shape * np.ones((1, 1)), np.ones(1)
        else:
            d, share = self.p["travel_m"] * shape * self.p["travel_shares"][None, :], self.p["force_shares"]
        z, out = np.zeros(d.shape), np.empty(c.v.shape)
        for i in range(dx.shape[1]):
            u = dx[:, i:i + 1] / d
            z = (z + u) / (1 + np.abs(u)) if self.p["bristles"] else np.clip(z + u, -1, 1)
            out[:, i] = z @ share
        return out

    def friction(self, c, w, k, magnitude, force):
        if getattr(self, "_of", None) != c.seed:
            self._of, self._z = c.seed, self._state(c, w)
        return (1 - k) * force + k * magnitude * self._z


class FrictionalLag(Effect):
    """E35: the size of the friction follows the speed late, faster down than up; its sign turns at once."""
    id, unit, name_k, first, limit, near = "frictional-lag", "s", "lag_s", 0.03, 2.0, ("force-lowpass",)

    def draw(self, rng, world, design):
        self.p = {"down_ratio": 1.0 if design.get("one_way") else rng.uniform(0.8, 1.0)}

    def friction(self, c, w, k, magnitude, force):
        up, down = 1 - np.exp(-1 / (k * c.fs)), 1 - np.exp(-1 / (k * self.p["down_ratio"] * c.fs))
        out, state = np.empty_like(magnitude), magnitude[:, 0].copy()
        for i in range(magnitude.shape[1]):
            e = magnitude[:, i] - state
            state = state + np.where(e > 0, up, down) * e
            out[:, i] = state
        return out * c.sign


class BreakawayDwell(Effect):
    """E36: after rest the friction starts high, the more the longer the rest, and falls within tenths of a millimetre."""
    id, name_k, first, near = "breakaway-dwell", "rise_of_friction", 0.2, ("presliding",)

    def draw(self, rng, world, design):
        self.p = {"dwell_constant_s": rng.uniform(1.0, 6.0), "dwell_exponent": rng.uniform(0.5, 0.8), "travel_m": rng.uniform(1.2e-4, 4e-4), "tail_share": rng.uniform(0.0, 0.15)}

    def magnitude(self, c, w, k, f, q):
        out = np.zeros(c.v.shape)
        for r in range(len(out)):
            rest = np.abs(c.v[r]) < 1e-5
            edge = np.flatnonzero(np.diff(rest.astype(int), prepend=0, append=0))
            start = 0
            for b, e in zip(edge[::2], edge[1::2]):
                if e >= len(rest) or (e - b) < 0.05 * c.fs:
                    continue
                grown = 1 - np.exp(-(((e - b) / c.fs / self.p["dwell_constant_s"]) ** self.p["dwell_exponent"]))
                x = (c.s[r, e:] - c.s[r, e]) / self.p["travel_m"]
                tail = self.p["tail_share"]
                out[r, e:] = grown * ((1 - tail) * np.exp(-x) + tail * np.exp(-x / 4))
        return f * (1 + k * out)


EFFECTS = [SealDrag, ViscousDrag, ViscosityTemperature, SelfHeating, HysteresisAndSlip, HydrodynamicRolling, TractionSaturation,
           Stribeck, Starvation, RunIn, DirectionAsymmetry, Contamination, Presliding, FrictionalLag, BreakawayDwell]
