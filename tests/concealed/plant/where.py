"""Where an effect shows: along which axes of the contract, and in which range of each.

The right axes are the variables in the effect's own equation, whatever else correlates with them in one session (runs
that differ in preload differ in time and travel, too). The range follows from the energy of `rest`, what calibration
leaves of the effect's difference, in cells of equal numbers of samples. Periods are right answers by their length.
"""
import numpy as np
from .session import RATE_MOVING

CELLS = 20
AXES = {
    "seal-drag": "direction velocity preload", "viscous-drag": "velocity temperature", "viscosity-temperature": "temperature velocity",
    "self-heating": "time temperature velocity", "hysteresis-and-slip": "preload load", "hydrodynamic-rolling": "velocity preload",
    "traction-saturation": "velocity preload", "stribeck": "velocity", "starvation": "travel dwell time velocity", "run-in": "travel",
    "direction-asymmetry": "direction", "contamination": "travel", "presliding": "reversal-distance", "frictional-lag": "acceleration",
    "breakaway-dwell": "dwell reversal-distance", "rail-straightness": "position wavelength", "rail-joint": "position", "preload-loss": "travel",
    "thermal-preload": "temperature-difference", "external-load": "load", "moment-load": "acceleration load preload", "ball-pass": "wavelength position",
    "gravity-tilt": "direction", "inertia": "acceleration", "cable-chain": "position", "drive-ripple": "wavelength position",
    "structural-resonance": "frequency acceleration", "force-offset": "direction", "force-drift": "time", "force-gain": "load preload velocity",
    "load-crosstalk": "preload load direction", "force-lowpass": "acceleration reversal-distance frequency",
    "time-misalignment": "acceleration reversal-distance", "force-quantisation": "load preload velocity", "force-saturation": "load preload velocity",
    "coupling-backlash": "reversal-distance", "speed-noise": "velocity acceleration", "encoder-cyclic-error": "wavelength position",
    "parameter-shift": "preload load velocity direction acceleration", "belt-creep-cogging": "travel position wavelength",
    "loaded-windage": "velocity preload", "cage-bursts": "time", "clocked-clamp": "time frequency", "pump-hum": "frequency", "temperature-gated-stick": "temperature velocity",
    "load-memory": "time preload", "neighbour-chirp": "frequency time", "stroke-memory": "reversal-distance travel",
}
PERIODS = ("wavelength_m", "lead_m", "period_m", "travel_period_m")


def _since_reversal(c):
    out = np.empty(c.v.shape)
    for r, v in enumerate(c.v):
        moving = np.where(np.abs(v) > 1e-9, np.sign(v), 0)
        seen = moving[np.maximum.accumulate(np.where(moving != 0, np.arange(len(v)), 0))]
        turn = np.flatnonzero(np.diff(seen, prepend=seen[0]) != 0)
        at = np.full(len(v), c.s[r, 0])
        at[turn] = c.s[r, turn]
        out[r] = c.s[r] - np.maximum.accumulate(at)
    return out


def _dwell(c):
    out = np.zeros(c.v.shape)
    for r, v in enumerate(c.v):
        edge = np.flatnonzero(np.diff((np.abs(v) < 1e-5).astype(int), prepend=0, append=0))
        for b, e in zip(edge[::2], edge[1::2]):
            out[r, e:] = (e - b) / c.fs
    return out


def axes(c):
    """Values of the contract's axes at the recorded samples."""
    whole = np.ones_like(c.rec(c.v))
    t, s = c.rec(c.t), c.rec(c.s)
    return {"velocity": np.abs(c.rec(c.v)), "position": c.rec(c.y) + c.zero, "direction": np.sign(c.rec(c.v)), "time": t - t[0, 0], "travel": s - s[0, 0],
            "temperature": c.rec(c.t_block) * whole, "temperature-difference": (c.rec(c.t_block) - c.rec(c.t_rail)) * whole, "load": c.external * whole,
            "preload": c.preload * whole, "acceleration": c.rec(c.a), "reversal-distance": c.rec(_since_reversal(c)), "dwell": c.rec(_dwell(c))}


def _cells(x):
    """Index of the cell of every sample, and the ends of the cells."""
    values, index = np.unique(x, return_inverse=True)
    if len(values) <= CELLS:
        return index, values, values
    edges = np.unique(np.quantile(x, np.linspace(0, 1, CELLS + 1)))
    return np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2), edges[:-1], edges[1:]


def _explained(index, n, y):
    count = np.bincount(index, minlength=n)
    return float(np.sum(np.bincount(index, y, n) ** 2 / np.maximum(count, 1)) / max(np.sum(y**2), 1e-300))


def where(c, e, rest):
    """The right answers about the place of effect `e`."""
    m = np.abs(c.rec(c.v)) > RATE_MOVING
    y, sign = rest[m], np.sign(c.rec(c.v))[m]
    energy, found = max(float(np.sum(y**2)), 1e-300), {}
    for name, x in axes(c).items():
        index, low, high = _cells(np.asarray(x)[m])
        if len(low) < 2:
            continue
        share = max(_explained(index, len(low), y), _explained(index, len(low), y * sign))
        found[name] = {"explained": share, "from": low, "to": high, "samples": np.bincount(index, minlength=len(low)) / len(y),
                       "energy": np.bincount(index, y**2, len(low)) / energy}
    right = AXES[getattr(e, "title", "") or e.id].split()
    periods = [p for n in PERIODS if n in e.p for p in np.atleast_1d(e.p[n]).tolist()]
    tones = [e.p["frequency_hz"]] if "frequency_hz" in e.p else ([e.p["low_hz"], e.p["high_hz"]] if "low_hz" in e.p else [])
    return {"axes": right, "stretches": {n: found[n] for n in right if n in found}, "wavelengths_m": periods, "frequencies_hz": tones, "explained": {n: f["explained"] for n, f in found.items()}}
