"""Effects that change the load of the balls: rail, wear, heat, weights, moments."""
import numpy as np
from .effect import Effect, hertz

PITCH = 0.093 / 13                      # m between balls of one row
BALLS = (np.arange(13) - 6) * PITCH     # m, ball places relative to the block's middle


class RailStraightness(Effect):
    """E15: every ball follows a random profile and 80 mm bolt waves; load by Hertz stiffness, averaged over the block."""
    id, unit, name_k, first = "rail-straightness", "m", "profile_rms_m", 2e-7

    def draw(self, rng, world, design):
        n = 14
        self.p = {"wavelength_m": np.exp(rng.uniform(np.log(0.12), np.log(1.3), n)), "phase": rng.uniform(0, 2 * np.pi, n),
                  "amplitude": rng.standard_normal(n), "bolt_wave": rng.uniform(0.3, 1.0), "bolt_phase": rng.uniform(0, 6)}
        grid = np.linspace(-0.2, 1.6, 3601)
        e = sum(a * l * np.sin(2 * np.pi * grid / l + f) for a, l, f in zip(self.p["amplitude"], self.p["wavelength_m"], self.p["phase"]))
        e = e / e.std() + self.p["bolt_wave"] * np.cos(2 * np.pi * grid / 0.080 + self.p["bolt_phase"])
        self.grid, self.e = grid, e / e.std()

    def preload(self, c, w, k, q):
        out = np.empty(c.v.shape)
        d = np.broadcast_to(w.guide.interference(q), c.v.shape)
        for r in range(len(out)):
            f = np.mean([hertz(k * np.interp(self.grid + o, self.grid, self.e) / d[r].mean()) for o in BALLS], axis=0)
            out[r] = np.interp(c.y[r], self.grid, f)
        return out


class RailJoint(RailStraightness):
    """E16: a step between two rails and the sag at their ends, taken ball by ball; the stiff block evens out what it can."""
    id, name_k, first = "rail-joint", "step_m", 1e-6

    def draw(self, rng, world, design):
        self.p = {"joint_m": rng.uniform(0.2, 0.8) * design["stroke"], "sag_length_m": rng.uniform(0.012, 0.03), "sag_share": rng.uniform(0.0, 0.9)}
        self.grid = np.linspace(-0.2, 1.6, 7201)

    def preload(self, c, w, k, q):
        x = self.grid[None, :] + BALLS[:, None] - self.p["joint_m"]
        step = 0.5 * np.sign(x)
        slope = (BALLS[:, None] * step).sum(0) / (BALLS**2).sum()
        rest = step - step.mean(0) - BALLS[:, None] * slope
        sag = self.p["sag_share"] * np.exp(-np.abs(x) / self.p["sag_length_m"])
        out = np.empty(c.v.shape)
        d = np.broadcast_to(w.guide.interference(q), c.v.shape)
        for r in range(len(out)):
            dr = d[r].mean()
            f = 0.5 * (hertz(k * (sag + rest) / dr) + hertz(k * (sag - rest) / dr)).mean(0)
            out[r] = np.interp(c.y[r], self.grid, f)
        return out


class PreloadLoss(Effect):
    """E17: wear takes interference away with travel, fast at first and then slowly."""
    id, unit, name_k, first, near = "preload-loss", "m", "first_stage_m", 2e-7, ("run-in",)

    def draw(self, rng, world, design):
        self.p = {"first_travel_m": rng.uniform(4, 15) * design.get("travel_scale", 1.0), "second_per_m": rng.uniform(0.002, 0.006) / design.get("travel_scale", 1.0)}

    def preload(self, c, w, k, q):
        loss = 1 - np.exp(-c.s / self.p["first_travel_m"]) + self.p["second_per_m"] * c.s
        return hertz(-k * loss / w.guide.interference(q))


class ThermalPreload(Effect):
    """E18: a rail hotter than the block takes up interference."""
    id, unit, name_k, first = "thermal-preload", "m/K", "interference_per_kelvin", 5e-8

    def preload(self, c, w, k, q):
        return hertz(k * (c.t_rail - c.t_block) / w.guide.interference(q))


class ExternalLoad(Effect):
    """E13: a known weight relieves one half of the rows and loads the other; equilibrium of Hertz springs."""
    id, name_k, first, limit = "external-load", "weight_share_of_column", 1.0, 30.0

    def rows(self, c, w, k, q):
        t = np.linspace(0, 12, 6001)
        lift = (1 + t) ** 1.5 - np.maximum(1 - t, 0) ** 1.5
        x = np.interp(np.abs(k * c.external) / c.preload, lift, t)
        return [(0.5, (1 + x) ** 1.5), (0.5, np.maximum(1 - x, 1e-3) ** 1.5)]


class MomentLoad(Effect):
    """E14: the drive pulls above the rail; the pitch angle loads the end balls beyond what it takes from the middle."""
    id, unit, name_k, first, near = "moment-load", "rad/N", "pitch_per_drive_force", 2e-7, ("inertia",)

    def preload(self, c, w, k, q):
        pull = 0.00243 * 52 * q * c.sign + w.mass * c.a
        x = k * pull / w.guide.interference(q)
        return np.mean([np.maximum(1 + x * o, 0) ** 1.5 for o in BALLS], axis=0)


class BallPass(Effect):
    """E30: four ball rows enter and leave the load zone, each with its own phase and pitch near 2 x 7.15 mm of travel."""
    id, name_k, first = "ball-pass", "amplitude", 0.02

    def draw(self, rng, world, design):
        pitch = 0.0143 * (1 + 0.01 * rng.standard_normal())
        self.p = {"wavelength_m": pitch * (1 + 0.001 * rng.standard_normal(4)), "phase": rng.uniform(0, 2 * np.pi, 4),
                  "row_amplitude": rng.uniform(0.5, 1.5, 4), "second": rng.uniform(0.2, 0.5), "third": rng.uniform(0, 0.25)}

    def magnitude(self, c, w, k, f, q):
        x = np.zeros(c.v.shape)
        for l, ph, a in zip(self.p["wavelength_m"], self.p["phase"], self.p["row_amplitude"]):
            u = 2 * np.pi * c.y / l + ph
            x += a * (np.sin(u) + self.p["second"] * np.sin(2 * u + ph) + self.p["third"] * np.sin(3 * u - ph))
        return f * np.maximum(1 + 0.5 * k * x, 0)


EFFECTS = [RailStraightness, RailJoint, PreloadLoss, ThermalPreload, ExternalLoad, MomentLoad, BallPass]
