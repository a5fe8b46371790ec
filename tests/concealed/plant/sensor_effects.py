"""Faults of the force cell, its converter, the clock and the encoder."""
import numpy as np
from scipy.signal import lfilter
from .effect import Effect


class ForceOffset(Effect):
    """S1: a constant error of the zero."""
    id, unit, name_k, first, equivalents = "force-offset", "N", "offset_n", 1.0, ("gravity-tilt",)

    def draw(self, rng, world, design):
        self.p = {"sign": rng.choice([-1.0, 1.0])}

    def sensor(self, c, w, k, force):
        return force + k * self.p["sign"]


class ForceDrift(Effect):
    """S1: a zero that wanders: settling electronics, the cell's own temperature, a slow wave."""
    id, unit, name_k, first = "force-drift", "N", "drift_n", 1.0

    def draw(self, rng, world, design):
        self.p = {"sign": rng.choice([-1.0, 1.0]), "settling_share_of_session": rng.uniform(0.25, 0.6), "temperature_share": rng.uniform(0.0, 0.3),
                  "wave_share": rng.uniform(0.03, 0.12), "waves": rng.uniform(1.2, 2.6), "phase": rng.uniform(0, 6)}

    def sensor(self, c, w, k, force):
        x = (c.t - c.t[0, 0]) / (c.t[-1, -1] - c.t[0, 0])
        warm = (c.t_block - c.t_block[0, 0]) / max(np.ptp(c.t_block), 1e-6)
        p = self.p
        d = (1 - p["temperature_share"]) * (1 - np.exp(-x / p["settling_share_of_session"])) + p["temperature_share"] * warm
        return force + k * p["sign"] * (d + p["wave_share"] * np.sin(2 * np.pi * p["waves"] * x + p["phase"]))


class ForceGain(Effect):
    """S2: an error of the scale, exactly like one of the friction."""
    id, name_k, first, equivalents = "force-gain", "gain_error", 0.02, ("parameter-shift",)

    def draw(self, rng, world, design):
        self.p = {"sign": rng.choice([-1.0, 1.0])}

    def sensor(self, c, w, k, force):
        return force * (1 + k * self.p["sign"])


class LoadCrosstalk(Effect):
    """S3: a share of the lateral load (the preload) shows in the drag channel, always with one sign."""
    id, name_k, first = "load-crosstalk", "share_of_preload", 2e-4

    def draw(self, rng, world, design):
        self.p = {"sign": rng.choice([-1.0, 1.0]), "curvature": rng.uniform(-0.05, 0.05)}

    def sensor(self, c, w, k, force):
        x = c.preload / 5000.0
        return force + k * self.p["sign"] * c.preload * (1 + self.p["curvature"] * (x - 1))


class ForceLowpass(Effect):
    """S4: filter of the amplifier, first order or second order."""
    id, unit, name_k, first, limit, near = "force-lowpass", "s", "time_constant_s", 0.01, 1.5, ("time-misalignment", "presliding")

    def draw(self, rng, world, design):
        order = float(rng.integers(1, 3))  # one direction only: first order, so that it really is a frictional lag
        self.p = {"order": 1.0 if design.get("one_way") else order, "second_share": rng.uniform(0.2, 0.45)}

    def sensor(self, c, w, k, force):
        taus = [k] if self.p["order"] == 1 else [k * (1 - self.p["second_share"]), k * self.p["second_share"]]
        for tau in taus:
            g = np.exp(-1 / (tau * c.fs))
            force = lfilter([1 - g], [1, -g], force, axis=1, zi=g * force[:, :1])[0]
        return force


class TimeMisalignment(Effect):
    """S5: the force channel lags (or leads) by a constant time."""
    id, unit, name_k, first, limit, near = "time-misalignment", "s", "delay_s", 0.01, 0.5, ("force-lowpass",)

    def draw(self, rng, world, design):
        self.p = {"sign": 1.0 if rng.random() < 0.8 else -1.0}

    def sensor(self, c, w, k, force):
        i = np.arange(force.shape[1]) - self.p["sign"] * k * c.fs
        return np.array([np.interp(i, np.arange(force.shape[1]), f) for f in force])


class ForceQuantisation(Effect):
    """S6: coarse converter."""
    id, unit, name_k, first = "force-quantisation", "N", "step_n", 1.0

    def draw(self, rng, world, design):
        self.p = {"fraction": rng.uniform(0, 1)}

    def after_noise(self, c, w, k, recorded):
        return (np.round(recorded / k + self.p["fraction"]) - self.p["fraction"]) * k


class ForceSaturation(Effect):
    """S7: the channel ends before the force does; the two rails differ a little."""
    id, unit, name_k, first, limit = "force-saturation", "1/N", "inverse_range", 1e-2, 10.0

    def draw(self, rng, world, design):
        self.p = {"lower_ratio": rng.uniform(0.97, 1.03)}

    def after_noise(self, c, w, k, recorded):
        return np.clip(recorded, -self.p["lower_ratio"] / k, 1 / k)


class CouplingBacklash(Effect):
    """S8: after a reversal the drive crosses a gap without force; the stop is met over a short ramp."""
    id, unit, name_k, first, limit, near = "coupling-backlash", "m", "gap_m", 2e-5, 5e-3, ("presliding",)

    def draw(self, rng, world, design):
        self.p = {"ramp_share": rng.uniform(0.05, 0.2)}

    def sensor(self, c, w, k, force):
        ramp = self.p["ramp_share"] * k
        if w.law == "axis" or w.mass > 0:  # inertia turns the force while the axis still moves: the gap counts from the change of sign
            weight = np.empty(force.shape)
            for r, f in enumerate(force):
                side = np.where(np.abs(f) > 1e-3, np.sign(f), 0)
                seen = np.maximum.accumulate(np.where(side != 0, np.arange(len(f)), 0))
                turn = np.diff(side[seen], prepend=side[seen[0]]) != 0
                turn[:int(0.02 * c.fs)] = False
                at = np.maximum.accumulate(np.where(turn, c.s[r], -1.0))
                weight[r] = np.where(at < 0, 1.0, np.clip((c.s[r] - at - (k - ramp)) / ramp, 0, 1))
            return force * weight
        dx = np.diff(c.y, axis=1, prepend=c.y[:, :1])
        moving = np.argmax(np.abs(dx) > 1e-9, axis=1)
        ahead = np.take_along_axis(dx, moving[:, None], axis=1)[:, 0] > 0
        p, weight = np.where(ahead, k, 0.0), np.empty(force.shape)
        for i in range(dx.shape[1]):
            p = np.clip(p + dx[:, i], 0, k)
            weight[:, i] = np.where(force[:, i] >= 0, np.clip((p - (k - ramp)) / ramp, 0, 1), np.clip((ramp - p) / ramp, 0, 1))
        return force * weight


class SpeedNoise(Effect):
    """S9: a coarse encoder; the drive's velocity is the central difference of its counts."""
    id, unit, name_k, first, limit = "speed-noise", "m", "count_m", 1e-5, 5e-3

    def channels(self, c, w, k, y, v):
        y = np.floor(y / k) * k
        rate = c.fs / c.keep
        return y, np.gradient(y, axis=1) * rate


class EncoderCyclicError(Effect):
    """S11: interpolation error of the scale, once and twice a period."""
    id, unit, name_k, first, limit, near = "encoder-cyclic-error", "m", "amplitude_m", 1e-5, 3e-4, ("drive-ripple",)

    def draw(self, rng, world, design):
        self.p = {"period_m": float(rng.choice([0.004, 0.005, 0.008])), "second": rng.uniform(0.1, 0.4), "phase": rng.uniform(0, 6)}

    def channels(self, c, w, k, y, v):
        u = 2 * np.pi * y / self.p["period_m"] + self.p["phase"]
        e = k * (np.sin(u) + self.p["second"] * np.sin(2 * u + 1.0))
        slope = k * 2 * np.pi / self.p["period_m"] * (np.cos(u) + 2 * self.p["second"] * np.cos(2 * u + 1.0))
        return y + e, v * (1 + slope)


EFFECTS = [ForceOffset, ForceDrift, ForceGain, LoadCrosstalk, ForceLowpass, TimeMisalignment, ForceQuantisation, ForceSaturation,
           CouplingBacklash, SpeedNoise, EncoderCyclicError]
