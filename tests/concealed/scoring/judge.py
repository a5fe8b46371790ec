"""One answer against one truth.

A case is right when the named set is the true set: every effect named (its id leads, or stands among the equivalents),
nothing else named. Effects that no analyser could see may be silent.
"""

# scores below it can hardly be seen, even by an analyser that knew shape and noise
VISIBLE_Z = 6.0


def is_visible(effect):
    """Whether the effect is visible, so that not naming it is a mistake."""
    return (effect.get("ideal_z") or 99) >= VISIBLE_Z and effect.get("reached", True)


def ids_of(effect, is_unknown):
    """Names that are right answers for the effect."""
    if is_unknown or effect["id"] == "unknown":
        return {"unknown"}
    return {effect["id"], *effect.get("equivalents", []), *effect.get("also_allowed", [])}


def said(answer):
    """The answer in one line."""
    names = [m["id"] + ("{" + ",".join(m["equivalents"]) + "}" if m["equivalents"] else "") for m in answer["mechanisms"]]
    return f"{answer['verdict']}: " + (" + ".join(names) or "nothing")


def match(truth, answer):
    """Match of effects and entries: (effects with the entry that names them or None, entries left over)."""
    left, pairs = list(answer["mechanisms"]), []
    for effect in truth["effects"]:
        ids = ids_of(effect, truth["kind"] == "unknown")
        hit = next((m for m in left if m["id"] in ids or effect["id"] in m["equivalents"]), None)
        if hit:
            left.remove(hit)
        pairs.append((effect, hit))
    return pairs, left


def judge(truth, answer):
    """Grade: right; silent, partial (one of two), extra-unknown (`unknown` beside the right name); extra (a false name beside
    it), wrong, alarm (something where nothing is); crash."""
    if truth.get("damage"):
        return "right" if answer is None or answer["verdict"] in ("insufficient-data", "match") else "wrong"
    if answer is None:
        return "crash"
    if not truth["effects"]:
        return "alarm" if answer["mechanisms"] else "right"
    pairs, left = match(truth, answer)
    is_missed = any(hit is None and is_visible(effect) for effect, hit in pairs)
    if not is_missed and not left:
        return "right"
    # unlike another name, `unknown` beside the true one is no false name
    if any(m["id"] != "unknown" for m in left):
        return "wrong" if is_missed else "extra"
    if not answer["mechanisms"]:
        return "silent"
    return "partial" if is_missed else "extra-unknown"


FALSE = ("extra", "wrong", "alarm")
