"""Effects that an undecidable recording leaves open, by fit: all others that an ideal analyser could not refute.

An effect stands (is left open) if one of a few further drawings of it, at its best size and with a possible sign, with
the constants of the law inside their tolerance, leaves less of the hidden difference than anyone could see (a score
below VISIBLE), or less than one drawing of the hidden effect leaves of another: a fiftieth of the evidence, or what the
drawings here leave. One of the drawings is the plain one where a kind has it (a seal without cage and slope).
"""
import numpy as np
from .effect import Effect
from .pipeline import difference, tangents, true_force, whitened

VISIBLE = 4.0
DRAWINGS = 4    # a single one may have a shape that is refuted although its kind as a whole is not
ALIKE = 0.02 ** 0.5  # share of the score; a seal's ripple and a contact's hysteresis leave up to 0.12 of it, no two others 0.13 to 0.16
ELSEWHERE = ("external-load", "viscosity-temperature", "parameter-shift")  # a known weight, a sensor's law, the law itself


def standing(seed, c, w, design, classes, hidden, d, sigma, law, tolerance):
    """Ids that explain the difference `d` at the recorded samples as well as the effect `hidden` that made it."""
    names, cols = tangents(c, w)
    without = c.rec(true_force(c, w, []))
    prior = 1 / np.array([max(tolerance.get(n, 0.03), 1e-6) for n in names] + [1e3] * (len(cols) - len(names))) ** 2
    white = whitened(c, sigma, law)
    x, y = np.stack([white(q) for q in cols], 1), white(d)

    size = np.sqrt(np.mean(d ** 2))

    def left(column=None, free=None):
        """Score that remains with one more column of positive amplitude, or with a constant of the law set free."""
        a, p = x, prior.copy()
        if free is not None:
            p[free] = 0.0
        if column is not None:
            a, p = np.column_stack([x, white(column)]), np.append(p, 0.0)
        g = np.linalg.lstsq(a.T @ a + np.diag(p), a.T @ y, rcond=None)[0]
        if column is not None and g[-1] <= 0:
            return np.inf
        return float(np.sqrt(np.sum((y - a @ g) ** 2) + np.sum(p * g * g)))
    own = next((cls for cls in classes if cls.id == hidden.id), None)
    drawn = [left(column) for column in _drawn(seed, c, w, design, own, without, size)] if own else []
    most = max([VISIBLE, ALIKE * left(), *(x for x in drawn if np.isfinite(x))])
    found = {"parameter-shift"} if any(left(free=i) < most for i in range(len(names))) else set()
    for cls in classes:
        if cls.id in ELSEWHERE or cls.after_noise is not Effect.after_noise or cls.channels is not Effect.channels:
            continue
        if any(left(column) < most for column in _drawn(seed, c, w, design, cls, without, size)):
            found.add(cls.id)
    return found


def _drawn(seed, c, w, design, cls, without, size):
    """Differences made by drawings of an effect at about one size, with every sign that it can have."""
    for drawing in range(DRAWINGS + bool(cls.plain)):
        e = cls(np.random.Generator(np.random.PCG64([seed, 7, drawing])), w, design)
        if drawing == DRAWINGS:
            e.p |= cls.plain
        for sign in (1.0, -1.0) if "sign" in e.p else (1.0,):
            if "sign" in e.p:
                e.p["sign"] = sign
            k = min(e.first, e.limit)
            one = np.sqrt(np.mean(difference(c, w, e, k, without) ** 2))
            if one > 0:
                yield difference(c, w, e, min(k * size / one, e.limit), without)
