"""Steady drag of a ball guide from exact Hertz contacts.

Written from the physics page (sections A and C) with complete elliptic integrals; the reduced closed form C.1 is used
only by `check` to confirm it.

    rho ratio    F(rho) = (1/f) / (4 - 1/f) = ((k^2+1)E - 2K) / ((k^2-1)E),  m = 1 - 1/k^2,  k = a/b
    half axes    a = a* (3 Q E'' / (2 S))^(1/3) ... with S = curvature sum (4f-1)/(f D), E'' = 2 (1-nu^2)/E
    pressure     p = 3 Q / (2 pi a b)                        (the maximum)
    slip         u/V = c^2 a^2 / ((R + sqrt(R^2-c^2 a^2)) r0),  c = 2 sin 10 deg
    Hersey       H = nu u / p                                (nu: the number of cSt)
    drag         F = 4 Z Q (mu_c + mu_v H + mu_s exp(-k_s H))
"""
from dataclasses import dataclass, field
import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

MU_C, MU_V, MU_S, K_S = 0.00182, 8.74e6, 0.0016, 7.43e10


@dataclass
class BallGuide:
    """Geometry and friction constants; SI units, viscosity as the number of cSt."""
    diameter: float = 6.35e-3
    balls: int = 13
    alpha: float = np.deg2rad(45.0)
    conformity: float = 0.51
    young: float = 206e9
    poisson: float = 0.3
    exact_angle: bool = False
    mu_c: float = MU_C
    mu_v: float = MU_V
    mu_s: float = MU_S
    k_s: float = K_S
    constants: dict = field(default_factory=dict)

    def __post_init__(self):
        f, d = self.conformity, self.diameter
        target = (1 / f) / (4 - 1 / f)

        def mismatch(k):
            m = 1 - 1 / k**2
            e, kk = ellipe(m), ellipk(m)
            return ((k**2 + 1) * e - 2 * kk) / ((k**2 - 1) * e) - target
        k = brentq(mismatch, 1.001, 200.0, xtol=1e-13)
        m = 1 - 1 / k**2
        e, kk = ellipe(m), ellipk(m)
        a_star = (2 * k**2 * e / np.pi) ** (1 / 3)
        b_star = (2 * e / (np.pi * k)) ** (1 / 3)
        d_star = 2 * kk / np.pi * (np.pi / (2 * k**2 * e)) ** (1 / 3)
        s = (4 * f - 1) / (f * d)
        e2 = 2 * (1 - self.poisson**2) / self.young
        base = (1.5 * e2 / s) ** (1 / 3)
        self.k_a, self.k_b = a_star * base, b_star * base
        # approach of one contact; two contacts (rail, block) in series
        self.eps = 2 * (0.5 * d_star * (1.5 * e2) ** (2 / 3) * s ** (1 / 3))
        self.s0 = (2 * f - 1) * d
        self.radius = 2 * f * d / (2 * f + 1)
        self.ellipe_m = e

    def half_axes(self, q):
        """Half axes a, b (m) of one contact under q (N)."""
        c = np.cbrt(q)
        return self.k_a * c, self.k_b * c

    def slip_ratio(self, q):
        """abs(u)/V at the contact centre."""
        a, _ = self.half_axes(q)
        c = 2 * np.sin(np.deg2rad(10.0))
        rr = np.sqrt(self.radius**2 - (c * a) ** 2)
        r0 = rr - np.sqrt(self.radius**2 - a**2) + np.sqrt(self.diameter**2 / 4 - a**2)
        return (c * a) ** 2 / ((self.radius + rr) * r0)

    def film(self, q, v, nu):
        """k_s H (dimensionless) at ball load q, speed v (m/s), viscosity number nu."""
        a, b = self.half_axes(q)
        p = 3 * q / (2 * np.pi * a * b)
        return self.k_s * nu * np.abs(v) * self.slip_ratio(q) / p

    def mu_parts(self, h):
        """Coulomb, viscous and Stribeck share of the friction coefficient at h = k_s H."""
        return self.mu_c, self.mu_v / self.k_s * h, self.mu_s * np.exp(-h)

    def ball_load(self, preload):
        """Load of one ball (N) from the preload (N)."""
        y = np.asarray(preload, float) / (2 * self.balls * np.cos(self.alpha))
        if not self.exact_angle:
            return y
        q, kap = y.copy(), self.eps / self.s0
        for _ in range(30):
            r = np.cbrt(q) ** 2
            q = q - (q / (1 + kap * r) - y) * (1 + kap * r) ** 2 / (1 + kap * r / 3)
        return q

    def interference(self, q):
        """Elastic approach (m) of a ball between its two raceways."""
        return self.eps * np.cbrt(q) ** 2


def walther(nu40, nu100):
    """Viscosity law nu(T degC) of ISO grades: loglog(nu + 0.7) = A - B log T_K."""
    z = [np.log10(np.log10(n + 0.7)) for n in (nu40, nu100)]
    x = [np.log10(t + 273.15) for t in (40.0, 100.0)]
    b = (z[0] - z[1]) / (x[1] - x[0])
    a = z[0] + b * x[0]
    return lambda t: 10 ** (10 ** (a - b * np.log10(np.asarray(t) + 273.15))) - 0.7
