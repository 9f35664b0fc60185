"""An IMU that shows the past."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from twbal.core.plant import Observation
from twbal.core.quantities import Quantity
from twbal.core.robot_model import SensorFilter
from twbal.effects.effect import Place, SensorEffect
from twbal.effects.parameter import Scale, adds_to, parameter


@dataclass(frozen=True)
class ImuDelay(SensorEffect):
    """Tilt and tilt rate are shown `delay` late; before the rollout they were as at its start.

    It acts on the IMU. Between control instants the tilt is a cubic through tilts and rates, the rate a straight line.
    """

    delay: float = parameter(
        "by which tilt and tilt rate are shown late",
        "s",
        (0.0, 0.04),
        start=0.005,
        value=0.01,
        scale=Scale.PERIOD,
        below=10.0,
        changes=adds_to(Quantity.IMU_DELAY),
    )
    place = Place.LATENCY
    reference = (
        "P. Furgale, J. Rehder, R. Siegwart: Unified temporal and spatial calibration for multi-sensor systems, "
        "IEEE/RSJ International Conference on Intelligent Robots and Systems, 2013, 1280-1286."
    )
    is_linear = True
    nearly_same_as = ("actuation_delay",)
    separate_by = "Turn the body by hand and compare the IMU with the wheel encoders."

    def start(self, control_period: float, rng: np.random.Generator) -> SensorFilter:
        """Hand out a sensor whose past is like the first instant."""
        back = self.delay / control_period
        whole = int(back)
        share = back - whole  # of the way from the nearer instant to the one before
        past: deque[tuple[float, float]] = deque(maxlen=whole + 2)

        def late(truth: Observation) -> Observation:
            now = (truth.tilt, truth.tilt_rate)
            past.extend([now] * (1 if past else whole + 2))
            before, after = past[0], past[1]
            tilt, rate = _between(before, after, 1.0 - share, control_period)
            return truth._replace(tilt=tilt, tilt_rate=rate)

        return late


def _between(before: tuple[float, float], after: tuple[float, float], share: float, span: float) -> tuple[float, float]:
    """Value and slope at `share` of the way between two instants `span` apart, each with its value and slope."""
    (a, da), (b, db) = before, after
    s, t = share, 1.0 - share
    value = t * t * (1 + 2 * s) * a + s * s * (3 - 2 * s) * b + span * s * t * (t * da - s * db)
    return value, t * da + s * db
