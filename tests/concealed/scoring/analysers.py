"""The analysers: `guideblock diagnose` and the rivals, started alike on the same files.

The hold-out file is handed over with the noise-free true force in place of the recorded one, where the truth has it. No
analyser may learn from that file, so only the measure changes: errors there are distances from the truth, and

    gain = (error with the gains alone² - error with what was found²) / (error with the gains alone² - oracle²)

is 1 for an oracle, which knows the effect and every constant, and below 0 for what makes the prediction worse. An oracle's
error is what the noise of a recorded acceleration makes of the stated mass: it too reads the recorded motion.
"""
import json
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

RIVAL = Path(__file__).resolve().parents[1] / "rivals" / "rival.py"
DIAGNOSE = "diagnose"
# least error with the gains alone, in errors of the oracle, that leaves something to gain
MOVED_BY = 1.01


def noise_free(case, truth, folder):
    """Path of the hold-out with the true force, or the recorded one where there is none; None without a hold-out; and whether it is true."""
    held = truth.get("holdout")
    if not held:
        return None, False
    name = held["file"] if isinstance(held, dict) else held if isinstance(held, str) else held[0]
    recorded, force = case / name, case / "truth-force-holdout.npy"
    lines = recorded.read_text().splitlines()
    values = np.load(force).ravel() if force.exists() else ()
    if len(values) != len(lines) - 1:
        return recorded, False
    at = lines[0].split(",").index("drag_force_n")
    out = folder / f"{case.name}-holdout.csv"
    with out.open("w") as file:
        file.write(lines[0] + "\n")
        for line, value in zip(lines[1:], values):
            cells = line.split(",")
            cells[at] = f"{value:.7g}"
            file.write(",".join(cells) + "\n")
    return out, True


def run(binary, method, case, truth, folder, patience):
    """Answer (None: a crash, or a file refused), seconds, gain (None: not known), last words."""
    files = [str(case / name) for name in truth["files"]]
    start = [binary, "diagnose"] if method == DIAGNOSE else [sys.executable, str(RIVAL), method]
    command = [*start, *files, "--simulation", str(case / "simulation.toml")]
    command += ["--json", "-"] if method == DIAGNOSE else []
    holdout, is_true = noise_free(case, truth, folder)
    command += ["--holdout", str(holdout)] if holdout else []
    started = time.monotonic()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=patience)
    except subprocess.TimeoutExpired:
        return None, patience, None, f"took over {patience:.0f} s"
    seconds = time.monotonic() - started
    # a rival reports its own time, without that of loading its libraries
    if own := re.search(r"^seconds (\S+)$", done.stderr, re.M):
        seconds = float(own[1])
    words = done.stderr.strip().splitlines()[-1:] or [""]
    try:
        answer = json.loads(done.stdout)
    except ValueError:
        return None, seconds, None, words[0]
    held = answer.get("holdout") or {}
    before, after = held.get("rmse_calibrated_n"), held.get("rmse_after_n")
    oracle = truth.get("acceleration_noise_n", 0.0)
    is_known = is_true and after is not None and before and before > MOVED_BY * oracle
    gain = (before**2 - after**2) / (before**2 - oracle**2) if is_known else None
    return answer, seconds, gain, words[0]
