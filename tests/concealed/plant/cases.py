"""Designs and cases: which session, which effects, which files."""
from pathlib import Path
import numpy as np
from . import force_effects, friction_effects, manners, noise, preload_effects, sensor_effects, unknown_effects, writer
from .alike import standing
from .ballguide import BallGuide
from .damage import DAMAGES
from .effect import Effect
from .pipeline import ParameterShift, absorbed, difference, solve, stated_force, true_force
from .session import RATE_MOVING, World, make
from .where import where

PHYSICS = {e.id: e for m in (preload_effects, friction_effects, force_effects) for e in m.EFFECTS}
SENSORS = {e.id: e for e in sensor_effects.EFFECTS}
UNKNOWN = {e.title: e for e in unknown_effects.EFFECTS}
AXIS_IDS = ("direction-asymmetry", "stribeck", "drive-ripple", "structural-resonance", "presliding", "time-misalignment", "force-lowpass",
            "coupling-backlash", "cable-chain", "encoder-cyclic-error", "speed-noise", "parameter-shift", "clean", "force-saturation")
AXIS_ONLY = ("speed-noise", "encoder-cyclic-error")  # they show where friction or inertia depends strongly on speed
TRAVEL_BOUND = {"run-in", "preload-loss", "force-drift", "starvation", "self-heating", "viscosity-temperature"}
KINDS = ("single", "clean", "shift", "sensor", "pair", "triple", "unknown", "undecidable", "damaged", "axis")

# designs that cannot separate by construction: (true effect, changes of the design, what else the answer must hold, next run)
UNDECIDABLE = (
    ("seal-drag", {"preload": (3000, 3000), "warming": 0.4}, ["hysteresis-and-slip"], "second-preload"),
    ("hysteresis-and-slip", {"preload": (4500, 4500), "warming": 0.4}, ["seal-drag"], "second-preload"),
    ("force-offset", {"preload": (3000, 3000)}, ["gravity-tilt"], "zero-force"),
    ("gravity-tilt", {}, ["force-offset"], "known-mass"),
    ("load-crosstalk", {"preload": (4000, 4000)}, ["force-offset", "gravity-tilt"], "second-preload"),
    ("force-offset", {"one_way": "one-way", "preload": (3000, 3000), "warming": 0.4}, ["gravity-tilt", "seal-drag", "hysteresis-and-slip"], "turn-block"),
    ("seal-drag", {"one_way": "one-way", "preload": (3000, 3000), "warming": 0.4}, ["gravity-tilt", "force-offset", "hysteresis-and-slip"], "turn-block"),
    ("force-lowpass", {"one_way": "one-way-modulated", "preload": (3000, 3000), "speed": (0.02, 0.04), "mass": 0.0}, ["frictional-lag"], "two-frequencies"),
    ("frictional-lag", {"one_way": "one-way-modulated", "preload": (3000, 3000), "speed": (0.02, 0.04), "mass": 0.0}, ["force-lowpass"], "two-frequencies"),
    ("direction-asymmetry", {"preload": (3000, 3000), "speed": (0.0017, 0.004), "warming": 0.4, "no_micro": True}, ["force-offset", "gravity-tilt"], "turn-block"),
    ("load-crosstalk", {"one_way": "one-way", "preload": (4000, 4000), "warming": 0.4}, ["force-offset", "gravity-tilt", "seal-drag", "hysteresis-and-slip"], "turn-block"),
    ("force-gain", {"mass": 0.0}, ["parameter-shift"], "known-mass"),
)


# RMS noise of a measured acceleration, m/s²
ACCELERATION_NOISE = 0.004

def design(rng, law, ids, short, manner="laboratory"):
    """The measuring programme, adapted to the hidden effect only where it would not show at all otherwise."""
    if law == "axis":
        return {"rate": 1000, "oversample": 2, "stroke": 0.24, "preload": (3000, 3000), "speed": (0.008, 0.14), "accel": 1.5, "dwell": (0.05, 0.5),
                "kinds": ["wide"], "jerk_time": 0.04, "ripple": 0.002, "inert": 0.05, "gap": (20, 60), "warming": 2.5, "rail_share": 0.5} | manners.draw(rng, manner, law, ids)
    kinds = ["moves", "micro", "fast", "moves", "modulation", "slow"] if short else \
        ["moves", "fast", "micro", "moves", "modulation", "slow", "moves", "fast", "micro", "moves", "moves", "slow"]
    d = {"rate": 200, "oversample": 5, "stroke": 1.2, "preload": (500.0, 9000.0), "speed": (0.1 / 60, 1.0), "accel": 3.0, "dwell": (0.1, 0.8), "kinds": kinds,
         "jerk_time": 0.03, "ripple": 0.005, "gap": (20, 150), "warming": float(rng.uniform(6, 10)), "rail_share": float(rng.uniform(0.3, 0.8)),
         "travel_scale": 0.4 if short else 1.0} | manners.draw(rng, manner, law, ids)
    if "breakaway-dwell" in ids:
        d |= {"kinds": ["slow", "slow", "moves"], "dwell": (0.1, 3.0), "preload": (1000.0, 6000.0)}
    if "starvation" in ids:
        d |= {"kinds": ["fast", "fast", "moves"], "dwell": (0.05, 4.0), "gap": (10, 60)}
    if "self-heating" in ids:
        d |= {"kinds": ["fast", "moves", "fast", "slow"], "gap": (10, 240), "warming": 4.0}
    if "frictional-lag" in ids:
        d |= {"kinds": ["modulation", "moves"]}
    if "moment-load" in ids or "inertia" in ids:
        d |= {"kinds": ["fast", "moves", "fast", "moves", "modulation", "micro"], "accel": 6.0, "mass": 40.0 if "moment-load" in ids else 0.0}
    if "coupling-backlash" in ids:
        d |= {"kinds": ["slow", "moves", "slow", "moves", "fast", "slow"], "dwell": (0.05, 0.4)}
    if "external-load" in ids:
        d |= {"external": 6000.0}
    elif rng.random() < 0.15:  # a weight too small to matter (below 0.03 % of the drag)
        d |= {"decoy_weight": 0.08}
    if "contamination" in ids:
        d |= {"speed": (0.1 / 60, 0.2), "kinds": ["moves", "slow", "moves", "moves"]}
    return d


def guide_world(rng, d, ids, tolerance):
    """A true block and the statement about it, each stated constant off by its own share of the tolerance."""
    g = BallGuide(conformity=float(rng.choice([0.51, 0.51, 0.52])), exact_angle=bool(rng.random() < 0.4), mu_s=0.0 if "stribeck" in ids or rng.random() < 0.12 else 0.0016)
    w = World("guide", g)
    if ("viscosity-temperature" not in ids) and rng.random() < (1.0 if "self-heating" in ids else 0.35):
        w.oil = (100.0, 11.0)
    w.mass = d.get("mass", 0.0) if "mass" in d else float(rng.choice([0, 0, 0, 0, 4.0, 40.0])) if "inertia" not in ids else 0.0
    w.tolerance = tolerance
    return w


def axis_world(rng, ids, tolerance):
    """A screw axis like the published 95 kg prismatic drive."""
    small = any(i in AXIS_ONLY for i in ids)
    w = World("axis", mass=float(np.round(rng.uniform(5, 20) if small else rng.uniform(60, 110), 2)), coulomb=float(np.round(rng.uniform(14, 26), 2)),
              viscous=float(np.round(rng.uniform(120, 260), 1)), offset=float(np.round(rng.uniform(-4, 4), 2)))
    w.tolerance = tolerance
    return w


def build(seed, kind, out, effect=None, strength=3.0, law="white", short=False, level=1.0, variant=None, extras=True, manner="laboratory"):
    """Make one case in folder `out`; returns the truth dictionary."""
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    rng = np.random.Generator(np.random.PCG64(seed))
    plan = _plan(rng, kind, effect, variant)
    ids, is_axis = plan["ids"], plan["law"] == "axis"
    d = design(rng, plan["law"], ids, short, manner) | plan["design"]
    if d.get("one_way"):
        d["kinds"] = [d["one_way"]]
    if d.get("no_micro"):
        d["kinds"] = [k for k in d["kinds"] if k in ("moves", "slow")]
    tolerance = {"preload": 0.05, "friction": 0.03, "viscosity": 0.05, "friction_terms": 0.0, "mass": 0.0, "relevance": 0.001}
    if is_axis:
        tolerance = {"friction": 0.03, "friction_terms": 0.0, "mass": 0.02, "relevance": 0.001}
    if kind == "undecidable":  # otherwise the hidden effect would be within the stated tolerance of the constants
        tolerance |= {"preload": 0.003, "friction": 0.003, "viscosity": 0.01}
    if "force-gain" in ids or any(i == "parameter-shift" for i in ids):
        for n in ("preload", "friction", "viscosity", "mass"):
            if n in tolerance:
                tolerance[n] = min(tolerance[n], strength / 100 / 10)
    w = axis_world(rng, ids, tolerance) if is_axis else guide_world(rng, d, ids, tolerance)
    runs, seconds = (int(rng.integers(1, 3)), 25.0) if is_axis else ((6, 20.0) if short else (12, 30.0))
    if is_axis and short:
        runs = 1
    seconds = d.get("seconds", seconds)
    off = rng.random() < 0.5
    if off:
        for n in ("preload", "friction", "viscosity") if not is_axis else ("friction",):
            g = 1 + tolerance[n] * float(np.clip(rng.standard_normal(), -2, 2))
            if is_axis:
                w.gains["coulomb"] = w.gains["viscous"] = g
            else:
                w.gains[n] = g
    c = make(rng, seed * 10 + 1, w, d, runs, seconds)
    if d.get("decoy_weight"):
        c.external = np.round(c.preload * d["decoy_weight"] * rng.uniform(-1, 1, c.preload.shape), 1)
    chosen, report = [], []
    for cls in plan["classes"]:
        e = cls(rng, w, d)
        # each effect of a pair gets its own strength, the second the asked one times 0.6 to 1.6
        pct = strength if not chosen else strength * float(rng.uniform(0.6, 1.6))
        if kind in ("pair", "triple") and cls.id == "coupling-backlash":  # as in every other block: a smaller one is a gap of a wavelength of light
            pct += 8.0
        k, reached, diff, base = solve(c, w, e, pct)
        if e.id == "external-load":  # the weight is known, so the strength scales the weight itself
            c.external, weight, k = np.round(c.external * k, 1), k, 1.0
        if e.id == "viscosity-temperature":
            k = e.warm(c, w, k)
        chosen.append((e, k))
        share, z, rest = absorbed(c, w, diff, _sigma(c, c.rec(true_force(c, w, [])), level), law, tolerance)
        report.append({"id": e.id, "strength_asked_pct": pct, "strength_alone_pct": reached, "parameters": e.describe(k), "reached": bool(abs(reached / pct - 1) < 0.02),
                       "equivalents": sorted(set(plan["equivalents"]) | set(e.equivalents)), "near": list(e.near),
                       "also_allowed": ["load-crosstalk"] if d["preload"][0] == d["preload"][1] and {"force-offset", "gravity-tilt"} & ({e.id} | set(plan["equivalents"])) else [], "absorbed_share_by_gains": share, "ideal_z": z, "where": where(c, e, rest)})
        if kind == "undecidable":
            stands = standing(seed, c, w, d, list(PHYSICS.values()) + list(SENSORS.values()), e, diff, _sigma(c, c.rec(true_force(c, w, [])), level), law, tolerance)
            if share > 0.9:  # constants of the law absorb it, and so does a gain of the channel
                stands |= {"parameter-shift", "force-gain"}
            if d.get("one_way") and "force-gain" in stands:  # in one direction an asymmetry is nothing but a gain
                stands.add("direction-asymmetry")
            # filter and lag fit only with the same time constant, which a second drawing misses; a friction never pushes
            must = [i for i in report[-1]["equivalents"] if i in stands or i in ("frictional-lag", "force-lowpass")]
            report[-1] |= {"equivalents": must, "also_allowed": sorted((stands | set(report[-1]["also_allowed"])) - set(must) - {e.id})}
    clean_force = c.rec(true_force(c, w, []))
    moving = np.abs(c.rec(c.v)) > RATE_MOVING
    base = float(np.sqrt(np.mean(clean_force[moving] ** 2)))
    force = _reading(c, w, chosen)
    for i, r in enumerate(report):
        rest = chosen[:i] + chosen[i + 1:]
        indirect = type(chosen[i][0]).after_noise is not Effect.after_noise or type(chosen[i][0]).channels is not Effect.channels
        r["strength_in_company_pct"] = r["strength_alone_pct"] if indirect or not rest else 100 * float(np.sqrt(np.mean((force - _reading(c, w, rest))[moving] ** 2))) / base
    column_form = extras and kind in ("single", "clean", "axis", "pair") and not any(i in AXIS_ONLY + ("parameter-shift",) for i in ids) and rng.random() < 0.12
    relative = False
    hold = None
    if extras and not (set(ids) & TRAVEL_BOUND) and kind != "damaged" and rng.random() < 0.5:
        relative = rng.random() < 0.3
        if "external-load" in ids:
            d["external"] *= weight
        hold = make(rng, seed * 10 + 2, w, d, 1 if is_axis else (2 if short else 4), seconds, start=float(c.t[-1, -1]) + 600.0)
    show = _columns_shown(rng, is_axis, w, ids, d, kind)
    damage = DAMAGES[plan["damage"]](rng) if plan["damage"] else None
    n_files = 1 if is_axis or kind == "damaged" or rng.random() < 0.8 else int(rng.integers(2, 4))
    true_noise = np.random.Generator(np.random.PCG64([seed, 5]))
    rows, sigma = _record(true_noise, c, w, chosen, force, law, level, show, column_form, d, 0.0)
    files = []
    for i, part in enumerate(np.array_split(np.arange(runs), n_files)):
        name = "recording.csv" if i == 0 else f"recording-{i + 1}.csv"
        files.append(name)
        writer.table({n: (np.asarray(x)[part], f) for n, (x, f) in rows.items()}, out / name, damage)
    np.save(out / "truth-force.npy", force.astype(np.float32))
    if hold is not None:
        held = _reading(hold, w, chosen)
        shift = float(rng.uniform(-0.4, 0.4)) if relative else 0.0
        rows_h, _ = _record(true_noise, hold, w, chosen, held, law, level, show, column_form, d, shift)
        writer.table(rows_h, out / "holdout.csv")
        np.save(out / "truth-force-holdout.npy", held.astype(np.float32))
    stated = {}
    if is_axis and rng.random() < 0.5 or "parameter-shift" in ids and is_axis:
        stated = {"coulomb_n": w.coulomb, "viscous_n_s_m": w.viscous, "offset_n": w.offset, "moved_mass_kg": w.mass}
    writer.simulation(w, d, out / "simulation.toml", stated, tolerance, relative, column_form, float(np.median(c.preload)))
    verdict = plan["verdict"]
    if verdict == "explained" and any(r["equivalents"] for r in report):
        verdict = "ambiguous"
    data = {"schema": "concealed.truth/1", "kind": kind, "law": plan["law"], "seed": seed, "effects": report, "expected_verdict": verdict, "next_experiment": plan["next"],
            "noise": {"law": law, "level_pct_of_run_rms": level, "sigma_n": sigma}, "drag_rms_n": base, "true_force_rms_n": float(np.sqrt(np.mean(force**2))),
            "rows": int(force.size), "runs": [{"kind": k, "preload_n": float(p), "external_load_n": float(x)} for k, p, x in zip(c.kinds, c.preload[:, 0], c.external[:, 0])],
            "stated_constants_off": {k: v - 1 for k, v in w.gains.items() if not k.startswith("_")}, "tolerance": tolerance, "files": files,
            "holdout": None if hold is None else {"file": "holdout.csv", "position_shift_m": shift, "relative": relative}, "force_column": column_form,
            "acceleration_noise_n": w.mass * ACCELERATION_NOISE if "acceleration_m_s2" in rows and not column_form else 0.0,
            "damage": damage.story if damage else None, "columns": list(rows), "short": short, "manner": manner}
    writer.truth(data, out / "truth.json")
    return data


def _plan(rng, kind, effect, variant):
    plan = {"law": "guide", "classes": [], "equivalents": [], "design": {}, "verdict": "explained", "next": None, "damage": None}
    table = PHYSICS | SENSORS | {"parameter-shift": ParameterShift}
    if kind == "single" or kind == "sensor":
        pool = list(PHYSICS if kind == "single" else SENSORS)
        effect = effect or str(rng.choice(pool))
        plan["classes"] = [table[effect]]
    elif kind == "clean":
        plan["verdict"] = "match"
    elif kind == "shift":
        plan["classes"] = [ParameterShift]
        plan["design"] = {"shift_param": effect} if effect else {}
    elif kind in ("pair", "triple"):
        count = 2 if kind == "pair" else 3
        pool = [i for i in list(PHYSICS) + list(SENSORS) if i not in AXIS_ONLY + ("stribeck", "force-gain", "force-quantisation", "force-saturation")]
        names = effect.split("+") if effect else rng.choice(pool, count, replace=False)
        if not effect:
            while any(twins <= set(names) for twins in ({"force-offset", "gravity-tilt"}, {"moment-load", "inertia"})):
                names = rng.choice(pool, count, replace=False)
        # converter and encoder effects act last whatever the order of the list
        plan["classes"] = [table[str(n)] for n in names]
    elif kind == "unknown":
        plan["classes"] = [UNKNOWN[effect] if effect in UNKNOWN else list(UNKNOWN.values())[int(rng.integers(len(UNKNOWN)))]]
        plan["verdict"] = "unexplained"
    elif kind == "undecidable":
        i = int(variant) if variant is not None else int(rng.integers(len(UNDECIDABLE)))
        name, change, others, nxt = UNDECIDABLE[i % len(UNDECIDABLE)]
        plan |= {"classes": [table[name]], "design": dict(change), "equivalents": others, "next": nxt, "verdict": "ambiguous"}
    elif kind == "damaged":
        names = list(DAMAGES)
        plan["damage"] = names[int(variant) % len(names)] if variant is not None else str(rng.choice(names))
        plan["verdict"] = "insufficient-data" if plan["damage"] in ("minutes", "millimetres", "stuck-force", "too-short") else ("match" if not effect else "explained")
        plan["classes"] = [table[effect]] if effect else []
    elif kind == "axis":
        effect = effect or str(rng.choice(AXIS_IDS))
        plan |= {"law": "axis", "classes": [] if effect == "clean" else [table[effect]]}
        plan["verdict"] = "match" if effect == "clean" else "explained"
    else:
        raise ValueError(f"unknown kind {kind}; one of {', '.join(KINDS)}")
    plan["ids"] = [cls.id for cls in plan["classes"]]
    if any(i in AXIS_ONLY for i in plan["ids"]):
        plan["law"] = "axis"
    return plan


def _reading(c, w, chosen):
    """Noise-free recorded force with every effect but those of the converter."""
    return c.rec(true_force(c, w, chosen)).copy()


def _columns_shown(rng, is_axis, w, ids, d, kind):
    accelerated = rng.random() < d["measured_acceleration"] if "measured_acceleration" in d else w.mass > 0
    show = {"velocity": d.get("velocity", rng.random() < 0.5), "position": not d.get("by_speed"), "acceleration": accelerated or rng.random() < (0.6 if "inertia" in ids else 0.3), "rail": rng.random() < 0.6,
            "ambient": rng.random() < 0.5, "preload": not is_axis and (d["preload"][0] < d["preload"][1] or rng.random() < 0.5), "external": "external-load" in ids or "decoy_weight" in d}
    if is_axis:
        show |= {"acceleration": rng.random() < 0.3, "rail": False}
    if "thermal-preload" in ids:
        show["rail"] = True
    if any(i in AXIS_ONLY for i in ids):
        show |= {"acceleration": False, "velocity": "speed-noise" in ids}
    return show


def _sigma(c, force, level):
    """Noise RMS of each run: `level` % of the RMS of its moving samples."""
    moving = [np.abs(v) > RATE_MOVING for v in c.rec(c.v)]
    return level / 100 * np.array([np.sqrt(np.mean(f[m] ** 2)) if m.any() else np.sqrt(np.mean(f**2)) for f, m in zip(force, moving)])


def _record(rng, c, w, chosen, force, law, level, show, column_form, d, shift):
    """Columns with sensor noise; the seed of the noise does not depend on what is hidden."""
    rate = c.fs / c.keep
    sigma = _sigma(c, force, level)
    reading = force + sigma[:, None] * noise.unit(rng, law, force.shape, rate)
    if law == "quantised":
        step = float(np.median(sigma))
        reading = np.round(reading / step) * step
    y, v = c.rec(c.y) + c.zero + shift, c.rec(c.v)
    for e, k in chosen:
        reading = e.after_noise(c, w, k, reading)
        if type(e).channels is not Effect.channels:
            y, v = e.channels(c, w, k, y, v)
    run = np.broadcast_to(np.arange(1, len(y) + 1)[:, None], y.shape)
    rows = {"time_s": (c.rec(c.t), "%.4f"), "position_m": (y, "%.8f" if w.law == "axis" else "%.6f" if d.get("micrometres") else "%.7f")}
    if not show["position"]:
        del rows["position_m"]
    if show["velocity"]:
        rows["velocity_m_s"] = (v + 2e-6 * rng.standard_normal(v.shape), "%.6f")
    rows["drag_force_n"] = (reading, "%.5f")
    if show["preload"]:
        rows["preload_n"] = (c.rec(c.preload), "%.0f")
    if show["external"]:
        rows["external_load_n"] = (c.rec(c.external), "%.1f")
    rows["temperature_block_degc"] = (c.rec(c.t_block) + 0.01 * rng.standard_normal(y.shape), "%.2f")
    if show["rail"]:
        rows["temperature_rail_degc"] = (c.rec(c.t_rail) + 0.01 * rng.standard_normal(y.shape), "%.2f")
    if show["ambient"]:
        rows["temperature_ambient_degc"] = (c.rec(c.t_ambient) + 0.02 * rng.standard_normal(y.shape), "%.2f")
    if show["acceleration"]:
        rows["acceleration_m_s2"] = (c.rec(c.a) + ACCELERATION_NOISE * rng.standard_normal(y.shape), "%.4f")
    if column_form:
        rows["simulated_force_n"] = (stated_force(c, w, c.rec(c.v), c.rec(c.a)), "%.5f")
    rows["segment"] = (run, "%d")
    return rows, sigma
