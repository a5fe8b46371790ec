"""Forces of the drive train and the table that are not friction of the guide."""
import numpy as np
from scipy.signal import lfilter
from .effect import Effect


class GravityTilt(Effect):
    """E20: weight component along the rail. Constant: no recording with one mass tells it from a force offset."""
    id, unit, name_k, first, equivalents = "gravity-tilt", "N", "weight_component_n", 1.0, ("force-offset",)

    def draw(self, rng, world, design):
        self.p = {"sign": rng.choice([-1.0, 1.0])}

    def add(self, c, w, k, force):
        return k * self.p["sign"]


class Inertia(Effect):
    """E21: a moved mass that the simulation lacks, a little rotary inertia of the screw included."""
    id, unit, name_k, first = "inertia", "kg", "mass_kg", 5.0

    def add(self, c, w, k, force):
        return k * c.a


class CableChain(Effect):
    """E22: weight of the hanging chain (even, linear and slightly curved in y), bending hysteresis over centimetres, a little drag."""
    id, unit, name_k, first = "cable-chain", "N", "end_to_end_n", 3.0

    def draw(self, rng, world, design):
        self.p = {"sign": rng.choice([-1.0, 1.0]), "curvature": rng.uniform(-0.25, 0.25), "hysteresis_share": rng.uniform(0.03, 0.10),
                  "hysteresis_travel_m": rng.uniform(0.01, 0.04), "drag_share": rng.uniform(0.0, 0.05), "stroke_m": design["stroke"]}

    def add(self, c, w, k, force):
        x = c.y / self.p["stroke_m"] - 0.5
        even = self.p["sign"] * (x + self.p["curvature"] * (2 * x * x - 0.17))
        dx = np.diff(c.y, axis=1, prepend=c.y[:, :1]) / self.p["hysteresis_travel_m"]
        z, loop = np.zeros(len(dx)), np.empty_like(dx)
        for i in range(dx.shape[1]):
            z = np.clip(z + dx[:, i], -1, 1)
            loop[:, i] = z
        return k * (even + self.p["hysteresis_share"] * loop + self.p["drag_share"] * c.sign)


class DriveRipple(Effect):
    """E23: force tied to the drive angle: screw lead with harmonics, and a weaker pole pitch."""
    id, unit, name_k, first, near = "drive-ripple", "N", "amplitude_n", 1.0, ("ball-pass",)

    def draw(self, rng, world, design):
        self.p = {"lead_m": float(rng.choice([0.005, 0.010, 0.016, 0.020])) * (1 + 2e-4 * rng.standard_normal()), "phase": rng.uniform(0, 2 * np.pi, 3),
                  "harmonics": np.array([1.0, rng.uniform(0.1, 0.5), rng.uniform(0.0, 0.3)])}

    def add(self, c, w, k, force):
        u = 2 * np.pi * c.y / self.p["lead_m"]
        return k * sum(a * np.sin((i + 1) * u + p) for i, (a, p) in enumerate(zip(self.p["harmonics"], self.p["phase"])))


class StructuralResonance(Effect):
    """E37: carriage on its drive stiffness, kicked by jerk, by friction reversals and by rolling noise."""
    id, name_k, first, near = "structural-resonance", "participation", 0.3, ("time-misalignment",)

    def draw(self, rng, world, design):
        top = 0.35 * design["rate"]
        self.p = {"frequency_hz": rng.uniform(min(25, 0.2 * design["rate"]), min(70, top)), "damping": rng.uniform(0.01, 0.04), "mass_kg": rng.uniform(3, 12), "noise_share": rng.uniform(0.15, 0.4)}

    def add(self, c, w, k, force):
        f0, z = self.p["frequency_hz"], self.p["damping"]
        om, dt = 2 * np.pi * f0, 1 / c.fs
        # exact poles, unit static gain
        r, th = np.exp(-z * om * dt), om * np.sqrt(1 - z * z) * dt
        den = [1.0, -2 * r * np.cos(th), r * r]
        num = [sum(den)]
        drive = self.p["mass_kg"] * c.a + force
        rough = c.rng(83).standard_normal(c.v.shape) * np.sqrt(np.abs(c.v) + 1e-9)
        rough *= self.p["noise_share"] * 20.0 * (np.std(drive) / max(np.std(rough), 1e-9)) * z
        rough[np.abs(c.v) < 1e-5] = 0.0
        level = drive[:, :1]
        ring = lfilter(num, den, drive - level, axis=1) + level - drive
        return k * (ring + lfilter(num, den, rough, axis=1))


EFFECTS = [GravityTilt, Inertia, CableChain, DriveRipple, StructuralResonance]
