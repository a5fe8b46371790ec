"""Stands in for a diagnosis in the tests of the trial: names seal-drag where the force is large, else nothing."""
import json
import sys

words = sys.argv[1:]
out = words[words.index("--json") + 1]
rows = open(words[0], encoding="utf-8").read().splitlines()
column = rows[0].split(",").index("drag_force_n")
values = []
for row in rows[1:]:
    try:
        values.append(abs(float(row.split(",")[column])))
    except (ValueError, IndexError):
        pass
is_large = sum(values) / max(len(values), 1) > 30
names = [{"id": "seal-drag", "kind": "physics", "confidence": 0.5, "equivalents": []}] if is_large else []
if len(values) == 150:
    raise MemoryError
json.dump({"schema": "guideblock.diagnosis/1", "verdict": "explained" if names else "match", "mechanisms": names}, open(out, "w"))
sys.exit(1 if names else 0)
