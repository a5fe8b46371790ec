"""Composition of the sets of cases."""
import numpy as np
from .cases import AXIS_IDS, DAMAGES, PHYSICS, SENSORS, UNDECIDABLE, UNKNOWN
from .noise import LAWS


def _name(kind, effect, n):
    return f"{kind}-{effect or 'any'}-{n:03d}".replace("+", "_")


def development_set(seed, short):
    """Every physics and sensor id at 3 % and 1 % white, some under AR(1); 20 clean with all noise laws, 8 shifts, 20 pairs, 12 unknown, 12 undecidable, 10 axis, 8 damaged."""
    todo, n = [], 0

    def put(kind, effect, **more):
        nonlocal n
        n += 1
        if effect == "coupling-backlash":  # the gap is crossed within milliseconds, so a real one (10 um) is strong while it lasts
            more["strength"] = 8.0 + more.get("strength", 3.0)
        todo.append((_name(kind, effect, n), {"seed": seed * 1000 + n, "kind": kind, "effect": effect if more.pop("pass_effect", True) else None, "short": short} | more))
    every = [("single", i) for i in PHYSICS] + [("sensor", i) for i in SENSORS]
    for kind, i in every:
        put(kind, i, strength=3.0)
    for j in range(20):
        put("clean", None, law=LAWS[j % len(LAWS)])
    for kind, i in every:
        put(kind, i, strength=1.0)
    for p in ("preload", "friction", "viscosity", "friction") * 2:
        put("shift", p, strength=3.0 if len(todo) % 2 else 6.0)
    for j in range(12):
        title = list(UNKNOWN)[j % len(UNKNOWN)]
        put("unknown", title, strength=3.0, law=("white", "ar")[j // len(UNKNOWN)])
    for j in range(12):
        put("undecidable", UNDECIDABLE[j][0], variant=j, strength=3.0, pass_effect=False)
    for j in range(20):
        put("pair", None, strength=3.0, law=("white", "white", "ar")[j % 3])
    for j in range(10):
        put("axis", AXIS_IDS[j % len(AXIS_IDS)] if j < 8 else ("clean", "parameter-shift")[j - 8], strength=3.0)
    for kind, i in every[::3]:
        put(kind, i, strength=3.0, law="ar")
    for j, name in enumerate(DAMAGES):
        put("damaged", name, variant=j, pass_effect=False)
    return todo


def grid_set(seed, short):
    """Every physics and sensor id at 3, 1 and 0.3 %, white and under AR(1); 300 with nothing missing: 200 clean with all noise laws, 100 merely shifted."""
    todo, n = [], 0

    def put(kind, effect, **more):
        nonlocal n
        n += 1
        todo.append((_name(kind, effect, n), {"seed": seed * 1000 + n, "kind": kind, "effect": effect, "short": short} | more))
    for law in ("white", "ar"):
        for strength in (3.0, 1.0, 0.3):
            for kind, i in [("single", i) for i in PHYSICS] + [("sensor", i) for i in SENSORS]:
                # a coupling gap is crossed within milliseconds, so a real one is strong while it lasts
                put(kind, i, strength=strength + (8.0 if i == "coupling-backlash" else 0.0), law=law)
    for j in range(200):
        put("clean", None, law=LAWS[j % len(LAWS)])
    for j in range(100):
        put("shift", ("preload", "friction", "viscosity", "friction")[j % 4], strength=(3.0, 6.0)[j // 4 % 2], law=LAWS[j % len(LAWS)])
    return todo


def mixed_set(seed, count, short):
    """Shares of `count`: 30 % clean (all noise laws), 22 % one physical effect, 10 % sensor fault, 4 % shift, 10 % pair, 10 % unknown, 7 % undecidable, 5 % axis, 2 % damaged."""
    shares = (("clean", 0.30), ("single", 0.22), ("sensor", 0.10), ("shift", 0.04), ("pair", 0.10), ("unknown", 0.10), ("undecidable", 0.07), ("axis", 0.05), ("damaged", 0.02))
    edges = np.cumsum([s for _, s in shares])
    rng = np.random.Generator(np.random.PCG64(seed))
    kinds = [shares[int(np.searchsorted(edges / edges[-1], (i + 0.5) / count))][0] for i in range(count)]
    todo = []
    for i, kind in enumerate(np.array(kinds)[rng.permutation(count)]):
        strength = float(np.exp(rng.uniform(np.log(0.3), np.log(4.0)))) if kind not in ("shift", "undecidable") else float(rng.uniform(2, 5))
        todo.append((f"case-{i:04d}", {"seed": seed * 100000 + i, "kind": str(kind), "strength": strength, "law": str(rng.choice(LAWS[:5])), "short": short}))
    return todo
