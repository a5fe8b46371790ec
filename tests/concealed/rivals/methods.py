"""Rivals: each gets rows, gain directions and force, and returns the ids found and its columns as a function of rows.

The gains of the law are never penalised: force and terms are first projected off them. Terms are scaled to unit RMS, so
that a threshold is a force in newtons.
"""
import numpy as np

import terms

MOST_ROWS = 20000


def _less_gains(gains, z):
    return z - gains @ np.linalg.lstsq(gains, z, rcond=None)[0]


def _thin(x, gains, y, most=MOST_ROWS):
    step = max(1, len(y) // most)
    g = gains[::step]
    x, y = _less_gains(g, x[::step]), _less_gains(g, y[::step])
    return x / (np.sqrt(np.mean(x**2, axis=0)) + 1e-12), y


def _chosen(weights, names, library, translate):
    """Ids of the terms with a weight, strongest first, and their columns."""
    order = [i for i in np.argsort(-np.abs(weights)) if weights[i] != 0]
    ids = list(dict.fromkeys(translate(names[i]) for i in order))
    return ids, (lambda rows: library(rows)[:, order]) if order else None


def threshold(rows, gains, y):
    """Something is reported where the calibrated residual exceeds 2 % of the drag's RMS."""
    rest = _less_gains(gains, y)
    return (["unknown"] if np.sqrt(np.mean(rest**2)) > 0.02 * np.sqrt(np.mean(y**2)) else []), None


def lasso_bic(rows, gains, y):
    """LASSO path by least angles over the domain library, order by BIC."""
    from sklearn.linear_model import LassoLarsIC
    x, y = _thin(terms.domain(rows), gains, y)
    return _chosen(LassoLarsIC("bic", fit_intercept=False).fit(x, y).coef_, list(terms.DOMAIN), terms.domain, str)


def _sindy(x, y, cut):
    """Sequential thresholded least squares as pysindy does it; the columns are the library."""
    import warnings

    import pysindy
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns where a threshold leaves nothing
        optimizer = pysindy.STLSQ() if cut is None else pysindy.STLSQ(threshold=cut)
        return optimizer.fit(x, y[:, None]).coef_[0]


def _cross_validated(x, y):
    """The threshold with the least error in cross-validation over five blocks of time."""
    blocks, best = np.array_split(np.arange(len(y)), 5), (np.inf, None)
    for cut in np.geomspace(3e-3, 3.0, 10) * np.sqrt(np.mean(y**2)):
        error = 0.0
        for held in blocks:
            kept = np.setdiff1d(np.arange(len(y)), held, assume_unique=True)
            error += np.sum((y[held] - x[held] @ _sindy(x[kept], y[kept], cut)) ** 2)
        best = min(best, (error, cut))
    return best[1]


def _pysindy(is_domain, is_validated):
    def method(rows, gains, y):
        library, names = (terms.domain, list(terms.DOMAIN)) if is_domain else (terms.generic, terms.generic_names())
        x, rest = _thin(library(rows), gains, y, 8000)
        weights = _sindy(x, rest, _cross_validated(x, rest) if is_validated else None)
        return _chosen(weights, names, library, str if is_domain else lambda name: terms.GENERIC.get(name, "unknown"))
    return method


def gplearn(rows, gains, y):
    """Symbolic regression of the residual. A formula has no id: it gets that of the domain term it follows, from |r| = 0.9."""
    from gplearn.genetic import SymbolicRegressor
    from sklearn.utils import check_random_state
    variables = lambda r: np.stack([r[n] for n in terms.VARIABLES], 1)  # noqa: E731
    step = max(1, len(y) // 2000)
    rest, x = _less_gains(gains, y)[::step], variables(rows)
    size = np.sqrt(np.mean(x**2, axis=0)) + 1e-12
    last = np.arange(len(rest)) % 400 >= 300
    fit = SymbolicRegressor(population_size=400, generations=10, function_set=("add", "sub", "mul", "div", "abs", "sqrt", "neg"), parsimony_coefficient=1e-3,
                            random_state=check_random_state(0), n_jobs=1).fit((x / size)[::step][~last], rest[~last])
    formula = lambda r: np.asarray(fit.predict(variables(r) / size))[:, None]  # noqa: E731
    got = _less_gains(gains, formula(rows))[:, 0]
    seen = got[::step][last]
    if np.sum((rest[last] - seen) ** 2) >= np.sum(rest[last] ** 2) or not np.any(got):
        return [], None  # worse than nothing on rows it has not seen
    x, _ = _thin(terms.domain(rows), gains, y)
    got = got[::max(1, len(y) // MOST_ROWS)]
    follows = np.abs(x.T @ got) / np.sqrt(np.sum(x**2, 0) * np.sum(got**2) + 1e-300)
    best = int(np.argmax(follows))
    return [list(terms.DOMAIN)[best] if follows[best] >= 0.9 else "unknown"], formula


METHODS = {"threshold": threshold, "lasso-bic": lasso_bic, "pysindy-generic": _pysindy(False, False), "pysindy-generic-cv": _pysindy(False, True),
           "pysindy-domain": _pysindy(True, False), "pysindy-domain-cv": _pysindy(True, True), "gplearn": gplearn}
