"""Rivals of the analyser: rival.py METHOD RECORDING... --simulation SIM [--holdout OTHER] [--json OUT].

The diagnosis follows the public contract, so the same runner and scorer apply. The law of the simulation file is
evaluated with the generator's own ball guide; gains on preload, friction and viscosity are free, as they are for
everybody. Exit status: 0 nothing found, 1 something found, 3 unusable.
"""
import argparse
import json
import sys
import time
import tomllib
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parent), str(Path(__file__).resolve().parents[1])]
import terms  # noqa: E402
from methods import METHODS  # noqa: E402


def split(rows, gains, y):
    """Every fourth of 32 blocks of time is set aside."""
    held = (np.arange(len(y)) * 32 // len(y)) % 4 == 3
    take = lambda m: ({n: x[m] for n, x in rows.items()}, gains[m], y[m])  # noqa: E731
    return take(~held), take(held), rows["t"][held]


def errors(train, held, columns):
    """RMS errors on the hold-out: gains alone, and with the columns that were found."""
    out = []
    for make in (None, columns):
        joined = [np.column_stack([g, make(r)]) if make else g for r, g, _ in (train, held)]
        scale = np.sqrt(np.mean(joined[0] ** 2, axis=0)) + 1e-300
        fit = np.linalg.lstsq(joined[0] / scale, train[2], rcond=None)[0]
        out.append(float(np.sqrt(np.mean((held[2] - joined[1] / scale @ fit) ** 2))))
    return out


def diagnose(method, recordings, simulation, holdout):
    """Ids found, and the errors on the hold-out."""
    sim = tomllib.loads(Path(simulation).read_text())
    columns = terms.load(recordings)
    *all_rows, scale = terms.prepare(columns, sim)
    if holdout:
        train, held, at = tuple(all_rows), terms.prepare(terms.load([holdout]), sim, scale)[:3], []
    else:
        train, held, at = split(*all_rows)
    if len(train[2]) < 200:
        raise ValueError("fewer than 200 rows that move")
    found, make = METHODS[method](*train)
    before, after = errors(train, held, make) if len(held[2]) else (None, None)
    runs = np.split(at, np.flatnonzero(np.diff(at) > 5 * np.median(np.diff(at))) + 1) if len(at) > 2 else []
    return found, {"description": "own file" if holdout else "every fourth of 32 blocks", "intervals_s": [[float(r[0]), float(r[-1])] for r in runs],
                   "rmse_calibrated_n": before, "rmse_after_n": after}


def main():
    """One diagnosis."""
    a = argparse.ArgumentParser()
    a.add_argument("method", choices=METHODS)
    a.add_argument("recordings", nargs="+")
    a.add_argument("--simulation", required=True)
    a.add_argument("--holdout")
    a.add_argument("--json")
    a = a.parse_args()
    holdout = None
    if a.method.startswith("pysindy"):
        import pysindy  # noqa: F401
    elif a.method == "lasso-bic":
        import sklearn.linear_model  # noqa: F401
    elif a.method == "gplearn":
        import gplearn.genetic  # noqa: F401
    started = time.monotonic()
    try:
        found, holdout = diagnose(a.method, a.recordings, a.simulation, a.holdout)
        verdict = "match" if not found else ("unexplained" if found == ["unknown"] else "explained")
    except ValueError as why:
        print(why, file=sys.stderr)
        found, verdict = [], "insufficient-data"
    # loading the libraries is not counted
    print(f"seconds {time.monotonic() - started:.3f}", file=sys.stderr)
    entries = [{"id": n, "kind": "unknown" if n == "unknown" else "physics", "confidence": 0.9, "equivalents": []} for n in found]
    text = json.dumps({"schema": "guideblock.diagnosis/1", "verdict": verdict, "mechanisms": entries, "holdout": holdout}, sort_keys=True)
    if a.json:
        Path(a.json).write_text(text + "\n", encoding="utf-8")
    else:
        print(text)
    return 3 if verdict == "insufficient-data" else int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
