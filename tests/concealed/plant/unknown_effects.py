"""Effects that no id of the contract describes. The right answer is `unknown`."""
import numpy as np
from .effect import Effect


class Unknown(Effect):
    """Common part: the contract's answer is `unknown`; `title` says what it is."""
    id, title = "unknown", ""

    def describe(self, k):
        return [{"name": "title", "value": self.title, "unit": ""}] + super().describe(k)


class BeltCreepCogging(Unknown):
    """Sharp odd cogging of a motor behind a creeping belt: periodic in distance travelled, not in place."""
    title, unit, first, near = "belt-creep-cogging", "N", 1.0, ("drive-ripple", "ball-pass")

    def draw(self, rng, world, design):
        self.p = {"travel_period_m": rng.uniform(0.0065, 0.0105), "sharpness": rng.uniform(0.6, 0.85), "creep": rng.uniform(0.01, 0.03)}

    def add(self, c, w, k, force):
        u = 2 * np.pi * (c.s * (1 + self.p["creep"]) + 0.3 * c.y) / self.p["travel_period_m"]
        b = self.p["sharpness"]
        return k * (np.sin(u) / (1 - b * np.cos(u)) ** 1.0) * np.minimum(1, np.abs(c.v) / 1e-4)


class LoadedWindage(Unknown):
    """Drag ~ V^1.5 that FALLS with the preload (grease squeezed out of loaded grooves)."""
    title, unit, first, near = "loaded-windage", "N", 5.0, ("viscous-drag", "hydrodynamic-rolling")

    def draw(self, rng, world, design):
        self.p = {"speed_exponent": rng.uniform(1.4, 1.8), "load_exponent": rng.uniform(-1.0, -0.6)}

    def magnitude(self, c, w, k, f, q):
        return f + k * np.abs(c.v) ** self.p["speed_exponent"] * (c.preload / 3000.0) ** self.p["load_exponent"]


class CageBursts(Unknown):
    """The cage jams at random moments for some tenths of a second."""
    title, first, near = "cage-bursts", 0.1, ("contamination",)

    def draw(self, rng, world, design):
        self.p = {"per_second": rng.uniform(0.06, 0.2), "duration_s": rng.uniform(0.25, 0.9)}

    def magnitude(self, c, w, k, f, q):
        rng, g = c.rng(91), np.zeros(c.v.shape)
        x = c.t - c.t[:, :1]
        for r in range(len(g)):
            for _ in range(rng.poisson(self.p["per_second"] * x[r, -1])):
                t0, d = rng.uniform(0, x[r, -1]), self.p["duration_s"] * rng.uniform(0.4, 1.8)
                g[r] += rng.uniform(0.4, 1.4) * ((x[r] > t0) & (x[r] < t0 + d)) * (1 + 0.3 * np.sin(2 * np.pi * 9.0 * x[r]))
        return f * (1 + k * g)


class Clamping(Unknown):
    """A pneumatic clamp touches the rail on the clock of another machine."""
    title, unit, first, near = "clocked-clamp", "N", 1.0, ("seal-drag",)

    def draw(self, rng, world, design):
        self.p = {"period_s": rng.uniform(4, 11), "duty": rng.uniform(0.2, 0.5), "fill_s": rng.uniform(0.02, 0.15)}

    def magnitude(self, c, w, k, f, q):
        x = np.mod(c.t, self.p["period_s"]) / self.p["period_s"]
        soft = self.p["fill_s"] / self.p["period_s"]
        return f + k * np.clip(x / soft, 0, 1) * np.clip((self.p["duty"] - x) / soft + 1, 0, 1)


class TemperatureGate(Unknown):
    """Above one temperature a plastic part swells and sticks at low speed; it lets go only some kelvin lower."""
    title, first, near = "temperature-gated-stick", 0.1, ("viscosity-temperature", "thermal-preload", "stribeck")

    def draw(self, rng, world, design):
        self.p = {"gate_share": rng.uniform(0.4, 0.6), "slow_m_s": rng.uniform(0.02, 0.06)}

    def magnitude(self, c, w, k, f, q):
        gate = c.t_oil.min() + self.p["gate_share"] * np.ptp(c.t_oil)
        on = 1 / (1 + np.exp(-np.clip((c.t_oil - gate) / 0.03, -40, 40)))
        return f * (1 + k * on * np.exp(-np.abs(c.v) / self.p["slow_m_s"]))


class LoadMemory(Unknown):
    """The friction of a run remembers the preload of the run before and forgets it slowly."""
    title, first, near = "load-memory", 0.05, ("run-in",)

    def draw(self, rng, world, design):
        self.p = {"memory_s": rng.uniform(8, 40)}

    def magnitude(self, c, w, k, f, q):
        before = np.concatenate([c.preload[:1], c.preload[:-1]])
        x = c.t - c.t[:, :1]
        return f * np.maximum(1 + k * np.log(before / c.preload) * np.exp(-x / self.p["memory_s"]), 0.1)


class NeighbourChirp(Unknown):
    """Vibration of a neighbouring machine that runs up and down."""
    title, unit, first, near = "neighbour-chirp", "N", 1.0, ("structural-resonance",)

    def draw(self, rng, world, design):
        self.p = {"low_hz": rng.uniform(4, 8), "high_hz": rng.uniform(14, 30), "cycle_s": rng.uniform(9, 17)}

    def add(self, c, w, k, force):
        low, high, t = self.p["low_hz"], self.p["high_hz"], self.p["cycle_s"]
        phase = np.pi * (low + high) * c.t - 0.5 * (high - low) * t * np.cos(2 * np.pi * c.t / t)
        return k * np.sin(phase) * (np.sin(2 * np.pi * c.t / (2.6 * t)) > -0.3)


class PumpHum(Unknown):
    """A pump on the same frame: one tone and a little of its second harmonic, independent of the carriage."""
    title, unit, first, near = "pump-hum", "N", 1.0, ("structural-resonance",)

    def draw(self, rng, world, design):
        self.p = {"frequency_hz": rng.uniform(5, min(48, 0.4 * design["rate"])), "second": rng.uniform(0.0, 0.2), "phase": rng.uniform(0, 6)}

    def add(self, c, w, k, force):
        u = 2 * np.pi * self.p["frequency_hz"] * c.t + self.p["phase"]
        return k * (np.sin(u) + self.p["second"] * np.sin(2 * u))


class StrokeMemory(Unknown):
    """Long strokes pile up grease before the block; after each reversal it piles up anew."""
    title, unit, first, near = "stroke-memory", "N", 1.0, ("presliding", "starvation")

    def draw(self, rng, world, design):
        self.p = {"heap_travel_m": rng.uniform(0.03, 0.15), "sharpness": rng.uniform(1.5, 3.0)}

    def magnitude(self, c, w, k, f, q):
        out = np.zeros(c.v.shape)
        for r in range(len(out)):
            turn = np.flatnonzero(np.diff(np.sign(c.v[r]), prepend=0) != 0)
            at = np.zeros(c.v.shape[1])
            at[turn] = c.s[r, turn]
            since = c.s[r] - np.maximum.accumulate(np.maximum(at, c.s[r, 0]))
            out[r] = np.minimum((since / self.p["heap_travel_m"]) ** self.p["sharpness"], 4.0)
        return f + k * out


EFFECTS = [BeltCreepCogging, LoadedWindage, CageBursts, Clamping, TemperatureGate, LoadMemory, NeighbourChirp, PumpHum, StrokeMemory]
