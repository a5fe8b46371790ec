"""Rivals of the analyser: rival.py threshold|lasso-bic RECORDING... --simulation SIM [--json OUT].

The diagnosis follows the public contract, so the same runner and scorer apply. The law of the simulation file is
evaluated here with the generator's own ball guide; gains on preload, friction and viscosity are free, as they are for
everybody. Exit status: 0 nothing found, 1 something found, 3 unusable.
"""
import argparse
import json
import sys
import tomllib
from pathlib import Path
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from plant.ballguide import BallGuide, walther  # noqa: E402

TERMS = {  # the domain library: an id and its regressor
    "seal-drag": lambda r: r["s"], "viscous-drag": lambda r: r["v"], "hysteresis-and-slip": lambda r: r["s"] * r["q"] ** (4 / 3),
    "force-offset": lambda r: np.ones_like(r["v"]), "inertia": lambda r: r["a"], "load-crosstalk": lambda r: r["p"],
    "force-drift": lambda r: r["t"], "run-in": lambda r: r["s"] * np.exp(-r["travel"] / (0.2 * r["travel"][-1] + 1e-9)),
    "direction-asymmetry": lambda r: np.abs(r["base"]), "hydrodynamic-rolling": lambda r: r["s"] * np.abs(r["v"]) ** 0.66 * r["q"] ** 0.47,
    "thermal-preload": lambda r: r["base"] * r["warm"], "preload-loss": lambda r: r["base"] * r["travel"],
}


def load(paths):
    """Columns of the recordings, unusable rows dropped."""
    parts = []
    for path in paths:
        a = np.genfromtxt(path, delimiter=",", names=True, invalid_raise=False)
        parts.append(a)
    names = set.intersection(*(set(a.dtype.names) for a in parts))
    c = {n: np.concatenate([np.atleast_1d(a[n]) for a in parts]) for n in names}
    good = np.isfinite(c["drag_force_n"]) & np.isfinite(c["time_s"])
    c = {n: x[good] for n, x in c.items()}
    if len(c["time_s"]) < 200 or np.ptp(c["drag_force_n"]) == 0:
        raise ValueError("fewer than 200 usable rows or a force that never changes")
    return c


def prepare(c, sim):
    """Regressors of the drag: base law, its gain directions, motion."""
    dt = float(np.median(np.diff(c["time_s"])))
    v = c["velocity_m_s"] if "velocity_m_s" in c else np.gradient(c["position_m"], dt)
    a = c["acceleration_m_s2"] if "acceleration_m_s2" in c else np.gradient(v, dt)
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
    warm = c["temperature_rail_degc"] - c["temperature_block_degc"] if "temperature_rail_degc" in c else c.get("temperature_block_degc", np.zeros_like(v)) - 20
    rows = {"s": np.sign(v), "v": v, "a": a, "p": p, "q": p / p.max(), "t": c["time_s"] - c["time_s"][0], "travel": travel, "warm": warm, "base": base}
    gains = np.stack([base, (law(1.01) - law()) * 100, (law(1.0, 1.01) - law()) * 100], 1)
    near_border = np.zeros(len(v), bool)
    if "segment" in c:  # a derivative across the border of two runs means nothing
        for i in np.flatnonzero(np.diff(c["segment"])):
            near_border[max(0, i - 3):i + 5] = True
    keep = ~near_border & (np.abs(v) > 1e-3) & np.isfinite(base) & np.isfinite(c["drag_force_n"])
    return {k: x[keep] for k, x in rows.items()}, gains[keep], c["drag_force_n"][keep]


def threshold(rows, gains, y):
    """Something is reported where the calibrated residual exceeds 2 % of the drag's RMS."""
    rest = y - gains @ np.linalg.lstsq(gains, y, rcond=None)[0]
    return ["unknown"] if np.sqrt(np.mean(rest**2)) > 0.02 * np.sqrt(np.mean(y**2)) else []


def lasso_bic(rows, gains, y):
    """LASSO path by least angles over the domain library, order by BIC; gains are never penalised."""
    from sklearn.linear_model import LassoLarsIC
    step = max(1, len(y) // 20000)
    names = list(TERMS)
    x = np.stack([TERMS[n](rows) for n in names], 1)[::step]
    g, y = gains[::step], y[::step]

    def rest(z):
        return z - g @ np.linalg.lstsq(g, z, rcond=None)[0]
    x, y = rest(x), rest(y)
    scale = np.sqrt(np.mean(x**2, axis=0)) + 1e-300
    fit = LassoLarsIC("bic", fit_intercept=False).fit(x / scale, y)
    return [names[i] for i in np.argsort(-np.abs(fit.coef_)) if fit.coef_[i] != 0]


METHODS = {"threshold": threshold, "lasso-bic": lasso_bic}


def main():
    """One diagnosis."""
    a = argparse.ArgumentParser()
    a.add_argument("method", choices=METHODS)
    a.add_argument("recordings", nargs="+")
    a.add_argument("--simulation", required=True)
    a.add_argument("--holdout")
    a.add_argument("--json")
    a = a.parse_args()
    try:
        found = METHODS[a.method](*prepare(load(a.recordings), tomllib.loads(Path(a.simulation).read_text())))
        verdict = "match" if not found else ("unexplained" if found == ["unknown"] else "explained")
    except ValueError as why:
        print(why, file=sys.stderr)
        found, verdict = [], "insufficient-data"
    entries = [{"id": n, "kind": "unknown" if n == "unknown" else "physics", "confidence": 0.9, "equivalents": []} for n in found]
    text = json.dumps({"schema": "guideblock.diagnosis/1", "verdict": verdict, "mechanisms": entries}, sort_keys=True)
    if a.json:
        Path(a.json).write_text(text + "\n", encoding="utf-8")
    else:
        print(text)
    return 3 if verdict == "insufficient-data" else int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
