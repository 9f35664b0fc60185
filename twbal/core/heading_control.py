"""Keeps a robot's heading at that of a reference, by the difference of its wheel torques."""

from typing import NamedTuple

from twbal.core.heading import HeadingEstimate, HeadingSample
from twbal.core.mobility import falling_time, yaw_mobility
from twbal.core.motion_limits import TURNING_SHARE
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation, WheelDifference
from twbal.core.reference import Reference, Targets
from twbal.core.robot_parameters import RobotParameters

PACE = 1.5
"""Triple pole of the loop, in rates at which the robot falls. The faster, the sooner friction is overcome."""
CALMER, CALMEST = 0.85, 0.3
"""Factor on the pole each time that the loop is seen to shake, and the least share of it that is left."""
_STILL = 1e-9  # of a speed of a reference [m/s], [rad/s]
TURNS_FROM = 0.1
"""Share of the reference's largest yaw rate from which on a turn's friction is all there."""
NAME = "heading's reference"
"""As events speak of it."""


class _Integrals(NamedTuple):
    """Of the error [rad·s]: what standing or driving straight needs, and what turning to the left needs besides.

    Friction opposes a turn, and is gone, or the other way round, when the turn is over. What was integrated against it
    would then drive the robot on, and stiction would hold it there.

    Attributes:
        straight: grows while the robot is not to turn.
        turning: grows while it is; its sign goes with the turn's.
    """

    straight: float = 0.0
    turning: float = 0.0

    def grown(self, error: float, turning: float) -> "_Integrals":
        """With an error over a time [rad·s], at a turn from -1 (to the right) to 1."""
        if turning:
            return self._replace(turning=self.turning + turning * error)
        return self._replace(straight=self.straight + error)

    def sum(self, turning: float) -> float:
        """What the law takes [rad·s]."""
        return self.straight + turning * self.turning


class HeadingControl:
    """The loop of one rollout: estimate, reference and a PID law with the reference's acceleration fed forward.

    d = (2 r J / b) (ψ̈_r + 3 p ė + 3 p² e + p³ ∫e), e = ψ_r - ψ: the robot's yaw is an integrator of an integrator,
    ψ̈ = b d / (2 r J) (`yaw_mobility`), so all three poles of the loop lie at -p. ∫e is kept in two parts, one of which
    is there in turns only (`_Integrals`). The difference keeps within a quarter of the torque limit, and within what
    balancing leaves of it. While it is cut, or the reference gives way, the integral may shrink, but does not grow.

    A robot that reacts late and is easier to turn than its sheet says is shaken by a loop as fast as that: the
    difference is cut one way, and within the time in which the robot falls the other way. Each time p becomes smaller.

    Args:
        robot: its sheet.
        targets: headings or yaw rates, in rad.
        has_gyro: whether the robot measures its yaw rate.

    Attributes:
        reference: that the heading follows.
        samples: of all observations so far; the last has no difference yet.
    """

    def __init__(self, robot: RobotParameters, targets: Targets, has_gyro: bool) -> None:
        self.reference = Reference(targets, NAME)
        self.samples: list[HeadingSample] = []
        self._estimate = HeadingEstimate(robot, has_gyro)
        self._pole, self._mobility = PACE / falling_time(robot), yaw_mobility(robot)
        self._shaking, self._calmest = falling_time(robot), CALMEST * self._pole  # [s], [1/s]
        self._cut = (0.0, 0.0)  # time of the last cut, and what it was cut to [s], [N·m]
        self._torque_limit = robot.torque_limit
        self._fastest = targets.limits.speed
        self._integrals = _Integrals()
        self._turning = 0.0  # see `_turn`
        self._time: float | None = None
        self._step = 0.0  # since the observation before [s]

    def follow(self, seen: Observation, apart: WheelDifference | None, driven: Motion) -> None:
        """Take the next observation.

        Args:
            seen: by the sensors.
            apart: how far the wheels are apart; None where they are not told apart.
            driven: the reference straight ahead.
        """
        moving = driven.speed, driven.acceleration, self.reference.motion.speed, self.reference.motion.acceleration
        stands = max(map(abs, moving)) < _STILL
        self._estimate.follow(seen.time, seen.yaw_rate, apart, stands)
        self._step = 0.0 if self._time is None else seen.time - self._time
        self._time = seen.time
        heading, rate = self._estimate.heading, self._estimate.rate
        asked = self.reference.follow(seen.time, heading, rate)
        self.samples.append(HeadingSample(asked.position, asked.speed, heading, rate, 0.0))

    def difference(self, command: float) -> float:
        """The difference of the wheel torques from now on [N·m].

        Args:
            command: their sum, which goes first [N·m].
        """
        now, pole = self.samples[-1], self._pole
        error, slip = now.reference - now.estimate, now.reference_rate - now.rate
        self._turning = turning = self._turn(now.reference_rate, error)
        grown = self._integrals.grown(self._step * error, turning)
        proportional = self.reference.motion.acceleration + 3.0 * pole * slip + 3.0 * pole**2 * error
        asked = (proportional + pole**3 * grown.sum(turning)) / self._mobility
        most = min(TURNING_SHARE * self._torque_limit, max(self._torque_limit - abs(command), 0.0))
        done = min(max(asked, -most), most)
        if done != asked:
            self._calm_down(done)
        is_kept = done == asked and not self.reference.gives_way
        if is_kept or abs(grown.sum(turning)) < abs(self._integrals.sum(turning)):
            self._integrals = grown
        self.samples[-1] = now._replace(difference=done)
        return done

    def _calm_down(self, cut: float) -> None:
        """Slow the loop down where it shakes.

        Args:
            cut: what the difference is cut to [N·m].
        """
        assert self._time is not None
        time, before = self._cut
        if cut * before < 0.0 and self._time - time < self._shaking:
            self._pole = max(CALMER * self._pole, self._calmest)
        self._cut = (self._time, cut)

    def _turn(self, reference_rate: float, error: float) -> float:
        """How much the robot turns, from -1 (to the right) to 1: a turn is over when the robot has come to its end."""
        now, before = min(max(reference_rate / (TURNS_FROM * self._fastest), -1.0), 1.0), self._turning
        is_behind = error * before > 0.0 and now * before >= 0.0
        return before if is_behind and abs(now) < abs(before) else now
