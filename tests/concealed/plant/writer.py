"""Recording, simulation file and truth of one case, as files."""
import json
import numpy as np


def table(columns, path, damage=None):
    """Write columns {name: (array, format)} as a contract CSV; `damage(lines)` may spoil the text."""
    names = list(columns)
    text = "%s\n" % ",".join(names)
    row = ",".join(columns[n][1] for n in names)
    data = np.column_stack([np.asarray(columns[n][0], float).ravel() for n in names])
    lines = [row % tuple(r) for r in data.tolist()]
    if damage:
        lines = damage(names, lines)
    end = "" if damage and getattr(damage, "cut", False) else "\n"
    path.write_text(text + "\n".join(lines) + end, encoding="utf-8", newline="\n")


def simulation(w, d, path, stated, tolerance, relative, force_column, preload):
    """The simulation file: the law without any concealed effect."""
    out = ['schema = "guideblock.simulation/1"', ""]
    if not force_column and w.law == "guide":
        g = w.guide
        out += ["[guide]", 'parameters = "zhou-2023"', f"conformity = {g.conformity}", 'hersey = "slip"',
                f'contact_angle_mode = "{"exact" if g.exact_angle else "fixed"}"', f"mu_coulomb = {g.mu_c:.6g}", f"mu_viscous = {g.mu_v:.6g}",
                f"mu_stribeck = {g.mu_s:.6g}", f"stribeck_exponent = {g.k_s:.6g}", "", "[lubricant]"]
        out += [f"viscosity_40_cst = {w.oil[0]:.6g}", f"viscosity_100_cst = {w.oil[1]:.6g}"] if w.oil else [f"viscosity_cst = {w.viscosity:.6g}"]
        out += ["", "[operation]", f"preload_n = {preload:.6g}", "", "[axis]", f"moved_mass_kg = {w.mass:.6g}", "zero_speed_m_s = 3e-5"]
    elif not force_column:
        out += ["[guide]", 'law = "coulomb-viscous"']
        out += [f"{n} = {v:.6g}" for n, v in stated.items() if n != "moved_mass_kg"]
        out += ["", "[axis]"] + ([f"moved_mass_kg = {stated['moved_mass_kg']:.6g}"] if "moved_mass_kg" in stated else []) + ["zero_speed_m_s = 3e-5"]
    else:
        out += ["[axis]", "zero_speed_m_s = 3e-5"]
    out += [f'position_reference = "{"relative" if relative else "absolute"}"', "", "[tolerance]"]
    out += [f"{n} = {v:.6g}" for n, v in tolerance.items()]
    path.write_text("\n".join(out) + "\n", encoding="utf-8", newline="\n")


def truth(data, path):
    """truth.json with sorted keys and plain numbers."""
    def plain(x):
        if isinstance(x, dict):
            return {str(k): plain(v) for k, v in x.items()}
        if isinstance(x, (list, tuple)):
            return [plain(v) for v in x]
        if isinstance(x, np.ndarray):
            return plain(x.tolist())
        if isinstance(x, (np.floating, float)):
            return float(f"{float(x):.9g}")
        if isinstance(x, (np.integer, np.bool_)):
            return x.item()
        return x
    path.write_text(json.dumps(plain(data), indent=1, sort_keys=True) + "\n", encoding="utf-8", newline="\n")
