#!/usr/bin/env python3
"""Writes host-tools/runs/shs35_preload_loss.csv: an axis run of a guide block that loses preload on the way.

The run is made by formulas, not measured, and by this program alone: nothing here is shared with the Rust
crates, so that what the block makes of the run is not judged by its own algebra. Needs numpy only.

    python3 tests/golden/make_axis_run.py [OUT.csv]

The block is a THK SHS35V after ZHOU et al., J. Mech. Eng. (CN) 2023, DOI 10.3901/JME.2023.03.208: production
block (contact angle stays at 45 degrees), conformity 0.51, sliding speed in the Hersey number, viscosity as the
number of centistokes, seals off as in the paper. Two minutes on an axis that moves 2 kg:

  motion       strokes between -150 mm and +150 mm, trapezoidal speed, 0.02 to 0.095 m/s, dwell at the ends
  preload      3000 N, falling to 2400 N between 40 s and 80 s (smooth step)
  temperature  24 degC, warming exponentially to 33 degC; oil of viscosity grade 100
  drag force   4 Z_b Q mu(H), with presliding after each reversal, 1 % ripple at the ball-pass wavelength of
               14.3 mm, inertia, and the noise of a good force cell

No block is its data sheet. Friction level, viscosity, oil temperature and seal drag of this specimen differ from
what the block assumes, by amounts drawn once from the standard deviations that the block states for them, so the
estimate is off by what it says it may be off, and not by the noise alone.
"""
import sys
from pathlib import Path

import numpy as np

SEED = 20230308
RATE_HZ = 100.0
DURATION_S = 120.0

# motion
HALF_STROKE_M = 0.150
ACCELERATION_M_S2 = 0.5
DWELL_S = 0.6
SPEEDS_M_S = [0.05, 0.095, 0.08, 0.03, 0.06, 0.095, 0.02, 0.07, 0.04, 0.09]
MOVED_MASS_KG = 2.0

# what happens to the block
PRELOAD_BEFORE_N, PRELOAD_AFTER_N = 3000.0, 2400.0
LOSS_FROM_S, LOSS_TO_S = 40.0, 80.0
TEMPERATURE_COLD_DEGC, TEMPERATURE_WARM_DEGC = 24.0, 33.0
WARM_UP_S = 35.0

# disturbances
RIPPLE = 0.01
BALL_PASS_M = 14.3e-3
FORCE_NOISE_N = 0.03

# the specimen against the block's assumptions, one standard deviation each
FRICTION_SIGMA = 0.03
VISCOSITY_SIGMA = 0.05
OIL_TEMPERATURE_SIGMA_K = 0.5
SEALS_SIGMA_N = 0.1
FRICTION_OFF, VISCOSITY_OFF, OIL_OFF, SEALS_OFF = np.random.default_rng([SEED, 1]).normal(size=4)

# the guide: paper, Table 1, and the assumptions named above
BALL_DIAMETER_M = 6.35e-3
BALLS_PER_ROW = 13
CONTACT_ANGLE_RAD = np.pi / 4
CONFORMITY = 0.51
YOUNG_PA = 206e9
POISSON = 0.3
MU_COULOMB, MU_VISCOUS, MU_STRIBECK, K_STRIBECK = 0.00182, 8.74e6, 0.0016, 7.43e10  # Eq. 20
WALTHER_A, WALTHER_B = 9.252591, 3.586455  # 100 cSt at 40 degC, 11 cSt at 100 degC


def complete_elliptic(kappa):
    """K and E of modulus^2 1 - 1/kappa^2 by Gauss-Legendre quadrature; the integrand is smooth enough."""
    nodes, weights = np.polynomial.legendre.leggauss(400)
    phi = 0.25 * np.pi * (nodes + 1.0)
    root = np.sqrt(1.0 - (1.0 - kappa**-2) * np.sin(phi) ** 2)
    return 0.25 * np.pi * np.sum(weights / root), 0.25 * np.pi * np.sum(weights * root)


def hertz_ellipse():
    """Semi-axes of the slider contact over Q^(1/3), Eq. 9 and 10: (k_a, k_b)."""
    wanted = (1.0 / CONFORMITY) / (4.0 - 1.0 / CONFORMITY)

    def curvature_difference(kappa):
        k, e = complete_elliptic(kappa)
        return ((kappa**2 + 1.0) * e - 2.0 * k) / ((kappa**2 - 1.0) * e)

    low, high = 1.01, 100.0
    for _ in range(100):
        middle = np.sqrt(low * high)
        if curvature_difference(middle) < wanted:
            low = middle
        else:
            high = middle
    kappa = np.sqrt(low * high)
    _, e = complete_elliptic(kappa)
    compliance = 2.0 * (1.0 - POISSON**2) / YOUNG_PA
    curvature_sum = (4.0 * CONFORMITY - 1.0) / (CONFORMITY * BALL_DIAMETER_M)
    scale = np.cbrt(1.5 * compliance / curvature_sum)
    return scale * np.cbrt(2.0 * kappa**2 * e / np.pi), scale * np.cbrt(2.0 * e / (np.pi * kappa))


def steady_drag_n(preload_n, temperature_degc, speed_m_s):
    """Drag force of steady motion, Eq. 1, 6, 11 to 15, 20; always positive."""
    k_a, k_b = hertz_ellipse()
    load_n = preload_n / (2.0 * BALLS_PER_ROW * np.cos(CONTACT_ANGLE_RAD))
    a, b = k_a * np.cbrt(load_n), k_b * np.cbrt(load_n)
    pressure_pa = 1.5 * load_n / (np.pi * a * b)  # Eq. 11: the maximum
    radius = 2.0 * CONFORMITY * BALL_DIAMETER_M / (2.0 * CONFORMITY + 1.0)  # Eq. 13
    rolling_line = 2.0 * np.sin(np.pi / 18.0)  # where a free ball rolls without slip, over a

    def ball_radius(x):
        rim = np.sqrt(radius**2 - a**2)
        return np.sqrt(radius**2 - x**2) - rim + np.sqrt((BALL_DIAMETER_M / 2.0) ** 2 - a**2)

    slip = np.abs(1.0 - ball_radius(0.0 * a) / ball_radius(rolling_line * a))  # Eq. 12 with 14 corrected
    kelvin = 273.15 + temperature_degc + OIL_TEMPERATURE_SIGMA_K * OIL_OFF
    viscosity_cst = 10.0 ** (10.0 ** (WALTHER_A - WALTHER_B * np.log10(kelvin))) - 0.7
    viscosity_cst *= 1.0 + VISCOSITY_SIGMA * VISCOSITY_OFF
    hersey = viscosity_cst * np.abs(speed_m_s) * slip / pressure_pa
    mu = MU_COULOMB + MU_VISCOUS * hersey + MU_STRIBECK * np.exp(-K_STRIBECK * hersey)  # Eq. 20
    mu *= 1.0 + FRICTION_SIGMA * FRICTION_OFF
    # a presliding contact is fully developed after the carriage moved four minor semi-axes
    return 4.0 * BALLS_PER_ROW * load_n * mu + SEALS_SIGMA_N * SEALS_OFF, 4.0 * b


def motion(time_s):
    """Position, velocity and acceleration: dwell, stroke, dwell, stroke back, and so on."""
    position = np.full_like(time_s, -HALF_STROKE_M)
    velocity = np.zeros_like(time_s)
    acceleration = np.zeros_like(time_s)
    start, direction, stroke = 1.0, 1.0, 0  # at rest for a second at first
    while start < time_s[-1]:
        speed = SPEEDS_M_S[stroke % len(SPEEDS_M_S)]
        ramp = speed / ACCELERATION_M_S2
        cruise = (2.0 * HALF_STROKE_M - speed * ramp) / speed
        end = start + 2.0 * ramp + cruise
        t = np.clip(time_s - start, 0.0, end - start)
        up, down = np.minimum(t, ramp), np.maximum(t - ramp - cruise, 0.0)
        level = np.clip(t - ramp, 0.0, cruise)
        travelled = 0.5 * ACCELERATION_M_S2 * up**2 + speed * level + speed * down - 0.5 * ACCELERATION_M_S2 * down**2
        now = time_s >= start
        position[now] = (-direction * HALF_STROKE_M + direction * travelled)[now]
        moving = (time_s >= start) & (time_s < end)
        velocity[moving] = (direction * (ACCELERATION_M_S2 * (up - down)))[moving]
        speeding, braking = moving & (t < ramp), moving & (t >= ramp + cruise)
        acceleration[speeding] = direction * ACCELERATION_M_S2
        acceleration[braking] = -direction * ACCELERATION_M_S2
        start, direction, stroke = end + DWELL_S, -direction, stroke + 1
    return position, velocity, acceleration


def presliding_share(position_m, developed_m):
    """Force over its steady value, -1 to 1: the contacts turn over within `developed_m` of travel (Dahl)."""
    share = np.zeros_like(position_m)
    for n in range(1, len(position_m)):
        step = position_m[n] - position_m[n - 1]
        if step != 0.0:
            towards = np.sign(step)
            # three lengths of the exponential in one developed travel
            share[n] = towards + (share[n - 1] - towards) * np.exp(-3.0 * abs(step) / developed_m[n])
        else:
            share[n] = share[n - 1]
    return share


def run():
    time_s = np.arange(0.0, DURATION_S, 1.0 / RATE_HZ)
    position, velocity, acceleration = motion(time_s)
    progress = np.clip((time_s - LOSS_FROM_S) / (LOSS_TO_S - LOSS_FROM_S), 0.0, 1.0)
    smooth = progress**3 * (10.0 - 15.0 * progress + 6.0 * progress**2)
    preload = PRELOAD_BEFORE_N + (PRELOAD_AFTER_N - PRELOAD_BEFORE_N) * smooth
    temperature = TEMPERATURE_WARM_DEGC + (TEMPERATURE_COLD_DEGC - TEMPERATURE_WARM_DEGC) * np.exp(-time_s / WARM_UP_S)
    steady, developed = steady_drag_n(preload, temperature, velocity)
    ripple = 1.0 + RIPPLE * np.sin(2.0 * np.pi * position / BALL_PASS_M)
    force = steady * ripple * presliding_share(position, developed) + MOVED_MASS_KG * acceleration
    force += np.random.default_rng(SEED).normal(0.0, FORCE_NOISE_N, len(force))
    return time_s, position, force, preload, temperature


def main():
    root = Path(__file__).resolve().parents[2]
    out = Path(sys.argv[1]) if len(sys.argv) > 1 else root / "host-tools" / "runs" / "shs35_preload_loss.csv"
    lines = ["time_s,position_m,drag_force_n,preload_n,temperature_block_degc"]
    for t, x, f, p, c in zip(*run()):
        lines.append(f"{t:.2f},{x:.6f},{f:.3f},{p:.1f},{c:.3f}")
    out.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    print(f"{out}: {len(lines) - 1} samples")
    print(
        f"specimen: friction {100 * FRICTION_SIGMA * FRICTION_OFF:+.2f} %, viscosity {100 * VISCOSITY_SIGMA * VISCOSITY_OFF:+.2f} %, "
        f"oil {OIL_TEMPERATURE_SIGMA_K * OIL_OFF:+.2f} K, seals {SEALS_SIGMA_N * SEALS_OFF:+.3f} N"
    )


if __name__ == "__main__":
    main()
