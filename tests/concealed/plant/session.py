"""One measuring session: the world (true and nominal constants), its runs and its channels."""
from dataclasses import dataclass, field
import numpy as np
from scipy.signal import lfilter
from . import motion
from .ballguide import BallGuide, walther

RATE_MOVING = 3e-5  # m/s: slower samples count as resting in every statement about strength


@dataclass
class World:
    """True constants of the machine, and those that the simulation file will state."""
    law: str = "guide"                  # "guide" or "axis" (Coulomb-viscous)
    guide: BallGuide = field(default_factory=BallGuide)
    viscosity: float = 100.0            # cSt, where constant
    oil: tuple = ()                     # (nu40, nu100) when the law itself follows the temperature
    mass: float = 0.0                   # kg moved
    coulomb: float = 0.0
    viscous: float = 0.0
    offset: float = 0.0
    gains: dict = field(default_factory=dict)      # true value / stated value
    tolerance: dict = field(default_factory=dict)


@dataclass
class Session:
    """Arrays of shape (runs, internal samples)."""
    seed: int
    fs: float
    keep: int
    t: np.ndarray
    y: np.ndarray
    v: np.ndarray
    a: np.ndarray
    s: np.ndarray
    t_block: np.ndarray
    t_rail: np.ndarray
    t_ambient: np.ndarray
    t_oil: np.ndarray
    preload: np.ndarray
    external: np.ndarray
    kinds: list
    zero: float = 0.0      # reading of the scale at the beginning of the rail, m

    def rng(self, salt):
        """A generator of its own for random events of this session."""
        return np.random.Generator(np.random.PCG64([self.seed, salt]))

    @property
    def sign(self):
        """Direction, 0 at rest."""
        return np.tanh(self.v / 2e-6)

    def rec(self, x):
        """The recorded samples of an internal array."""
        return np.broadcast_to(x, self.v.shape)[:, ::self.keep]


def make(rng, seed, world, d, runs, seconds, start=0.0):
    """A session of `runs` runs. `d` is the design dictionary of cases.py."""
    rate, keep = d["rate"], d["oversample"]
    fs, n = rate * keep, int(seconds * rate) * keep
    stroke, y, v, a, kinds = d["stroke"], [], [], [], []
    order = rng.permutation(runs)
    ladder = np.geomspace(d["preload"][0], d["preload"][1], runs) if d["preload"][1] > d["preload"][0] else np.full(runs, d["preload"][0])
    preload = ladder[order][:, None] * np.exp(0.05 * rng.standard_normal((runs, 1))) if d["preload"][1] > d["preload"][0] else ladder[:, None]
    preload = np.clip(np.round(preload), 400, 9500)
    for r in range(runs):
        kind = d["kinds"][r % len(d["kinds"])]
        y0 = rng.uniform(0.15, 0.85) * stroke
        lo, hi = d["speed"]
        if kind == "moves":  # every run spans about 1.5 decades of its own
            c = np.exp(rng.uniform(np.log(lo), np.log(hi)))
            vv = motion.moves(rng, n, fs, (max(lo, c / 6), min(hi, c * 6)), d["accel"], d["dwell"], y0, stroke)
        elif kind == "wide":
            vv = motion.moves(rng, n, fs, (lo, hi), d["accel"], d["dwell"], y0, stroke, (0.5, 2.5))
        elif kind == "fast":
            vv = motion.moves(rng, n, fs, (hi / 8, hi), d["accel"], d["dwell"], y0, stroke)
        elif kind == "slow":
            vv = motion.moves(rng, n, fs, (lo, lo * 8), d["accel"], d["dwell"], y0, stroke, (0.3, 2.0))
        elif kind == "handling":
            vv = motion.handling(rng, n, fs, (lo, hi), d["accel"], d["dwell"], y0, stroke)
        elif kind == "micro":
            f = float(rng.choice([0.1, 0.2, 0.5, 1.0, 2.0]))
            vv = motion.sine(rng, n, fs, np.exp(rng.uniform(np.log(2e-4), np.log(5e-3))), f)
        elif kind == "modulation":
            v0 = np.exp(rng.uniform(np.log(0.03), np.log(0.15)))
            vv = motion.modulation(rng, n, fs, v0, float(rng.choice([0.3, 1.0, 3.0])), stroke, y0)
        else:  # one-way
            v0 = np.exp(rng.uniform(np.log(lo), np.log(min(hi, 0.9 * stroke / seconds))))
            vv, y0 = motion.one_way(rng, n, fs, v0, kind == "one-way-modulated"), 0.05 * stroke
        vv, aa = motion.finish(rng, vv, fs, d["jerk_time"], d["ripple"], d.get("inert", 0.02))
        kinds.append(kind)
        y.append(y0 + np.concatenate([[0.0], np.cumsum(0.5 * (vv[1:] + vv[:-1]))]) / fs)
        v.append(vv)
        a.append(aa)
    y, v, a = np.array(y), np.array(v), np.array(a)
    gaps = rng.uniform(*d["gap"], runs)
    t = start + (np.arange(runs) * n / fs + np.concatenate([[0.0], np.cumsum(gaps)[:-1]]))[:, None] + np.arange(n)[None, :] / fs
    s = np.cumsum(np.abs(v).ravel()).reshape(v.shape) / fs
    tb, tr, ta, oil = _temperatures(rng, t, v, gaps, d)
    external = np.zeros((runs, 1))
    if d.get("external"):
        external = np.round(rng.uniform(-1, 1, (runs, 1)) * d["external"])
    return Session(int(seed), fs, keep, t, y, v, a, s, tb, tr, ta, oil, preload, external, kinds, d.get("zero", 0.0))


def _temperatures(rng, t, v, gaps, d):
    """Two nodes (block, rail) between a wandering room and the heat of the drive; the oil leads the sensor by its lag."""
    total = t[-1, -1] - t[0, 0] + 1.0
    x = (t - t[0, 0])
    rise, tau = d["warming"] * rng.uniform(0.8, 1.2), total * rng.uniform(0.3, 0.6)
    ambient = rng.uniform(18, 26) + min(0.1 * d["warming"], 0.8) * np.sin(2 * np.pi * x / total * rng.uniform(0.4, 0.9) + rng.uniform(0, 6))

    def shape(delay):
        wave = np.sin(2 * np.pi * x / total * rng.uniform(1.0, 1.8) + rng.uniform(0, 6))
        return 1 - np.exp(-x / (tau * delay)) + 0.12 * wave
    body = shape(1.0)
    oil = ambient + rise * body
    rail = ambient + rise * (d["rail_share"] * shape(2.2) + d.get("rail_wave", 0.15) * np.sin(2 * np.pi * x / total * rng.uniform(1.5, 3.0) + rng.uniform(0, 6)))
    if d.get("rail_locked"):
        rail = oil - d["rail_locked"] * (oil - oil[0, 0])
    lag = rng.uniform(10, 30)
    block = ambient + rise * (body - (lag / tau) * np.exp(-x / tau))
    return block, rail, ambient + 0 * x, oil


def walther_of(world):
    """Viscosity law of the world's oil, or None when it is constant."""
    return walther(*world.oil) if world.oil else None
