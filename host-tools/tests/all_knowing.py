"""Stands in for a diagnosis in the tests of the scores: all_knowing.py perfect|padded|misplaced ANSWERS RECORDING... .

Reads a copy of the answers that the test laid open for it, and says the truth; `padded` adds a name that the answer does
not allow, `misplaced` states a wrong axis, intervals beside the truth and no progress on the hold-out.
"""
import json
import sys
from pathlib import Path

import numpy as np

mode, answers, *words = sys.argv[1:]
name = Path.cwd().name
truth = json.loads((Path(answers) / f"{name}.truth.json").read_text())
own = "--holdout" in words
force = np.load(Path(answers) / f"{name}.truth-force{'-holdout' if own else ''}.npy").ravel()
try:
    files = ["holdout.csv"] if own else truth["files"]
    rows = np.concatenate([np.genfromtxt(f, delimiter=",", names=True)["drag_force_n"] for f in files])
    noise = float(np.sqrt(np.mean((rows - force) ** 2)))
except ValueError:  # a spoiled file
    noise = None
SAME = {"inertia": ("mass_kg", "mass_kg"), "force-offset": ("offset_n", "force_n"), "gravity-tilt": ("weight_component_n", "force_n"), "drive-ripple": ("lead_m", "wavelength_m"),
        "force-quantisation": ("step_n", "step_n"), "structural-resonance": ("frequency_hz", "frequency_hz")}
entries, places = [], []
for e in truth["effects"]:
    p = {x["name"]: x["value"] for x in e["parameters"]}
    numbers = []
    if e["id"] in SAME:
        value = p[SAME[e["id"]][0]] * (p.get("sign", 1.0) if "force_n" in SAME[e["id"]] else 1.0)
        low, high = sorted((0.99 * value, 1.01 * value)) if mode != "misplaced" else sorted((1.5 * value, 1.6 * value))
        numbers.append({"name": SAME[e["id"]][1], "value": (low + high) / 2, "ci95": [low, high], "unit": ""})
    entries.append({"id": e["id"], "kind": "unknown" if e["id"] == "unknown" else "physics", "confidence": 1.0, "parameters": numbers,
                    "equivalents": (e["equivalents"] if truth["kind"] == "undecidable" else []) + (["breakaway-dwell" if e["id"] != "breakaway-dwell" else "run-in"] if mode == "padded" and e["id"] != "unknown" else [])})
    where = e["where"]
    axis = next((a for a in where["axes"] if a in where["stretches"]), where["axes"][0])
    cells = where["stretches"].get(axis, {"from": [0.0], "to": [0.0]})
    places.append({"axis": axis, "from": cells["from"][0], "to": cells["to"][-1], "share": 1.0, "unit": ""} if mode != "misplaced" else {"axis": "ambient", "from": 0.0, "to": 1.0})
said = {"schema": "guideblock.diagnosis/1", "verdict": truth["expected_verdict"], "mechanisms": entries, "where": places,
        "next_experiment": {"code": truth["next_experiment"] or "repeat-later", "text": ""}}
if noise:
    said["holdout"] = {"intervals_s": [] if own else [[0.0, 1e9]], "rmse_calibrated_n": 2 * noise, "rmse_after_n": 2 * noise if mode == "misplaced" else noise}
Path(words[words.index("--json") + 1]).write_text(json.dumps(said))
sys.exit(0 if truth["expected_verdict"] == "match" else 1)
