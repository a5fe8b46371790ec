"""Noise laws of the force channel, each scaled to unit RMS."""
from functools import lru_cache
import numpy as np
from scipy.linalg import cholesky, solve_triangular, toeplitz
from scipy.signal import lfilter

LAWS = ("white", "ar", "mix", "tails", "hetero", "quantised")
RHO = 0.95                     # AR(1) coefficient of `ar`, from one sample to the next
MEMORIES_S = (0.010, 0.16, 2.5)  # correlation times of `mix`
PIECE = 6000                   # samples that are whitened at once: more than two correlation times of 2.5 s


def _ar(rng, shape, rho):
    burn = 400 + int(6 / max(1 - rho, 1e-4))
    e = rng.standard_normal((shape[0], shape[1] + burn)) * np.sqrt(1 - rho**2)
    return lfilter([1.0], [1.0, -rho], e, axis=1)[:, burn:]


def unit(rng, law, shape, fs):
    """Noise of unit standard deviation, shape (runs, samples); `hetero` varies the level from run to run by +-2."""
    if law == "ar":
        return _ar(rng, shape, RHO)
    if law == "mix":  # three first-order memories from 10 ms to 2.5 s
        parts = [_ar(rng, shape, float(np.exp(-1 / (tau * fs)))) for tau in MEMORIES_S]
        return (parts[0] + parts[1] + parts[2]) / np.sqrt(3.0)
    if law == "tails":
        return rng.standard_t(4, shape) / np.sqrt(2.0)
    e = rng.standard_normal(shape)
    if law == "hetero":
        level = 2.0 ** rng.uniform(-1, 1, (shape[0], 1))
        return e * level / np.sqrt(np.mean(level**2))
    return e


def white(law, x, fs):
    """`x` (runs, samples) through the filter that whitens the noise of a law."""
    if law == "ar":
        return (x[:, 1:] - RHO * x[:, :-1]) / np.sqrt(1 - RHO * RHO)
    if law == "mix":
        pieces = [x[:, i:i + PIECE] for i in range(0, x.shape[1], PIECE)]
        return np.concatenate([solve_triangular(_factor(p.shape[1], fs), p.T, lower=True, check_finite=False).T for p in pieces], axis=1)
    return x


@lru_cache(4)
def _factor(n, fs):
    """Cholesky factor of the covariance of `mix`."""
    lag = np.arange(n) / fs
    return cholesky(toeplitz(sum(np.exp(-lag / tau) for tau in MEMORIES_S) / len(MEMORIES_S)), lower=True)
