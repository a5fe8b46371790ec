"""Noise laws of the force channel, each scaled to unit RMS."""
import numpy as np
from scipy.signal import lfilter

LAWS = ("white", "ar", "mix", "tails", "hetero", "quantised")


def _ar(rng, shape, rho):
    burn = 400 + int(6 / max(1 - rho, 1e-4))
    e = rng.standard_normal((shape[0], shape[1] + burn)) * np.sqrt(1 - rho**2)
    return lfilter([1.0], [1.0, -rho], e, axis=1)[:, burn:]


def unit(rng, law, shape, fs):
    """Noise of unit standard deviation, shape (runs, samples); `hetero` varies the level from run to run by +-2."""
    if law == "ar":
        return _ar(rng, shape, 0.95)
    if law == "mix":  # three first-order memories from 10 ms to 2.5 s
        parts = [_ar(rng, shape, float(np.exp(-1 / (tau * fs)))) for tau in (0.010, 0.16, 2.5)]
        return (parts[0] + parts[1] + parts[2]) / np.sqrt(3.0)
    if law == "tails":
        return rng.standard_t(4, shape) / np.sqrt(2.0)
    e = rng.standard_normal(shape)
    if law == "hetero":
        level = 2.0 ** rng.uniform(-1, 1, (shape[0], 1))
        return e * level / np.sqrt(np.mean(level**2))
    return e
