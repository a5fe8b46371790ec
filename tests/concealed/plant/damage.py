"""Damaged files: what recorders and people do to a recording."""


class Damage:
    """Changes the text lines of a table; `story` tells what was done (rows count from 1 after the header)."""
    cut = False

    def __init__(self, rng):
        self.rng, self.story = rng, {}

    def __call__(self, names, lines):
        raise NotImplementedError

    def cell(self, lines, i, j, text):
        """Replace cell j of line i."""
        c = lines[i].split(",")
        c[j] = text if not callable(text) else text(c[j])
        lines[i] = ",".join(c)


class Gaps(Damage):
    """Rows lost inside segments."""
    def __call__(self, names, lines):
        places = sorted(self.rng.integers(200, len(lines) - 400, 6).tolist(), reverse=True)
        for p in places:
            del lines[p:p + int(self.rng.integers(3, 200))]
        self.story = {"type": "gaps", "count": len(places)}
        return lines


class ClockJumpBack(Damage):
    """The clock is set back once."""
    def __call__(self, names, lines):
        p = int(self.rng.integers(len(lines) // 3, len(lines) // 2))
        for i in range(p, len(lines)):
            self.cell(lines, i, 0, lambda x: "%.4f" % (float(x) - 47.3))
        self.story = {"type": "clock-jump-back", "row": p + 1, "seconds": -47.3}
        return lines


class BadCells(Damage):
    """Not-a-number, infinity, text and empty cells, and doubled time stamps."""
    def __call__(self, names, lines):
        j = names.index("drag_force_n")
        for i in self.rng.integers(0, len(lines), 40):
            self.cell(lines, int(i), j, str(self.rng.choice(["NaN", "inf", "--", "", "1.2.3", "#REF!"])))
        doubled = [int(i) for i in self.rng.integers(10, len(lines), 5)]
        for i in doubled:
            self.cell(lines, i, 0, lines[i - 1].split(",")[0])
        self.story = {"type": "bad-cells", "count": 40, "duplicated_times": 5}
        return lines


class CutOff(Damage):
    """The recorder lost power in the last line."""
    cut = True

    def __call__(self, names, lines):
        lines[-1] = lines[-1][:max(8, len(lines[-1]) // 2)]
        self.story = {"type": "truncated-last-line"}
        return lines


class Minutes(Damage):
    """Time in minutes."""
    def __call__(self, names, lines):
        for i in range(len(lines)):
            self.cell(lines, i, 0, lambda x: "%.8f" % (float(x) / 60))
        self.story = {"type": "units", "column": "time_s", "factor": 1 / 60}
        return lines


class Millimetres(Damage):
    """Position in millimetres and velocity in mm/s under the SI names."""
    def __call__(self, names, lines):
        js = [names.index(n) for n in ("position_m", "velocity_m_s") if n in names]
        for i in range(len(lines)):
            for j in js:
                self.cell(lines, i, j, lambda x: "%.4f" % (float(x) * 1000))
        self.story = {"type": "units", "column": "position_m", "factor": 1000}
        return lines


class StuckForce(Damage):
    """A dead force channel."""
    def __call__(self, names, lines):
        j = names.index("drag_force_n")
        for i in range(len(lines)):
            self.cell(lines, i, j, "3.14159")
        self.story = {"type": "stuck-force"}
        return lines


class TooShort(Damage):
    """Only 150 rows."""
    def __call__(self, names, lines):
        self.story = {"type": "too-short", "rows": 150}
        return lines[:150]


DAMAGES = {"gaps": Gaps, "clock-jump-back": ClockJumpBack, "bad-cells": BadCells, "truncated": CutOff, "minutes": Minutes, "millimetres": Millimetres,
           "stuck-force": StuckForce, "too-short": TooShort}
