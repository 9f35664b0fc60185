"""A balancing robot's log, made from closed forms, so that every rate is known."""

import numpy as np

PERIOD = 0.01
NAMES = ("time", "tilt", "tilt_rate", "acceleration", "yaw_rate", "wheel_angle", "wheel_rate", "command")


def columns(n=400):
    """What the quantities of `import=columns` would be, (n, 8)."""
    t = PERIOD * np.arange(n)
    tilt, tilt_rate = 0.05 * np.sin(3 * t), 0.15 * np.cos(3 * t)
    wheel, wheel_rate = 2 * np.sin(2 * t), 4 * np.cos(2 * t)
    return np.column_stack([t, tilt, tilt_rate, 0 * t, 0.1 * np.sin(t), wheel, wheel_rate, np.sin(5 * t)])


def text(rows, delimiter=",", names=NAMES, decimal="."):
    """The rows as a text file."""
    lines = [delimiter.join(names)] if names else []
    lines += [delimiter.join(f"{x:.9g}".replace(".", decimal) for x in row) for row in rows]
    return "\n".join(lines) + "\n"
