"""Base class of effects: what they may change, in the order of the pipeline, and the one number that scales them."""
import numpy as np


class Effect:
    """One concealed effect. Shape constants are drawn once; `k` is the scale that the asked strength fixes.

    Every hook gets the session `c`, the world `w` and the scale `k`, and returns the changed quantity.
    """
    id = "?"
    first = 1.0            # first guess of k
    limit = 1e6            # largest physically meaningful k
    unit = ""              # of k
    equivalents = ()       # ids that no recording of this design can tell from it
    near = ()              # ids that resemble it in many recordings
    plain = {}             # shape constants of the simplest drawing of its kind
    name_k = "scale"

    def __init__(self, rng, world, design):
        self.p = {}
        self.draw(rng, world, design)

    def draw(self, rng, world, design):
        """Draw the shape constants into `self.p`."""

    def rows(self, c, w, k, q):
        """Load factors of groups of ball rows: list of (share of rows, factor), or None."""
        return None

    def preload(self, c, w, k, q):
        """Factor on the ball load."""
        return 1.0

    def oil(self, c, w, k, nu, heat):
        """Viscosity number seen by the contact."""
        return nu

    def mu(self, c, w, k, parts, h, q):
        """Shares (coulomb, viscous, stribeck) of the friction coefficient."""
        return parts

    def magnitude(self, c, w, k, f, q):
        """Magnitude of the friction force in steady motion."""
        return f

    def friction(self, c, w, k, magnitude, force):
        """Signed friction force from its magnitude (memory, presliding)."""
        return force

    def add(self, c, w, k, force):
        """Any further force on the drive."""
        return 0.0

    def sensor(self, c, w, k, force):
        """Force as the force channel distorts it."""
        return force

    def after_noise(self, c, w, k, recorded):
        """Noisy force at the recorded samples as the converter distorts it."""
        return recorded

    def channels(self, c, w, k, y, v):
        """Recorded position and velocity."""
        return y, v

    def describe(self, k):
        """Parameters for truth.json."""
        out = [{"name": self.name_k, "value": float(k), "unit": self.unit}]
        for name, value in self.p.items():
            v = np.asarray(value, float).tolist()
            out.append({"name": name, "value": v, "unit": ""})
        return out


def hertz(x):
    """(1 + x)^1.5 for a relative change x of the interference, never below a nearly loose ball."""
    return np.maximum(1 + x, 0.05) ** 1.5
