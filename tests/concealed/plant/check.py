"""Self-check: `python -m plant check`. Every line states what was measured and what was demanded."""
import json
import tempfile
import tomllib
from pathlib import Path
import numpy as np
from . import cases, manners, noise
from .ballguide import BallGuide, walther
from .pipeline import difference, solve, true_force
from .session import RATE_MOVING, make
from .where import AXES

COLUMNS = {"time_s", "position_m", "velocity_m_s", "drag_force_n", "preload_n", "external_load_n", "temperature_block_degc", "temperature_rail_degc",
           "temperature_ambient_degc", "acceleration_m_s2", "segment", "simulated_force_n"}
KEYS = {"": {"schema"}, "guide": {"parameters", "conformity", "hersey", "contact_angle_mode", "mu_coulomb", "mu_viscous", "mu_stribeck", "stribeck_exponent",
                                  "law", "coulomb_n", "viscous_n_s_m", "offset_n"},
        "lubricant": {"viscosity_cst", "viscosity_40_cst", "viscosity_100_cst"}, "operation": {"preload_n"},
        "axis": {"moved_mass_kg", "zero_speed_m_s", "position_reference"}, "tolerance": {"preload", "friction", "viscosity", "friction_terms", "mass", "relevance"}}

# physics page C.5: F_H, V (m/min), Q, k_s H, drag, preload (conformity 0.51, exact angle, 100 cSt)
TABLE = ((26.81496, 0.1, 0.02367067, 4.720465, 485.8727), (79.33165, 6, 2.043418, 9.354844, 1415.773), (232.0232, 2, 0.978556, 30.60308, 4017.747),
         (477.0602, 0.1, 0.06256477, 82.61576, 7974.862), (477.0602, 6, 3.753886, 57.033, 7974.862))


def _law():
    g, worst = BallGuide(exact_angle=True), 0.0
    for q, v, h, f, p in TABLE:
        hh = g.film(q, v / 60, 100.0)
        ff = 52 * q * sum(g.mu_parts(hh))
        worst = max(worst, abs(hh / h - 1), abs(ff / f - 1), abs(float(g.ball_load(p)) / q - 1))
    q = np.geomspace(26, 540, 50)
    s = np.cbrt(q)
    closed = 0.0473504098 * 100 * 0.05 * s * (1 + 2.334997e-4 * s**2 + 9.582044e-8 * s**4)
    gap = float(np.max(np.abs(closed / g.film(q, 0.05, 100.0) - 1)))
    oil = max(abs(float(walther(100, 11)(t)) / n - 1) for t, n in ((10, 748), (20, 344), (30, 177), (50, 61), (60, 39.5)))
    yield "table C.5", worst, "< 1e-6", worst < 1e-6
    yield "closed form C.1 against exact contacts", gap, "< 1e-5", gap < 1e-5
    yield "Walther oil against the page's numbers", oil, "< 0.01 (rounded there)", oil < 0.01


def _bytes(folder):
    return {p.name: p.read_bytes() for p in sorted(Path(folder).iterdir())}


def _same_bytes(tmp):
    a = [cases.build(31, "pair", tmp / n, None, 2.0, "mix", True) for n in ("a", "b")] and _bytes(tmp / "a")
    same = a == _bytes(tmp / "b")
    cases.build(32, "pair", tmp / "c", None, 2.0, "mix", True)
    yield "same seed, same bytes", float(same), "= 1", same
    yield "another seed, other bytes", float(a != _bytes(tmp / "c")), "= 1", a != _bytes(tmp / "c")


def _strength():
    worst, name = 0.0, ""
    for i, key in enumerate(list(cases.PHYSICS) + list(cases.SENSORS) + list(cases.UNKNOWN)):
        kind = "single" if key in cases.PHYSICS else ("sensor" if key in cases.SENSORS else "unknown")
        rng = np.random.Generator(np.random.PCG64(900 + i))
        plan = cases._plan(rng, kind, key, None)
        d = cases.design(rng, plan["law"], plan["ids"], True)
        tol = {"preload": 0.05}
        w = cases.axis_world(rng, plan["ids"], tol) if plan["law"] == "axis" else cases.guide_world(rng, d, plan["ids"], tol)
        c = make(rng, 900 + i, w, d, 1 if plan["law"] == "axis" else 6, 20.0)
        e = plan["classes"][0](rng, w, d)
        asked = 7.0 if key == "coupling-backlash" else 2.0
        k, _, _, _ = solve(c, w, e, asked)
        without, m = c.rec(true_force(c, w, [])), np.abs(c.rec(c.v)) > RATE_MOVING
        changed = c.rec(true_force(c, w, [(e, k)])) - without
        if not np.any(changed):  # converter and encoder effects
            changed = difference(c, w, e, k, without)
        got = 100 * np.sqrt(np.mean(changed[m] ** 2) / np.mean(without[m] ** 2))
        if abs(got / asked - 1) > worst:
            worst, name = abs(got / asked - 1), key
    # rounding to a converter or encoder step is not a smooth function of the step
    yield f"effect RMS against the asked strength, worst of all ids ({name})", worst, "< 0.01", worst < 0.01


def _noise():
    rng = np.random.Generator(np.random.PCG64(4))
    for law in noise.LAWS:
        x = noise.unit(rng, law, (12, 40000), 200.0)
        sd = abs(float(np.sqrt(np.mean(x**2))) - 1)
        yield f"{law}: unit RMS", sd, "< 0.06", sd < 0.06
        lag = float(np.mean(x[:, 1:] * x[:, :-1]) / np.mean(x**2))
        want = {"white": (-0.01, 0.01), "ar": (0.94, 0.96), "mix": (0.80, 0.90), "tails": (-0.02, 0.02), "hetero": (-0.02, 0.02), "quantised": (-0.02, 0.02)}[law]
        yield f"{law}: lag-1 correlation", lag, f"in {want}", want[0] <= lag <= want[1]
        white = noise.white(law, x[:, :8000], 200.0)
        off = max(abs(float(np.mean(white**2)) - 1), *(abs(float(np.mean(white[:, n:] * white[:, :-n]))) for n in (1, 30, 500)))
        yield f"{law}: made white, variance and correlation over 1, 30 and 500 samples", off, "< 0.06", off < 0.06
    tail = float(np.mean(np.abs(noise.unit(rng, "tails", (4, 40000), 200.0)) > 4))
    yield "tails: share beyond 4 sigma", tail, "> 1e-3 (Gauss 6e-5)", tail > 1e-3
    level = noise.unit(rng, "hetero", (12, 4000), 200.0).std(axis=1)
    yield "hetero: largest over smallest run", float(level.max() / level.min()), "> 1.5", level.max() / level.min() > 1.5


def _where(tmp):
    missing = [k for k in [*cases.PHYSICS, *cases.SENSORS, *cases.UNKNOWN, "parameter-shift"] if k not in AXES]
    yield "ids without axes", float(len(missing)), "= 0 " + " ".join(missing), not missing
    worst, low = 0.0, 1.0
    for i, (kind, effect, axis) in enumerate((("single", "viscous-drag", "velocity"), ("single", "inertia", "acceleration"), ("sensor", "force-offset", "direction"),
                                              ("single", "presliding", "reversal-distance"), ("single", "rail-straightness", "position"))):
        place = cases.build(760 + i, kind, tmp / f"where-{i}", effect, 3.0, "white", True)["effects"][0]["where"]["stretches"][axis]
        worst = max(worst, abs(float(np.sum(place["energy"])) - 1), abs(float(np.sum(place["samples"])) - 1))
        low = min(low, place["explained"])
    yield "energy and samples along an axis add up to 1, worst", worst, "< 1e-9", worst < 1e-9
    yield "least share that the effect's own axis explains, of five", low, "> 0.3", low > 0.3


def _read(path):
    head, *_ = path.read_text().split("\n", 1)
    return head.split(","), np.genfromtxt(path, delimiter=",", skip_header=1, ndmin=2)


def _contract(tmp):
    words = [i for i in list(cases.PHYSICS) + list(cases.SENSORS) + list(cases.UNKNOWN) if i not in ("stribeck", "inertia")] + ["unknown", "shift", "seal", "truth"]
    todo = [("single", "presliding"), ("single", "external-load"), ("clean", None), ("axis", "stribeck"), ("unknown", None), ("pair", None), ("sensor", "speed-noise"),
            ("undecidable", None), ("shift", "viscosity"), ("single", "run-in")]
    bad, ratio = [], []
    for i, (kind, effect) in enumerate(todo):
        out = tmp / f"contract-{i}"
        t = cases.build(700 + i, kind, out, effect, 2.0, "white", True, manner=manners.NAMES[i % len(manners.NAMES)])
        last = -np.inf
        for name in t["files"] + (["holdout.csv"] if t["holdout"] else []):
            head, x = _read(out / name)
            text = ",".join(head) + (out / "simulation.toml").read_text()
            if not set(head) <= COLUMNS or not {"time_s", "drag_force_n"} <= set(head) or not {"position_m", "velocity_m_s"} & set(head):
                bad.append(f"{name}: columns {head}")
            if not np.isfinite(x).all() or not (np.diff(x[:, 0]) > 0).all() or x[0, 0] <= last:
                bad.append(f"{name}: time or cells")
            last = x[-1, 0] if name != "holdout.csv" else last
            if any(w in text for w in words):
                bad.append(f"{name}: leaks {[w for w in words if w in text]}")
        sim = tomllib.loads((out / "simulation.toml").read_text())
        for section, keys in sim.items():
            allowed = KEYS[section] if isinstance(keys, dict) else KEYS[""]
            if not set(keys if isinstance(keys, dict) else [section]) <= allowed:
                bad.append(f"simulation key in {section}")
        force = np.load(out / "truth-force.npy")
        reading = np.concatenate([x[:, h.index("drag_force_n")] for h, x in (_read(out / n) for n in t["files"])]).reshape(force.shape)
        ratio.append(float(np.max(np.abs((reading - force).std(axis=1) / np.array(t["noise"]["sigma_n"]) - 1))))
        json.loads((out / "truth.json").read_text())
    yield "contract: columns, time, cells, keys, leaks", float(len(bad)), "= 0 " + "; ".join(bad), not bad
    yield "recorded minus true force against the stated sigma, worst run", max(ratio), "< 0.05", max(ratio) < 0.05


def _clean(tmp):
    worst = 0.0
    for seed in (801, 802, 803):
        t = cases.build(seed, "clean", tmp / f"clean-{seed}", None, 3.0, "white", True, extras=False)
        out = tmp / f"clean-{seed}"
        head, x = _read(out / "recording.csv")
        col = {n: x[:, i] for i, n in enumerate(head)}
        sim = tomllib.loads((out / "simulation.toml").read_text())
        g = BallGuide(conformity=sim["guide"]["conformity"], exact_angle=sim["guide"]["contact_angle_mode"] == "exact", mu_s=sim["guide"]["mu_stribeck"])
        off = {n: 1 + t["stated_constants_off"].get(n, 0.0) for n in ("preload", "friction", "viscosity")}
        for s in np.unique(col["segment"]):
            m = col["segment"] == s
            y, tt = col["position_m"][m], col["time_s"][m]
            v = np.gradient(y, tt)
            oil = sim["lubricant"]
            nu = oil["viscosity_cst"] if "viscosity_cst" in oil else walther(100, 11)(col["temperature_block_degc"][m])
            q = g.ball_load(col["preload_n"][m] * off["preload"])
            f = 52 * q * sum(g.mu_parts(g.film(q, v, nu * off["viscosity"]))) * np.sign(v) * off["friction"]
            if "acceleration_m_s2" in col:
                f = f + sim["axis"]["moved_mass_kg"] * col["acceleration_m_s2"][m]
            slow = np.convolve(np.abs(v) < 1e-3, np.ones(9), "same") > 0
            if (~slow).sum() > 300:
                r = (col["drag_force_n"][m] - f)[~slow]
                # acceleration is a measured column with noise of its own
                extra = 0.004 * sim["axis"]["moved_mass_kg"]
                worst = max(worst, float(r.std() / np.hypot(t["noise"]["sigma_n"][int(s) - 1], extra)) - 1)
    yield "clean cases: law at the recorded motion leaves the noise only, worst run", worst, "< 0.15", worst < 0.15


def _undecidable(tmp):
    """Each design leaves open what its table names, if the sign allows; friction is no rival of a pushing force."""
    bad = []
    for variant, (name, _, others, _) in enumerate(cases.UNDECIDABLE):
        t = cases.build(910 + variant, "undecidable", tmp / f"undecidable-{variant}", None, 3.0, "ar", True, variant=variant, extras=False)["effects"][0]
        sign = next((p["value"] for p in t["parameters"] if p["name"] == "sign"), 1.0)
        pushes = sign < 0 and name in ("force-offset", "gravity-tilt", "load-crosstalk")
        asked = {i for i in others if not (pushes and i in ("seal-drag", "hysteresis-and-slip"))}
        if set(t["equivalents"]) != asked or {name, *t["equivalents"]} & set(t["also_allowed"]):
            bad.append(f"{variant} {name}: asks for {t['equivalents']} where {sorted(asked)} stand")
    yield "undecidable designs that leave something else than their table says", float(len(bad)), "= 0 " + "; ".join(bad), not bad


def run():
    """All checks; exit status 1 when one fails."""
    failed = 0
    with tempfile.TemporaryDirectory() as folder:
        tmp = Path(folder)
        for lines in (_law(), _same_bytes(tmp), _noise(), _strength(), _where(tmp), _contract(tmp), _clean(tmp), _undecidable(tmp)):
            for name, value, demand, good in lines:
                print(f"{'ok  ' if good else 'FAIL'} {name}: {value:.3g} (demanded {demand})", flush=True)
                failed += not good
    print(f"{failed} failed")
    return 1 if failed else 0
