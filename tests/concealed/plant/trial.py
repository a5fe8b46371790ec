"""The concealed set of a trial: records under meaningless names, answers in a separate folder."""
import shutil
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
import numpy as np
from .cases import AXIS_IDS, DAMAGES, PHYSICS, SENSORS, UNDECIDABLE, UNKNOWN, build
from .manners import NAMES
from .noise import LAWS
from .where import AXES

# block: how many of 960
BLOCKS = {"clean": 300, "sensor": 90, "single": 240, "pair": 90, "triple": 30, "unknown": 120, "undecidable": 60, "damaged": 30}
LADDER = (0.05, 0.1, 0.2, 0.3, 0.3, 0.5, 1.0, 1.0, 2.0, 3.0)


def composition(rng, records):
    """Arguments of `build` for `records` cases, block by block; every block keeps at least one."""
    todo = []
    for block, of_960 in BLOCKS.items():
        for j in range(max(1, round(of_960 * records / 960))):
            case = {"block": block} | _case(rng, block, j)
            todo.append(case | {"manner": _manner(rng, case)})
    return [todo[i] for i in rng.permutation(len(todo))]


def _case(rng, block, j):
    law = str(rng.choice(LAWS[:5]))
    strength = float(np.exp(rng.uniform(np.log(0.3), np.log(3.0))))
    if block == "clean":  # every tenth: a constant of the law off by ten times its tolerance
        if j % 10 == 9:
            return {"kind": "shift", "strength": float(rng.uniform(2, 6)), "law": law}
        return {"kind": "clean", "law": LAWS[j % len(LAWS)]}
    if block == "sensor":
        effect = list(SENSORS)[int(rng.integers(len(SENSORS)))]
        return {"kind": "sensor", "effect": effect, "strength": _crossing(effect, strength), "law": law}
    if block == "single":
        white = ("white", "ar")[int(rng.integers(2))]
        if rng.random() < 0.1:
            axis = [i for i in AXIS_IDS if i not in ("clean", "parameter-shift") and i not in SENSORS]
            return {"kind": "axis", "effect": str(rng.choice(axis)), "strength": max(strength, 1.0), "law": white}
        effect = list(PHYSICS)[int(rng.integers(len(PHYSICS)))]
        return {"kind": "single", "effect": effect, "strength": _crossing(effect, LADDER[j % len(LADDER)]), "law": white}
    if block in ("pair", "triple"):
        return {"kind": block, "strength": float(rng.uniform(1, 3)), "law": ("white", "ar")[int(rng.integers(2))]}
    if block == "unknown":
        return {"kind": "unknown", "effect": list(UNKNOWN)[int(rng.integers(len(UNKNOWN)))], "strength": float(rng.uniform(0.5, 3)), "law": law}
    if block == "undecidable":
        return {"kind": "undecidable", "variant": int(rng.integers(len(UNDECIDABLE))), "strength": float(rng.uniform(2, 5)), "law": law}
    return {"kind": "damaged", "variant": j % len(DAMAGES)}


def _manner(rng, case):
    """Manner of a record: every other one is `laboratory`; of undecidable cases and damaged files all are."""
    manner = "laboratory" if rng.random() < 0.5 else str(rng.choice(NAMES[1:]))
    if case["block"] in ("undecidable", "damaged"):
        return "laboratory"
    # without a scale the start of a run is unknown, and a pair may hold an effect tied to a place
    tied = case["block"] in ("pair", "triple") or {"position", "wavelength"} & set(AXES.get(case.get("effect"), "").split())
    return "laboratory" if manner == "by-speed" and tied else manner


def _crossing(effect, strength):
    """A coupling gap is crossed within milliseconds: a real one is strong while it lasts."""
    return 8.0 + strength if effect == "coupling-backlash" else strength


def _one(job):
    name, args, records, answers = job
    args, block = dict(args), args["block"]
    args.pop("block")
    folder = Path(records) / name
    build(out=folder, **args)
    for file in ("truth.json", "truth-force.npy", "truth-force-holdout.npy"):
        if (folder / file).exists():
            shutil.move(folder / file, Path(answers) / f"{name}.{file}")
    return name, block


def make(seed, records, out, answers, short=True, jobs=2, tell=print):
    """Write `records` cases; files under out/<id>, truths under answers/<id>.truth.json. Returns {id: block}."""
    rng = np.random.Generator(np.random.PCG64(seed))
    Path(answers).mkdir(parents=True, exist_ok=True)
    todo = composition(rng, records)
    seeds = rng.integers(1, 2**40, len(todo))  # numbers in drawing order, which says nothing once shuffled
    work = [(f"r{i + 1:04d}", a | {"seed": int(s), "short": short}, str(out), str(answers)) for i, (a, s) in enumerate(zip(todo, seeds))]
    blocks = {}
    with ProcessPoolExecutor(jobs) as pool:
        for name, block in pool.map(_one, work, chunksize=4):
            blocks[name] = block
            tell(f"{len(blocks)}/{len(work)}")
    return blocks
