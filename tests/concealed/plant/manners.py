"""Manners: how a machine is moved and logged, independent of the hidden effects.

A manner changes the design of `cases.design`; what an effect needs to show at all (its own motions, a mass) is set
after it. `laboratory` is the measuring programme of a rig: jerk-limited moves, 200 Hz. The others are usual on
machines.
"""
import numpy as np

NAMES = ("laboratory", "corners", "handling", "log", "by-speed", "fine")


def draw(rng, name, law, ids):
    """Changes of a design under the manner `name`."""
    if name == "laboratory":
        return {}
    if law == "axis":  # an axis keeps its rate and its stroke
        return {"jerk_time": 0.0} if name in ("corners", "handling") else {}
    # the zero of the scale may be anywhere; places that oil and rail refer to stay those of the machine
    changes = {"zero": float(rng.choice([0.0, rng.uniform(-1.5, 3.0)])), "ripple": float(rng.uniform(0.0, 0.004))}
    if name == "corners":  # the acceleration jumps; the mass may be moved without a measured acceleration
        changes |= {"jerk_time": 0.0, "mass": float(rng.choice([0.0, 8.0, 25.0])), "measured_acceleration": 0.3}
    if name == "handling":  # a few taught places, full acceleration, rests
        changes |= {"jerk_time": float(rng.choice([0.0, 0.03])), "mass": float(np.round(rng.uniform(5, 40), 1)), "measured_acceleration": 0.2, "kinds": ["handling"],
                    "accel": 10.0, "speed": (0.05, 1.0), "dwell": (0.2, 1.2), "preload": (2000.0, 6000.0), "rate": 500, "oversample": 2, "seconds": 12.0}
    if name == "log":  # a controller's log: at a low rate, in micrometres, without speed
        rate = int(rng.choice([50, 100]))
        changes |= {"rate": rate, "oversample": 1000 // rate, "seconds": 40.0, "micrometres": True, "velocity": False}
    if name == "by-speed":  # a tachometer and no scale
        changes |= {"by_speed": True, "velocity": True}
    if name == "fine":
        changes |= {"rate": 1000, "oversample": 1, "seconds": 10.0}
    return changes
