"""Realistic motion: jerk-limited moves, sines and modulated travel with velocity ripple.

A trapezoidal velocity with acceleration limit is smoothed by a boxcar of the jerk time, which makes it jerk-limited
(jerk = acceleration / jerk time); without a jerk time the acceleration jumps within three internal samples. Ripple multiplies the velocity, so a resting axis rests.
"""
import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import lfilter

STROKE = 1.2  # m


def _smooth(v, fs, jerk_time):
    return uniform_filter1d(v, max(3, int(jerk_time * fs)), mode="nearest")


def moves(rng, n, fs, speed, accel, dwell, y0, stroke=STROKE, length=(0.8, 4.0)):
    """Random point-to-point moves; returns velocity. `speed`, `dwell`, `length` (s) are (low, high), speed log-uniform."""
    v = np.zeros(n)
    i, y, sign = int(rng.uniform(0.1, 0.4) * fs), y0, rng.choice([-1, 1])
    while i < n:
        sign = -sign if rng.random() < 0.75 else sign
        vmax = np.exp(rng.uniform(np.log(speed[0]), np.log(speed[1])))
        room = (stroke - 0.05 - y) if sign > 0 else (y - 0.05)
        if room < 0.25 * min(stroke, 0.2):
            sign = -sign
            room = (stroke - 0.05 - y) if sign > 0 else (y - 0.05)
        dist = min(vmax * rng.uniform(*length), max(room, 1e-4))
        acc = accel * rng.uniform(0.4, 1.0)
        vmax = min(vmax, 0.9 * np.sqrt(dist * acc))
        ta, tc = vmax / acc, max(dist / vmax - vmax / acc, 0.0)
        t = np.arange(int((2 * ta + tc) * fs) + 1) / fs
        seg = np.clip(np.minimum(t / ta, (2 * ta + tc - t) / ta), 0, 1) * vmax * sign
        m = min(len(seg), n - i)
        v[i:i + m] += seg[:m]
        y += seg[:m].sum() / fs
        i += m + int(rng.uniform(*dwell) * fs)
    return v


def handling(rng, n, fs, speed, accel, dwell, y0, stroke=STROKE):
    """Trapezoids of one acceleration between a few taught places, with rests; returns velocity."""
    places, at = rng.uniform(0.06, 0.94, int(rng.integers(3, 6))) * stroke, -1
    v, i, y = np.zeros(n), int(rng.uniform(0.1, 0.4) * fs), y0
    acc = accel * rng.uniform(0.3, 1.0)
    while i < n:
        at = int(rng.choice([p for p in range(len(places)) if p != at]))
        way = places[at] - y
        top = min(np.exp(rng.uniform(np.log(speed[0]), np.log(speed[1]))), np.sqrt(abs(way) * acc))
        ramp, whole = top / acc, abs(way) / top + top / acc
        t = np.arange(int(whole * fs) + 1) / fs
        part = np.sign(way) * top * np.clip(np.minimum(t, whole - t) / ramp, 0, 1)
        m = min(len(part), n - i)
        v[i:i + m] = part[:m]
        y += part[:m].sum() / fs
        i += m + int(rng.uniform(*dwell) * fs)
    return v


def sine(rng, n, fs, amplitude, frequency, drift=0.0):
    """Reversal sinusoid of the given amplitude (m) that starts softly."""
    t = np.arange(n) / fs
    return np.clip(t / 2.0, 0, 1) * amplitude * 2 * np.pi * frequency * np.cos(2 * np.pi * frequency * t) + drift


def modulation(rng, n, fs, v0, frequency, stroke, y0):
    """Unidirectional speed modulation v0 (1 + 0.8 sin), turning round at the stroke ends."""
    t = np.arange(n) / fs
    v = v0 * (1 + 0.8 * np.sin(2 * np.pi * frequency * t)) * np.clip(t / 0.5, 0, 1)
    fold = np.floor((np.cumsum(np.abs(v)) / fs) / (0.45 * stroke)).astype(int) % 2
    side = 1.0 if y0 < 0.5 * stroke else -1.0
    return v * uniform_filter1d(np.where(fold == 0, side, -side), int(0.3 * fs), mode="nearest")


def one_way(rng, n, fs, v0, modulated):
    """Travel in + direction only, already moving at the first sample."""
    t = np.arange(n) / fs
    if not modulated:
        return np.full(n, v0) * (1 + 0.5 * np.sin(2 * np.pi * t / t[-1] * rng.uniform(0.5, 1.5)))
    return v0 * (1 + 0.8 * np.sin(2 * np.pi * rng.uniform(0.5, 4.0) * t + rng.uniform(0, 6)))


def finish(rng, v, fs, jerk_time, ripple, inert=0.02):
    """Jerk limit and velocity ripple, smoothed over `inert` s by the moved mass; returns velocity and acceleration."""
    v = _smooth(_smooth(v, fs, jerk_time), fs, 0.5 * jerk_time)
    band = lfilter([0.06], [1, -0.94], rng.standard_normal(len(v)))
    t = np.arange(len(v)) / fs
    tone = np.sin(2 * np.pi * rng.uniform(3, 12) * t + rng.uniform(0, 6))
    v = v * (1 + ripple * (0.8 * _smooth(_smooth(band, fs, inert), fs, inert) / band.std() + 0.5 * tone))
    return v, np.gradient(v, 1 / fs)
