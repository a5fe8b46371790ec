"""Command line: `python -m plant make|set|trial|check|list`."""
import argparse
import json
import sys
from pathlib import Path
from . import cases, manners, noise
from .composition import development_set, grid_set, mixed_set


def main(argv=None):
    """Run one command; returns the exit status."""
    p = argparse.ArgumentParser(prog="plant", description="recordings with concealed effects")
    sub = p.add_subparsers(dest="command", required=True)
    m = sub.add_parser("make", help="one case")
    m.add_argument("--seed", type=int, required=True)
    m.add_argument("--kind", choices=cases.KINDS, required=True)
    m.add_argument("--effect", help="contract id; shift: the parameter; unknown: the title; pair: ID+ID")
    m.add_argument("--strength", type=float, default=3.0, help="%% of the drag's RMS (default 3)")
    m.add_argument("--noise", choices=noise.LAWS, default="white")
    m.add_argument("--noise-level", type=float, default=1.0, help="%% of each run's RMS (default 1)")
    m.add_argument("--variant", type=int, help="number of the undecidable design or of the damage")
    m.add_argument("--manner", choices=manners.NAMES, default="laboratory", help="how the machine is moved and logged")
    m.add_argument("--short", action="store_true", help="6 runs of 20 s instead of 12 of 30 s")
    m.add_argument("--plain", action="store_true", help="one file, no hold-out, no force column form")
    m.add_argument("--out", type=Path, required=True)
    s = sub.add_parser("set", help="a mixed set")
    s.add_argument("--seed", type=int, required=True)
    s.add_argument("--count", type=int, default=120)
    s.add_argument("--composition", choices=("mixed", "development", "grid"), default="mixed",
                   help="development: every id at 3 and 1 %%, fixed list; grid: every id at 3 sizes, 2 noises, and 300 with nothing missing")
    s.add_argument("--short", action="store_true")
    s.add_argument("--out", type=Path, required=True)
    t = sub.add_parser("trial", help="the set of a concealed trial: records and answers apart")
    t.add_argument("--seed", type=int, required=True)
    t.add_argument("--records", type=int, default=960)
    t.add_argument("--full", action="store_true", help="12 runs of 30 s instead of 6 of 20 s")
    t.add_argument("--jobs", type=int, default=2)
    t.add_argument("--out", type=Path, required=True)
    t.add_argument("--answers", type=Path, required=True)
    sub.add_parser("check", help="self-check of the generator")
    sub.add_parser("list", help="ids, titles, designs, damages")
    a = p.parse_args(argv)
    if a.command == "make":
        t = cases.build(a.seed, a.kind, a.out, a.effect, a.strength, a.noise, a.short, a.noise_level, a.variant, not a.plain, a.manner)
        print(a.out, ",".join(f"{e['id']}:{e['strength_alone_pct']:.3f}%" for e in t["effects"]) or "nothing", t["expected_verdict"])
        return 0
    if a.command == "set":
        fixed = {"development": development_set, "grid": grid_set}.get(a.composition)
        todo = fixed(a.seed, a.short) if fixed else mixed_set(a.seed, a.count, a.short)
        for folder, args in todo:
            t = cases.build(out=a.out / folder, **args)
            print(folder, ",".join(f"{e['id']}:{e['strength_alone_pct']:.3f}%" for e in t["effects"]) or "nothing", t["expected_verdict"], flush=True)
        return 0
    if a.command == "trial":
        from .trial import make
        blocks = make(a.seed, a.records, a.out, a.answers, not a.full, a.jobs, lambda line: print(line, file=sys.stderr, flush=True))
        print(json.dumps(blocks, sort_keys=True))
        return 0
    if a.command == "check":
        from .check import run
        return run()
    for title, names in (("physics", cases.PHYSICS), ("sensor", cases.SENSORS), ("unknown", cases.UNKNOWN), ("damage", cases.DAMAGES), ("axis", cases.AXIS_IDS)):
        print(title + ":", " ".join(names))
    print("manner:", " ".join(manners.NAMES))
    for i, u in enumerate(cases.UNDECIDABLE):
        print("undecidable", i, u[0], u[1], u[2], u[3])
    return 0


if __name__ == "__main__":
    sys.exit(main())
