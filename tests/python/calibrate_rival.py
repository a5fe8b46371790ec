"""scipy's curve_fit against `guideblock calibrate` on the same strokes: constants and standard deviations.

    python tests/python/calibrate_rival.py target/desk/guideblock
"""

import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.optimize import curve_fit

# agreement that the README states
CONSTANTS = 1e-5
DEVIATIONS = 1e-5

PUBLISHED = {"mu_coulomb": 0.00182, "mu_viscous": 8.74e6, "mu_stribeck": 0.0016, "stribeck_exponent": 7.43e10}
SPEEDS = np.concatenate([np.arange(1, 11) * 0.1, 1.5 + 0.5 * np.arange(10)]) / 60
LOADS = 500 + 900 * np.arange(10)


def law_in_units_of(units):
    """Force of four constants, each in its unit: the solver works on numbers of one size."""

    def law(x, *constants):
        normal, hersey = x
        coulomb, viscous, stribeck, exponent = (c * unit for c, unit in zip(constants, units))
        return normal * (coulomb + viscous * hersey + stribeck * np.exp(-exponent * hersey))

    return law


def forces(program, folder, constants, hersey):
    """Noise-free drag forces of the grid, by the program's calculator."""
    guide = folder / "guide.toml"
    lines = ['schema = "guideblock.simulation/1"', "[guide]", 'parameters = "zhou-2023"', f'hersey = "{hersey}"']
    lines += [f"{key} = {value!r}" for key, value in constants.items()]
    guide.write_text("\n".join(lines + ["[lubricant]", "viscosity_cst = 100.0", ""]))
    table = "preload_n,speed_m_s\n" + "".join(f"{f!r},{v!r}\n" for f in LOADS.tolist() for v in SPEEDS.tolist())
    done = subprocess.run([program, "drag", "--csv", "--guide", guide], input=table, capture_output=True, text=True, check=True)
    rows = list(csv.reader(done.stdout.splitlines()))
    place = rows[0].index("calculated_force_n")
    return guide, np.array([float(row[place]) for row in rows[1:]]).reshape(len(LOADS), len(SPEEDS))


def main():
    program = Path(sys.argv[1]).resolve()
    worst = [0.0, 0.0]
    for seed in range(8):
        random = np.random.default_rng(seed)
        hersey = ("slip", "carriage")[seed % 2]
        constants = {key: float(x * 2 ** random.uniform(-0.5, 0.5)) for key, x in PUBLISHED.items()}
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            guide, clean = forces(program, folder, constants, hersey)
            rows = ["velocity_m_s,drag_force_n,preload_n"]
            for f, load in zip(clean, LOADS):
                for x, v in zip(f, SPEEDS):
                    for d in (1, -1):
                        noisy = x * (1 + 0.01 * random.standard_normal()) + 0.1 * random.standard_normal()
                        rows.append(f"{float(d * v)!r},{float(d * noisy)!r},{load}")
            table = folder / "grid.csv"
            table.write_text("\n".join(rows) + "\n")
            command = [program, "calibrate", table, "--guide", guide, "--hersey", hersey, "--json"]
            found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
        strokes = found["fitted_strokes"]
        x = np.array([[s["normal_force_n"] for s in strokes], [s["hersey"] for s in strokes]])
        y, sigma = (np.array([s[key] for s in strokes]) for key in ("force_n", "sigma_n"))
        units = list(constants.values())
        exact = {"absolute_sigma": True, "ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15, "maxfev": 20000}
        best, covariance = curve_fit(law_in_units_of(units), x, y, p0=np.ones(4), sigma=sigma, **exact)
        for theirs, deviation, unit, ours in zip(best, np.sqrt(np.diag(covariance)), units, found["constants"]):
            worst[0] = max(worst[0], abs(ours["value"] / (theirs * unit) - 1))
            worst[1] = max(worst[1], abs(ours["sigma"] / (deviation * unit) - 1))
    print(f"scipy curve_fit on 8 grids of 400 strokes: constants agree to {worst[0]:.1e}, standard deviations to {worst[1]:.1e}")
    if worst[0] > CONSTANTS or worst[1] > DEVIATIONS:
        sys.exit(f"more than the {CONSTANTS:g} and {DEVIATIONS:g} that are stated")


if __name__ == "__main__":
    main()
