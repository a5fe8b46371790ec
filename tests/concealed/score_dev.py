#!/usr/bin/env python3
"""Scores `guideblock diagnose`, and its rivals beside it, on a folder of concealed cases.

    score_dev.py GUIDEBLOCK CASES [--only PREFIX,...] [--every N] [--jobs N] [--out RESULTS.json] [--page PAGE.md]
                 [--rivals all | METHOD,... | none] [--gplearn-every N] [--answers FOLDER] [--patience S]

Prints every failure, grades by kind of case, the confusion matrix (concealed set against named set), what became of effects by
strength and by detectability, and with `--rivals` one table of all analysers. `--page` writes the same as Markdown. A case
is right when the named set is the true set; the rules are in `scoring/judge.py`, the ruler of the gain in `scoring/analysers.py`.
With `--answers` every answer is kept as it comes, and taken from there by the next run of the same program on the same cases.
Rivals run under the Python that runs this (`rivals/requirements.txt`).
"""

import argparse
import concurrent.futures
import datetime
import json
import os
import pathlib
import platform
import tempfile

from scoring import analysers, page, tables
from scoring.judge import judge, said

RIVALS = ("threshold", "lasso-bic", "pysindy-generic", "pysindy-generic-cv", "pysindy-domain", "pysindy-domain-cv", "gplearn")
# what a rival is granted at most, s
RIVAL_PATIENCE_S = 300.0


def asked(binary, method, case, truth, temporary, patience, answers):
    """What `analysers.run` gives, kept in the folder of answers where there is one."""
    kept = answers / method / f"{case.name}.json" if answers else None
    if kept and kept.exists():
        return json.loads(kept.read_text())
    got = analysers.run(binary, method, case, truth, temporary, patience)
    if kept:
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(got))
    return got


def score(binary, method, folders, jobs, temporary, tell, patience, answers):
    """Judged cases by name."""
    def one(case):
        truth = json.loads((case / "truth.json").read_text())
        answer, seconds, gain, words = asked(binary, method, case, truth, temporary, patience, answers)
        return {"truth": truth, "answer": answer, "seconds": round(seconds, 2), "gain": gain,
                "grade": judge(truth, answer), "words": said(answer) if answer else f"no answer: {words}"}
    judged = {}
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for case, c in zip(folders, pool.map(one, folders)):
            judged[case.name] = c
            tell(case.name, c)
    return judged


def library(method):
    """Ids that a rival could name; None for all."""
    from rivals.terms import DOMAIN, GENERIC
    if method == "threshold":
        return set()
    return set(GENERIC.values()) if "generic" in method else set(DOMAIN)


def main():
    """One run."""
    a = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    a.add_argument("binary")
    a.add_argument("cases", type=pathlib.Path)
    a.add_argument("--only", default="", help="names of cases start with one of these")
    a.add_argument("--every", type=int, default=1, help="only every Nth case, from the first")
    a.add_argument("--jobs", type=int, default=1)
    a.add_argument("--out", type=pathlib.Path, help="all answers and grades as JSON")
    a.add_argument("--page", type=pathlib.Path, help="the tables as Markdown")
    a.add_argument("--rivals", default="none", help=f"all, none, or of {', '.join(RIVALS)}")
    a.add_argument("--gplearn-every", type=int, default=1, help="gplearn is slow: only every Nth of the cases")
    a.add_argument("--answers", type=pathlib.Path, help="folder that keeps every answer; another program needs another folder")
    a.add_argument("--patience", type=float, default=60.0, help="seconds that diagnose is granted for a case (default 60)")
    a = a.parse_args()
    all_cases = sorted(c for c in a.cases.iterdir() if (c / "truth.json").exists())
    folders = [c for c in all_cases if c.name.startswith(tuple(a.only.split(",")))][::a.every]
    rivals = [] if a.rivals == "none" else list(RIVALS) if a.rivals == "all" else a.rivals.split(",")

    def failure(name, c):
        if c["grade"] != "right":
            effects = ", ".join(f"{e['id']} {e.get('strength_alone_pct') or 0:.2g}% z{e.get('ideal_z') or 0:.0f}" for e in c["truth"]["effects"])
            print(f"{c['grade']:8} {name}  [{effects}; {c['truth']['noise'].get('law')}]  ->  {c['words']}", flush=True)

    with tempfile.TemporaryDirectory() as temporary:
        temporary = pathlib.Path(temporary)
        judged = {analysers.DIAGNOSE: score(a.binary, analysers.DIAGNOSE, folders, a.jobs, temporary, failure, a.patience, a.answers)}
        for method in rivals:
            of = folders[::a.gplearn_every] if method == "gplearn" else folders
            judged[method] = score(a.binary, method, of, a.jobs, temporary, lambda *_: None, RIVAL_PATIENCE_S, a.answers)
            print(f"{method}: {len(of)} cases", flush=True)
    cases = judged[analysers.DIAGNOSE]
    seconds = sorted(c["seconds"] for c in cases.values())
    parts = [
        ("By kind of case", tables.by_kind(cases)),
        ("One effect, by its size", tables.by_strength(cases)),
        ("How much an effect has to stand out", tables.by_detectability(cases)),
        ("Confusion matrix", tables.confusion(cases)),
    ]
    if rivals:
        rows = [[name, *tables.summary(of, None if name == analysers.DIAGNOSE else library(name))] for name, of in judged.items()]
        parts.append(("Rivals on the same recordings", (tables.SUMMARY, rows)))
        if "gplearn" in judged and a.gplearn_every > 1:
            same = {n: c for n, c in cases.items() if n in judged["gplearn"]}
            rows.append([f"{analysers.DIAGNOSE}, on gplearn's", *tables.summary(same)])
    for title, (head, rows) in parts:
        print(f"\n{title}\n{page.text(head, rows)}")
    time_line = f"Seconds a case: median {seconds[len(seconds) // 2]:.2f}, worst {seconds[-1]:.2f}." if seconds else ""
    print(f"\n{time_line}")
    if a.out:
        keep = lambda c: {k: c[k] for k in ("grade", "words", "seconds", "gain", "answer")}  # noqa: E731
        results = {method: {n: keep(c) for n, c in of.items()} for method, of in judged.items()}
        a.out.write_text(json.dumps(results if rivals else results[analysers.DIAGNOSE], indent=1))
    if a.page:
        seeds = sorted({c["truth"]["seed"] for c in cases.values()})
        introduction = (pathlib.Path(__file__).parent / "scoring" / "introduction.md").read_text()
        how = (f"{len(cases)} cases, seeds {seeds[0]} to {seeds[-1]}; {datetime.date.today()}, {os.cpu_count()} cores {platform.machine()}, "
               f"{a.jobs} at a time. {time_line}") if cases else ""
        body = [introduction.strip(), how, *(f"## {title}\n\n{page.markdown(*table)}" for title, table in parts),
                f"## Every failure\n\n{page.markdown(*tables.failures(cases))}"]
        a.page.write_text("\n\n".join(body) + "\n")


if __name__ == "__main__":
    main()
