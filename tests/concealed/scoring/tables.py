"""Tables of judged cases. A judged case is a dict with truth, answer, grade, words, seconds, gain."""
import collections

import numpy as np

from .judge import FALSE, ids_of, is_visible, match

GRADES = ("right", "extra-unknown", "partial", "silent", "extra", "wrong", "alarm", "crash")
KINDS = ("clean", "shift", "single", "sensor", "pair", "undecidable", "unknown", "axis", "damaged")


def true_set(truth):
    """The concealed set in a word."""
    if truth.get("damage"):
        return "a damaged file"
    if truth["kind"] == "unknown":
        return "no name fits"
    return " + ".join(sorted(e["id"] for e in truth["effects"])) or "nothing"


def by_kind(cases):
    """Counts of grades for every kind of case."""
    head = ["kind", "cases", *GRADES]
    rows = []
    for kind in (*KINDS, "all"):
        of = [c["grade"] for c in cases.values() if kind in (c["truth"]["kind"], "all")]
        if of:
            rows.append([kind, len(of), *(of.count(g) or "" for g in GRADES)])
    return head, rows


def confusion(cases):
    """True set against named: a row for every set, sparse."""
    head = ["concealed", "cases", "right", "nothing named", "`unknown` alone", "named otherwise"]
    rows = collections.defaultdict(list)
    for c in cases.values():
        rows[true_set(c["truth"])].append(c)
    out = []
    order = lambda name: (name != "nothing", " + " in name, name)  # noqa: E731
    for name in sorted(rows, key=order):
        right = sum(c["grade"] == "right" for c in rows[name])
        other = collections.Counter()
        for c in rows[name]:
            if c["grade"] != "right":
                named = () if c["answer"] is None else tuple(m["id"] for m in c["answer"]["mechanisms"])
                other["crash" if c["answer"] is None else " + ".join(named)] += 1
        nothing, unknown = other.pop("", 0), other.pop("unknown", 0)
        text = "; ".join(f"{said}" + (f" ({n})" if n > 1 else "") for said, n in other.most_common())
        out.append([name, len(rows[name]), right, nothing or "", unknown or "", text])
    return head, out


def by_strength(cases):
    """One effect: what became of it by its size and the noise."""
    head = ["one effect of", "noise", "cases", "named alone", "in a set of at most 3", "silent or `unknown` only", "a false name", "median gain"]
    groups = collections.defaultdict(list)
    for c in cases.values():
        if c["truth"]["kind"] in ("single", "sensor") and c["truth"]["effects"]:
            strength = c["truth"]["effects"][0].get("strength_alone_pct") or 0.0
            size = next((f"{s:g} %" for s in (0.1, 0.3, 1, 3) if abs(strength / s - 1) < 0.25), "another size")
            law = c["truth"]["noise"].get("law", "?")
            groups[size, "white" if law == "white" else "coloured"].append(c)
    rows = []
    for (size, law), of in sorted(groups.items(), key=lambda g: (g[0][0] == "another size", g[0])):
        alone = in_set = 0
        for c in of:
            if c["grade"] == "right":
                entry = match(c["truth"], c["answer"])[0][0][1]
                alone += bool(entry) and not entry["equivalents"]
                in_set += bool(entry) and 1 <= len(entry["equivalents"]) <= 2
        false = sum(c["grade"] in FALSE for c in of)
        quiet = sum(c["grade"] == "silent" or (c["answer"] or {}).get("mechanisms") == [] or [m["id"] for m in (c["answer"] or {}).get("mechanisms", [])] == ["unknown"] for c in of)
        gains = [c["gain"] for c in of if c["gain"] is not None and c["truth"]["kind"] == "single"]
        rows.append([size, law, len(of), alone, in_set, quiet, false, f"{np.median(gains):.3f} ({len(gains)})" if gains else ""])
    return head, rows


def by_detectability(cases):
    """How strong an effect has to stand out before it is found: the detection limit."""
    head = ["z of an analyser that knows shape and noise", "effects", "named", "share"]
    edges = (0, 4, 6, 10, 20, 50, 100, 1000, np.inf)
    found = collections.defaultdict(list)
    for c in cases.values():
        if c["truth"]["kind"] in ("unknown",) or c["truth"].get("damage") or c["answer"] is None:
            continue
        for effect, hit in match(c["truth"], c["answer"])[0]:
            if effect.get("ideal_z"):
                found[int(np.searchsorted(edges, effect["ideal_z"], "right")) - 1].append(hit is not None)
    text = lambda k: f"{edges[k]:g} to {edges[k + 1]:g}" if np.isfinite(edges[k + 1]) else f"above {edges[k]:g}"  # noqa: E731
    return head, [[text(k), len(found[k]), sum(found[k]), f"{100 * np.mean(found[k]):.0f} %"] for k in sorted(found)]


def failures(cases):
    """Every case that is not right."""
    head = ["case", "concealed: strength, z, share that gains absorb", "noise", "said", "grade", "s"]
    rows = []
    for name, c in cases.items():
        if c["grade"] == "right":
            continue
        effects = "; ".join(
            f"{e['id']} {e.get('strength_alone_pct') or 0:.2g} %, z {e.get('ideal_z') or 0:.0f}, {e.get('absorbed_share_by_gains') or 0:.2f}"
            + (f" (or {', '.join(e['equivalents'])})" if e.get("equivalents") else "")
            for e in c["truth"]["effects"]
        )
        rows.append([name, effects or "nothing", c["truth"]["noise"].get("law", ""), c["words"], c["grade"], f"{c['seconds']:.1f}"])
    return head, rows


def summary(cases, library=None):
    """One analyser in a row; `library`: the ids that it could name at all."""
    # clean, or merely shifted: there a name for the shift is no alarm
    is_nothing = lambda t: not t.get("damage") and all(e["id"] == "parameter-shift" for e in t["effects"])  # noqa: E731
    nothing = [c for c in cases.values() if is_nothing(c["truth"]) and c["answer"] is not None]
    alarms = sum(any(m["id"] != "parameter-shift" or not c["truth"]["effects"] for m in c["answer"]["mechanisms"]) for c in nothing)
    effects = [c for c in cases.values() if c["truth"]["kind"] in ("single", "sensor", "pair", "axis") and not is_nothing(c["truth"])]
    visible = [c for c in effects if all(is_visible(e) for e in c["truth"]["effects"])]
    named = own = of_own = false = 0
    for c in visible:
        if c["answer"] is None:
            continue
        pairs, left = match(c["truth"], c["answer"])
        is_named = all(hit for _, hit in pairs)
        named += is_named
        false += any(m["id"] != "unknown" for m in left)
        if library is None or all(ids_of(e, False) & library for e, _ in pairs):
            own, of_own = own + 1, of_own + is_named
    exact = sum(c["grade"] == "right" for c in visible)
    gains = [c["gain"] for c in visible if c["gain"] is not None and c["truth"]["kind"] in ("single", "pair")]
    seconds = sorted(c["seconds"] for c in cases.values())
    part = lambda n, of: f"{n} of {of}"  # noqa: E731
    return [
        len(cases), part(alarms, len(nothing)), part(exact, len(visible)), part(named, len(visible)), part(of_own, own), part(false, len(visible)),
        f"{np.median(gains):.3f} ({len(gains)})" if gains else "-", f"{min(gains):.2f}" if gains else "-", f"{np.median(seconds):.2f}" if seconds else "-",
        sum(c["answer"] is None and not c["truth"].get("damage") for c in cases.values()),
    ]


SUMMARY = ["analyser", "cases", "alarms where nothing is missing", "exactly the true set", "true names among those named", "the same, of effects in its library",
           "with a false name", "median gain (files)", "worst gain", "median s", "no answer"]
