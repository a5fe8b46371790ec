"""Input of the rivals: columns of a recording, the law's gain directions, terms that stand for a contract id."""
import numpy as np

from plant.ballguide import BallGuide, walther

DOMAIN = {  # an id and its regressor
    "seal-drag": lambda r: r["s"], "viscous-drag": lambda r: r["v"], "hysteresis-and-slip": lambda r: r["s"] * r["q"] ** (4 / 3),
    "force-offset": lambda r: np.ones_like(r["v"]), "inertia": lambda r: r["a"], "load-crosstalk": lambda r: r["p"],
    "force-drift": lambda r: r["t"], "run-in": lambda r: r["s"] * np.exp(-r["travel"] / r["run_in_m"]),
    "direction-asymmetry": lambda r: np.abs(r["base"]), "hydrodynamic-rolling": lambda r: r["s"] * np.abs(r["v"]) ** 0.66 * r["q"] ** 0.47,
    "thermal-preload": lambda r: r["base"] * r["warm"], "preload-loss": lambda r: r["base"] * r["travel"],
}
VARIABLES = ("s", "v", "q", "t", "T", "y", "a", "travel")  # of the generic library
GENERIC = {  # what a term of the generic library means; any other one has no name
    "1": "force-offset", "s": "seal-drag", "v": "viscous-drag", "a": "inertia", "t": "force-drift", "q": "load-crosstalk", "s q": "hysteresis-and-slip",
    "y": "cable-chain", "s T": "viscosity-temperature", "s travel": "run-in", "s^2": "force-offset", "q travel": "preload-loss",
}


def load(paths):
    """Columns of the recordings, unusable rows dropped."""
    parts = [np.genfromtxt(path, delimiter=",", names=True, invalid_raise=False) for path in paths]
    names = set.intersection(*(set(a.dtype.names) for a in parts))
    c = {n: np.concatenate([np.atleast_1d(a[n]) for a in parts]) for n in names}
    good = np.isfinite(c["drag_force_n"]) & np.isfinite(c["time_s"])
    c = {n: x[good] for n, x in c.items()}
    if len(c["time_s"]) < 200 or np.ptp(c["drag_force_n"]) == 0:
        raise ValueError("fewer than 200 usable rows or a force that never changes")
    return c


def prepare(c, sim, like=None):
    """Regressors of the drag: base law, its gain directions, motion. `like` gives the scales of another part's rows."""
    dt = float(np.median(np.diff(c["time_s"])))
    v = c["velocity_m_s"] if "velocity_m_s" in c else np.gradient(c["position_m"], dt)
    a = c["acceleration_m_s2"] if "acceleration_m_s2" in c else np.gradient(v, dt)
    y = c["position_m"] if "position_m" in c else np.cumsum(v) * dt
    p = c.get("preload_n", np.full_like(v, sim.get("operation", {}).get("preload_n", 3000.0)))
    guide, oil = sim.get("guide", {}), sim.get("lubricant", {})

    def law(gain_p=1.0, gain_nu=1.0):
        if "simulated_force_n" in c:
            return c["simulated_force_n"] * gain_p
        if guide.get("law") == "coulomb-viscous":
            return guide.get("coulomb_n", 20.0) * gain_p * np.sign(v) + guide.get("viscous_n_s_m", 200.0) * gain_nu * v + guide.get("offset_n", 0.0)
        g = BallGuide(conformity=guide.get("conformity", 0.51), exact_angle=guide.get("contact_angle_mode") == "exact", mu_s=guide.get("mu_stribeck", 0.0016))
        nu = walther(oil["viscosity_40_cst"], oil["viscosity_100_cst"])(c["temperature_block_degc"]) if "viscosity_40_cst" in oil else oil.get("viscosity_cst", 100.0)
        q = g.ball_load(p * gain_p)
        return 4 * g.balls * q * sum(g.mu_parts(g.film(q, v, nu * gain_nu))) * np.sign(v)
    mass = sim.get("axis", {}).get("moved_mass_kg", 0.0)
    base = law() + mass * a
    travel = np.cumsum(np.abs(v)) * dt
    block = c.get("temperature_block_degc", np.zeros_like(v))
    warm = c["temperature_rail_degc"] - block if "temperature_rail_degc" in c else block - 20
    # scales of the recording, so that a term means the same on the hold-out
    scale = like or {"preload": float(p.max()), "travel": 0.2 * float(travel[-1]) + 1e-9}
    rows = {"s": np.sign(v), "v": v, "a": a, "p": p, "q": p / scale["preload"], "t": c["time_s"] - c["time_s"][0], "travel": travel, "warm": warm, "base": base,
            "y": y - y.mean(), "T": block - block.mean(), "run_in_m": np.full_like(v, scale["travel"])}
    gains = np.stack([base, (law(1.01) - law()) * 100, (law(1.0, 1.01) - law()) * 100], 1)
    near_border = np.zeros(len(v), bool)
    if "segment" in c:  # a derivative across the border of two runs is meaningless
        for i in np.flatnonzero(np.diff(c["segment"])):
            near_border[max(0, i - 3):i + 5] = True
    keep = ~near_border & (np.abs(v) > 1e-3) & np.isfinite(base) & np.isfinite(c["drag_force_n"]) & np.all(np.isfinite(gains), axis=1)
    return {k: x[keep] for k, x in rows.items()}, gains[keep], c["drag_force_n"][keep], scale


def domain(rows):
    """Columns of the domain library, in arbitrary units."""
    return np.stack([term(rows) for term in DOMAIN.values()], 1)


def generic(rows):
    """Constant, variables, squares and products of the generic library."""
    x = [rows[n] for n in VARIABLES]
    return np.stack([np.ones_like(x[0])] + x + [x[i] * x[j] for i in range(len(x)) for j in range(i, len(x))], 1)


def generic_names():
    """Names of the columns of `generic`."""
    return ["1", *VARIABLES] + [f"{VARIABLES[i]}^2" if i == j else f"{VARIABLES[i]} {VARIABLES[j]}" for i in range(len(VARIABLES)) for j in range(i, len(VARIABLES))]
