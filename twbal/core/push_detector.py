"""Tells that a robot is pushed, by how fast its speed changes."""

from collections import deque

PUSH_TIME = 0.1
"""Within which the speed of a robot that is pushed changes by more than the limit that its sheet gives a reference [s],
v² = 0.25 g h, h being the height of the centre of mass above ground (`MotionLimits.of_robot`). A robot cannot gain so
much speed in so little time by leaning; by a push of 1 N·s for each kg small ones do."""
AFTER_PUSH = 0.4
"""For which it counts as pushed from then on [s]."""
PAUSE = 2.0
"""From the beginning of a push to that of the next [s]: tyres that slip after one change the wheels' speed as fast."""
START = 2.0
"""From which on pushes are told [s]: a robot that begins with a lean has to roll fast, too."""
_NEARLY = 1e-9  # s


class PushDetector:
    """Is told the speed of a robot at each observation of a rollout.

    Args:
        push: change of the speed that is one [m/s].
    """

    def __init__(self, push: float) -> None:
        self._push = push
        self._recent: deque[tuple[float, float]] = deque()  # times and speeds of the last 0.1 s
        self._next, self._until = START, 0.0  # when the next push may begin, and when the last one is over [s]

    def follow(self, time: float, speed: float) -> bool:
        """Whether the robot is pushed, or was a short time ago.

        Args:
            time: since the rollout began, no earlier than that of the call before [s].
            speed: of the robot [m/s].
        """
        self._recent.append((time, speed))
        while self._recent[0][0] < time - PUSH_TIME - _NEARLY:
            self._recent.popleft()
        if time > self._next and abs(speed - self._recent[0][1]) > self._push:
            self._next, self._until = time + PAUSE, time + AFTER_PUSH
        return time < self._until
