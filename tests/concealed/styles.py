#!/usr/bin/env python3
"""The same few effects under other habits of recording: does what the analyser can do hang on how `plant` moves its carriage?

    styles.py GUIDEBLOCK FOLDER [--only PART-OF-A-NAME] [--jobs N]

Makes what is not yet in FOLDER, diagnoses every recording and prints those that were not named right, then a table: one line
a law and a style, right, missed (nothing named), partly (a cause not named, or `unknown` beside it) and wrong (a name that is
none of the causes). Exit status 0 whatever comes out: these are for development, and no claim rests on them.

Nothing here is shared with `plant` or with the engine, but for the law of the ball guide, which `guideblock simulate` gives;
the laws of the axis and of the column are closed forms. Effects are the textbook's one line each, 1 and 3 % of the drag, in
white noise and in AR(1) of 0.9, 1 % of the drag. A drive holds its force at rest; memory starts anew in every segment. What
acts on the friction leaves the force of a mass alone.
Strength is the effect's RMS; an effect that is absorbed by the law's tolerance, or lies within a row of a turn, counts as
missed all the same.
"""

import argparse
import collections
import concurrent.futures
import csv
import json
import pathlib
import subprocess

import numpy as np

NOISE = 0.01
ROUNDED = {"time_s": 6, "position_m": 7, "segment": 0, "velocity_m_s": 6}

# --- motion: columns of a recording without its force, and the true position


def trapezoids(speed, acceleration, seconds, step, start=0.1, end=0.7, rest=0.3):
    """Strokes between two places with sharp ramps and rests."""
    ramp = speed / acceleration
    length = end - start
    cruise = length / speed - ramp
    assert cruise > 0
    time = np.arange(round(seconds / step)) * step
    stroke, t = np.divmod(time, 2 * ramp + cruise + rest)
    t = np.minimum(t, 2 * ramp + cruise)
    way = np.where(
        t < ramp,
        acceleration * t**2 / 2,
        np.where(t < ramp + cruise, speed * (t - ramp / 2), length - acceleration * (2 * ramp + cruise - t) ** 2 / 2),
    )
    return np.where(stroke % 2 == 0, start + way, end - way)


def segments(parts, step, **more):
    """Parts of a profile one after the other; `more`: a value for each part, by column."""
    rows = [len(part) for part in parts]
    columns = {"time_s": np.arange(sum(rows)) * step, "position_m": np.concatenate(parts)}
    columns["segment"] = np.repeat(np.arange(len(parts)), rows)
    for name, values in more.items():
        columns[name] = np.repeat(np.asarray(values, dtype=float), rows)
    return columns


def hard_turns(_):
    """Six speeds, turning within a row, at 100 Hz."""
    step, parts = 0.01, []
    for speed in (0.005, 0.01, 0.02, 0.05, 0.1, 0.2):
        length = 0.4 if speed >= 0.02 else 0.1
        way = np.arange(5000) * step * speed % (2 * length)
        parts.append(0.05 + length - np.abs(way - length))
    return segments(parts, step)


def sinusoids(_):
    """To and fro at four frequencies without a rest, 500 Hz, no segments."""
    step = 0.002
    t = np.arange(10_000) * step
    parts = [0.3 + a * (1 - np.cos(2 * np.pi * f * t)) for f, a in ((0.1, 0.1), (0.2, 0.1), (0.5, 0.08), (1, 0.05))]
    columns = segments(parts, step)
    del columns["segment"]
    return columns


def ramps(_):
    """Nine runs of 25 s at 200 Hz: three speeds at three preloads, each run 2 K warmer; sharp ramps and rests."""
    runs = [(p, v) for p in (2000, 3000, 4000) for v in (0.02, 0.08, 0.25)]
    parts = [trapezoids(v, 1.0, 25, 0.005) for _, v in runs]
    return segments(parts, 0.005, preload_n=[p for p, _ in runs], temperature_block_degc=24 + 2 * np.arange(9))


def machine_log(rng):
    """A quarter of an hour of a machine's own strokes, logged at 50 Hz and to 1 um."""
    step, parts, place = 0.02, [], 0.1
    while sum(map(len, parts)) < 45_000:
        target = np.clip(place + (-1) ** len(parts) * rng.uniform(0.1, 0.5), 0.05, 0.95)
        rows = max(int(abs(target - place) / 10 ** rng.uniform(-2.5, -0.8) / step), 5)
        s = np.arange(rows) / rows
        parts.append(place + (target - place) * (0.7 * s + 0.3 * s * s * (3 - 2 * s)))
        place = target
    columns = segments([np.round(np.concatenate(parts), 6)], step)
    del columns["segment"]
    return columns


def jerk_limited(_):
    """Smooth moves of 2 s, at 1 kHz."""
    s = np.arange(2000) / 2000
    moved = s**3 * (10 - 15 * s + 6 * s * s)
    parts = [0.1 + length * way for length in (0.05, 0.2, 0.5, 0.1, 0.05, 0.2, 0.5, 0.1, 0.05, 0.2) for way in (moved, 1 - moved)]
    columns = segments(parts, 0.001)
    del columns["segment"]
    return columns


def decades(rng):
    """Eight runs of 30 s at 200 Hz over preloads of 1:50, 8 K of warming: moves of 1 to 500 mm/s, one run of small sinusoids."""
    step, rows = 0.005, 6000
    preloads = rng.permutation(np.geomspace(300, 15_000, 12))[:8]
    parts = []
    for run in range(8):
        if run == 3:
            parts.append(0.5 + 1e-3 * np.sin(2 * np.pi * 0.5 * np.arange(rows) * step))
            continue
        moves, place = [], 0.5
        while sum(map(len, moves)) < rows:
            speed, seconds = 10 ** rng.uniform(-3, -0.3), rng.uniform(1, 4)
            way = np.clip(place + rng.choice([-1, 1]) * speed * seconds, 0.05, 0.95) - place
            s = np.arange(1, round(seconds / step) + 1) * step / seconds
            moves.append(place + way * (s - np.sin(2 * np.pi * s) / (2 * np.pi)))
            place += way
        parts.append(np.concatenate(moves)[:rows])
    columns = segments(parts, step, preload_n=preloads)
    columns["velocity_m_s"] = by_parts(columns, lambda of: np.gradient(columns["position_m"][of], step))
    warm = np.arange(8 * rows) / (8 * rows)
    columns["temperature_block_degc"] = 24 + 8 * (1 - np.exp(-2.5 * warm)) / (1 - np.exp(-2.5))
    return columns


def decades_by_position(rng):
    """The same without a column of speed."""
    columns = decades(rng)
    del columns["velocity_m_s"]
    return columns


STYLES = {
    style.__name__: style for style in (hard_turns, sinusoids, ramps, machine_log, jerk_limited, decades, decades_by_position)
}

# standard deviation of a channel's noise
READ = {"decades": {"position_m": 1e-6, "velocity_m_s": 2e-5, "temperature_block_degc": 0.02}}
READ["decades_by_position"] = {"position_m": 1e-6, "temperature_block_degc": 0.02}
GUIDE_ALONE = {"hard_turns", "decades", "decades_by_position"}

# --- laws


def by_parts(columns, of):
    """Applies `of` to the rows of every segment."""
    segment = columns.get("segment", np.zeros(len(columns["time_s"])))
    out = np.zeros(len(segment))
    for part in np.unique(segment):
        rows = segment == part
        out[rows] = of(rows)
    return out


class Moved:
    """A recording's motion, and the force of its law."""

    def __init__(self, columns):
        self.columns = columns
        self.time, self.place = columns["time_s"], columns["position_m"]
        self.speed = by_parts(columns, lambda rows: np.gradient(self.place[rows], self.time[rows]))
        self.acceleration = by_parts(columns, lambda rows: np.gradient(self.speed[rows], self.time[rows]))
        self.sign = np.sign(np.where(np.abs(self.speed) < 1e-6, 0, self.speed))
        self.step = np.median(np.diff(self.time))
        self.force = self.friction = None

    @property
    def inertial(self):
        """Force that accelerates the mass."""
        return self.force - self.friction

    def along(self, of):
        """Recursion `of(before, row)` over the rows, from 0 at the first row of a segment."""
        segment = self.columns.get("segment", np.zeros(len(self.time)))
        out, state = np.zeros(len(self.time)), 0.0
        for n in range(1, len(out)):
            state = of(state, n) if segment[n] == segment[n - 1] else 0.0
            out[n] = state
        return out


def held(force):
    """Force held at rest, where it is undetermined: that of the last stop; before any motion, of the start."""
    known = np.isfinite(force)
    row = np.maximum.accumulate(np.where(known, np.arange(len(force)), -1))
    return force[np.where(row < 0, np.flatnonzero(known)[0], row)]


def moving(moved, friction, mass_kg):
    """The force of friction and mass, and of friction alone."""
    known = [np.where(moved.sign == 0, np.nan, x) for x in (friction + mass_kg * moved.acceleration, friction)]
    return [held(x) for x in known]


def guide(binary, folder, moved):
    oil = "viscosity_40_cst = 100\nviscosity_100_cst = 11" if "temperature_block_degc" in moved.columns else "viscosity_cst = 100"
    file, motion, out = folder / "simulation.toml", folder / "motion.csv", folder / "force.csv"
    file.write_text(
        'schema = "guideblock.simulation/1"\n[guide]\nparameters = "zhou-2023"\n'
        f"[lubricant]\n{oil}\n[operation]\npreload_n = 3000\n"
    )
    write(motion, {**moved.columns, "drag_force_n": np.sin(np.arange(len(moved.time)))})
    subprocess.run([binary, "simulate", motion, "--simulation", file, "--out", out], check=True, capture_output=True)
    with out.open() as lines:
        force = np.array([float(row["simulated_force_n"] or "nan") for row in csv.DictReader(lines)])
    motion.unlink()
    out.unlink()
    return held(force), held(force)


def axis(_, folder, moved):
    (folder / "simulation.toml").write_text('schema = "guideblock.simulation/1"\n[guide]\nlaw = "coulomb-viscous"\n')
    return moving(moved, 30 * moved.sign + 60 * moved.speed, 8)


def column(_, folder, moved):
    (folder / "simulation.toml").write_text('schema = "guideblock.simulation/1"\n[tolerance]\nfriction = 0.02\n')
    v = np.abs(moved.speed)
    friction = moved.sign * (20 + 12 * np.exp(-v / 0.02) + 40 * v)
    moved.columns["simulated_force_n"] = np.where(moved.sign == 0, 0, friction + 5 * moved.acceleration)
    return moving(moved, friction, 5)


LAWS = {law.__name__: law for law in (guide, axis, column)}

# --- effects: the whole force with the effect in it. `rms_n`: RMS that it adds; `share`: the same relative to the drag


def scaled(force, rms_n):
    return force * rms_n / np.sqrt(np.mean(force**2))


def dahl(moved, share):
    length = 2e-4 * max(share / 0.01, 1)

    def follow(z, n):
        way = moved.place[n] - moved.place[n - 1]
        return np.sign(way) - (np.sign(way) - z) * np.exp(-abs(way) / length) if way else z

    return moved.inertial + np.abs(moved.friction) * moved.along(follow)


def lagged(values, decay):
    out = np.array(values)
    for n in range(1, len(out)):
        out[n] = decay * out[n - 1] + (1 - decay) * values[n]
    return out


def rail(moved, rms_n):
    profile = sum(np.cos(2 * np.pi * k * moved.place / 1.3 + k * k) / k for k in range(1, 6))
    return scaled(moved.friction * (profile - profile.mean()), rms_n)


def balls(moved, share):
    return 1.41 * share * np.sin(2 * np.pi * moved.place / 0.0143 + 0.7) * moved.friction


def filtered(moved, time_s):
    return by_parts(moved.columns, lambda rows: lagged(moved.force[rows], np.exp(-moved.step / time_s)))


def delayed(moved, time_s):
    return by_parts(moved.columns, lambda rows: np.interp(moved.time[rows] - time_s, moved.time[rows], moved.force[rows]))


EFFECTS = {
    "clean": ([], lambda m, n, s: m.force),
    "within-tolerance": ([], lambda m, n, s: m.force + 0.02 * m.friction),
    "seal": (["seal-drag"], lambda m, n, s: m.force + n * m.sign),
    "viscous": (["viscous-drag"], lambda m, n, s: m.force + scaled(m.speed, n)),
    "offset": (["force-offset"], lambda m, n, s: m.force + n),
    "asymmetry": (["direction-asymmetry"], lambda m, n, s: m.force + s * m.sign * m.friction),
    "inertia": (["inertia"], lambda m, n, s: m.force + scaled(m.acceleration, n)),
    "balls": (["ball-pass"], lambda m, n, s: m.force + balls(m, s)),
    "screw": (["drive-ripple"], lambda m, n, s: m.force + scaled(np.sin(2 * np.pi * m.place / 0.010 + 1.1), n)),
    "rail": (["rail-straightness"], lambda m, n, s: m.force + rail(m, n)),
    "presliding": (["presliding"], lambda m, n, s: dahl(m, s)),
    "filter": (["force-lowpass"], lambda m, n, s: filtered(m, 2 * s)),
    "delay": (["time-misalignment"], lambda m, n, s: delayed(m, s)),
    "drift": (["force-drift"], lambda m, n, s: m.force + 2 * n * (1 - np.exp(-3 * m.time / m.time[-1]))),
    "chain": (["cable-chain"], lambda m, n, s: m.force + scaled(0.3 * m.sign + 3 * (m.place - m.place.mean()) / np.ptp(m.place), n)),
    "run-in": (["run-in"], lambda m, n, s: m.force + scaled(m.sign * np.exp(-3 * np.linspace(0, 1, len(m.time))), n)),
    "clock": (["unknown"], lambda m, n, s: m.force + scaled(m.sign * (np.sin(2 * np.pi * m.time / 7.3) > 0.6), n)),
    "wavy-in-speed": (["unknown"], lambda m, n, s: m.force + scaled(m.sign * np.sin(4 * np.log(np.abs(m.speed) + 1e-3)), n)),
    "seal+balls": (["seal-drag", "ball-pass"], lambda m, n, s: m.force + balls(m, s) + n * m.sign),
    "rail+viscous": (["rail-straightness", "viscous-drag"], lambda m, n, s: m.force + rail(m, n) + scaled(m.speed, n)),
}
# effects that an axis contains already, since all its numbers are fitted
FITTED = {"seal", "viscous", "offset", "inertia", "seal+balls", "rail+viscous", "within-tolerance"}


def write(file, columns):
    digits = [ROUNDED.get(name, 5) for name in columns]
    with file.open("w") as out:
        out.write(",".join(columns) + "\n")
        out.writelines(",".join(f"{x:.{d}f}" for x, d in zip(row, digits)) + "\n" for row in zip(*columns.values()))


def make(binary, folder, seed, style, law, effect, share):
    if (folder / "truth.json").exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    columns = STYLES[style](rng)
    if law != "guide":
        columns = {name: values for name, values in columns.items() if name not in ("preload_n", "temperature_block_degc")}
    moved = Moved(columns)
    moved.force, moved.friction = LAWS[law](binary, folder, moved)
    rms_n = np.sqrt(np.mean(moved.force**2))
    truth, of = EFFECTS[effect]
    drag = of(moved, share * rms_n, share)
    noise = rng.standard_normal(len(moved.time))
    for channel, sigma in READ.get(style, {}).items():
        moved.columns[channel] = moved.columns[channel] + sigma * rng.standard_normal(len(noise))
    if share > 0.01:
        noise = lagged(noise, 0.9) * np.sqrt((1 + 0.9) / (1 - 0.9))
    write(folder / "recording.csv", {**moved.columns, "drag_force_n": drag + NOISE * rms_n * noise})
    (folder / "truth.json").write_text(json.dumps(truth))


def diagnosed(binary, folder):
    """Outcome of a recording, and the names given."""
    said = subprocess.run(
        [binary, "diagnose", folder / "recording.csv", "--simulation", folder / "simulation.toml", "--json", "-"],
        capture_output=True,
        text=True,
    )
    truth = json.loads((folder / "truth.json").read_text())
    answer = json.loads(said.stdout)
    sets = [{found["id"], *found["equivalents"]} for found in answer["mechanisms"]]
    is_wrong = any("unknown" not in ids and not ids.intersection(truth) for ids in sets)
    hits = sum(any(cause in ids for ids in sets) for cause in truth)
    if is_wrong:
        outcome = "wrong"
    elif hits == len(truth) == len(sets):
        outcome = "right"
    else:
        outcome = "partly" if sets else "missed"
    return outcome, f"{answer['verdict']}: " + ", ".join("|".join([m["id"], *m["equivalents"]]) for m in answer["mechanisms"])


def main():
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("guideblock", type=pathlib.Path)
    asked.add_argument("folder", type=pathlib.Path)
    asked.add_argument("--only", default="", help="part of the names of the recordings, as ramps or delay")
    asked.add_argument("--jobs", type=int, default=2)
    asked = asked.parse_args()
    cases = [
        (style, law, effect, share)
        for style in STYLES
        for law in LAWS
        for effect in EFFECTS
        for share in (0.01, 0.03)
        # no real mass turns within a row, and only a guide has preloads
        if not (law == "axis" and effect in FITTED) and not (law != "guide" and style in GUIDE_ALONE)
    ]

    def one(numbered):
        seed, case = numbered
        name = "_".join(map(str, case))
        if asked.only not in name:
            return None
        folder = asked.folder / name
        make(asked.guideblock, folder, seed, *case)
        return case, name, *diagnosed(asked.guideblock, folder)

    table = collections.defaultdict(collections.Counter)
    with concurrent.futures.ThreadPoolExecutor(asked.jobs) as workers:
        for (style, law, *_), name, outcome, said in filter(None, workers.map(one, enumerate(cases, 1))):
            table[law, style][outcome] += 1
            if outcome != "right":
                print(f"{outcome:7} {name:40} {said}", flush=True)
    outcomes = ("right", "missed", "partly", "wrong")
    print(f"\n{'law':8} {'style':14}" + "".join(f"{outcome:>8}" for outcome in outcomes))
    for (law, style), counts in sorted(table.items()):
        print(f"{law:8} {style:14}" + "".join(f"{counts[outcome]:8}" for outcome in outcomes))


if __name__ == "__main__":
    main()
