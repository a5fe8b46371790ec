#!/usr/bin/env python3
"""Scores `guideblock diagnose` on a folder of concealed cases.

    score_dev.py GUIDEBLOCK CASES [--only PREFIX] [--jobs N] [--out RESULTS.json]

A case is right when the named set is the true set: every effect named (its id leads, or stands among the equivalents
where the case is undecidable), nothing else named. Effects that no analyser could see (ideal_z below 4) may be silent.
"""

import argparse
import collections
import concurrent.futures
import json
import pathlib
import subprocess
import time


def diagnose(binary, case):
    truth = json.loads((case / "truth.json").read_text())
    files = [str(case / name) for name in truth["files"]]
    command = [binary, "diagnose", *files, "--simulation", str(case / "simulation.toml"), "--json", "-"]
    if truth.get("holdout"):
        held = truth["holdout"]
        held = held if isinstance(held, str) else held.get("file", "holdout.csv") if isinstance(held, dict) else held[0]
        command += ["--holdout", str(case / held)]
    started = time.monotonic()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    except subprocess.TimeoutExpired:
        return truth, None, None, "took over 60 s", 60.0
    seconds = time.monotonic() - started
    try:
        answer = json.loads(done.stdout)
    except ValueError:
        answer = None
    return truth, answer, done.returncode, done.stderr.strip(), seconds


def judge(truth, answer):
    """(grade, words): right, silent, wrong, partial."""
    if truth.get("damage"):
        return ("right" if answer is None or answer["verdict"] in ("insufficient-data", "match") else "wrong"), ""
    if answer is None:
        return "crash", ""
    named = answer["mechanisms"]
    # effects are hard to see below this score
    effects = truth["effects"]
    visible = [e for e in effects if (e.get("ideal_z") or 99) >= 6 and e.get("reached", True)]
    words = " + ".join(m["id"] + ("{" + ",".join(m["equivalents"]) + "}" if m["equivalents"] else "") for m in named)
    words = f"{answer['verdict']}: {words}"
    if not effects:
        return ("right" if not named else "alarm"), words
    unknown_case = truth["kind"] == "unknown"
    left = list(named)
    missed = []
    for effect in effects:
        ids = {effect["id"], *effect.get("equivalents", []), *effect.get("also_allowed", [])}
        if unknown_case or effect["id"] == "unknown":
            ids = {"unknown"}
        hit = next((m for m in left if m["id"] in ids or set(m["equivalents"]) & {effect["id"]}), None)
        if hit:
            left.remove(hit)
        elif effect in visible:
            missed.append(effect["id"])
    # unlike the true name, `unknown` beside it is no false name
    false = [m["id"] for m in left if m["id"] != "unknown"]
    if not missed and not left:
        return "right", words
    if false:
        return ("extra" if not missed else "wrong"), words
    if not named:
        return "silent", words
    return "partial" if missed else "extra-unknown", words


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("binary")
    arguments.add_argument("cases", type=pathlib.Path)
    arguments.add_argument("--only", default="")
    arguments.add_argument("--jobs", type=int, default=1)
    arguments.add_argument("--out", type=pathlib.Path)
    a = arguments.parse_args()
    cases = sorted(c for c in a.cases.iterdir() if (c / "truth.json").exists() and c.name.startswith(tuple(a.only.split(","))))
    grades = collections.defaultdict(collections.Counter)
    seconds, results = [], {}
    with concurrent.futures.ThreadPoolExecutor(a.jobs) as pool:
        for case, (truth, answer, status, stderr, took) in zip(cases, pool.map(lambda c: diagnose(a.binary, c), cases)):
            grade, words = judge(truth, answer)
            kind = truth["kind"]
            grades[kind][grade] += 1
            grades["ALL"][grade] += 1
            seconds.append(took)
            results[case.name] = {"grade": grade, "words": words, "seconds": round(took, 2), "answer": answer}
            if grade != "right":
                effects = ", ".join(
                    f"{e['id']} {e.get('strength_alone_pct') or 0:.2g}% z{e.get('ideal_z') or 0:.0f} abs{e.get('absorbed_share_by_gains') or 0:.2f}"
                    + (f" eq{e['equivalents']}" if e.get("equivalents") else "")
                    for e in truth["effects"]
                )
                tail = stderr.splitlines()[-1] if answer is None and stderr else ""
                print(f"{grade:8} {case.name}  [{effects}; {truth['noise'].get('law')}]  ->  {words} {tail}")
    for kind, counts in grades.items():
        total = sum(counts.values())
        print(f"{kind:14} {total:4}  " + "  ".join(f"{g} {n} ({100 * n / total:.0f} %)" for g, n in counts.most_common()))
    seconds.sort()
    if seconds:
        print(f"seconds: median {seconds[len(seconds) // 2]:.2f}, worst {seconds[-1]:.2f}")
    if a.out:
        a.out.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
