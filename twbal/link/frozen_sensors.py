"""Sensors that say the same again and again: broken, or not read, though what they say could be."""

from twbal.core.episode import Ending, Outcome
from twbal.core.heading import HeadingSample
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation
from twbal.link.protocol import WATCHDOG

_ALWAYS_ENOUGH = 3  # of the same in a row, where control periods are long
_ROUNDING = 1e-6  # of times [s]


class FrozenSensors:
    """Watches a rollout of a robot on a link, and ends it where tilt and tilt rate stand still to the last bit.

    An IMU's last digits change with its noise, also at rest; the encoder of a wheel that stands says the same, rightly.
    A robot that is driven by what its IMU said last is on the ground in half a second. The patience is that of the
    robot's watchdog.
    """

    def __init__(self) -> None:
        self._since: Observation | None = None
        self._same = 0

    def __call__(
        self, seen: Observation, reference: Motion, heading: HeadingSample | None, command: float
    ) -> Ending | None:
        """Look at an observation; an ending where the IMU is frozen. See `twbal.algorithm.rollout.Watch`."""
        since = self._since
        if since is None or (seen.tilt, seen.tilt_rate) != (since.tilt, since.tilt_rate):
            self._since, self._same = seen, 0
            return None
        self._same += 1
        stood = seen.time - since.time
        if stood < WATCHDOG - _ROUNDING or self._same < _ALWAYS_ENOUGH:
            return None
        return Ending(
            Outcome.LINK_LOST,
            f"The robot's tilt and tilt rate are the same for {stood:.2f} s, to the last digit ({seen.tilt:.4g} rad, "
            f"{seen.tilt_rate:.4g} rad/s): a sensor that works changes. Is the IMU connected, and read in each period?",
        )
