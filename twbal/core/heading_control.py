"""Keeps a robot's heading at that of a reference, by the difference of its wheel torques."""

from math import inf
from typing import NamedTuple

from twbal.core.heading import HeadingEstimate, HeadingSample
from twbal.core.mobility import falling_time, yaw_mobility
from twbal.core.motion_limits import TURNING_SHARE
from twbal.core.motion_profile import STILL, Motion
from twbal.core.plant import Observation, WheelDifference
from twbal.core.reference import Reference, Targets
from twbal.core.robot_parameters import RobotParameters

PACE = 1.5
"""Triple pole of the loop, in rates at which the robot falls. The faster, the sooner friction is overcome."""
CALMER, CALMEST = 0.85, 0.3
"""Factor on the pole each time that the loop is seen to shake, and the least share of it that is left."""
FRICTION_SHARE = 0.25
"""Of the torque limit, which may be integrated against friction and dead zone besides what moves the robot."""
STEADY_SHARE = 0.2
"""Of the integral's gain, where the robot is not to turn. Each time that balancing rolls the wheels, about once in six
falling times, friction lets go of the heading: what was integrated against it would then throw the robot round."""
TURNS_FROM = 0.1
"""Share of the reference's largest yaw rate from which on a turn's friction is all there."""
NAME = "heading's reference"
"""As events speak of it."""


class _Integrals(NamedTuple):
    """Of the error, as torques [N·m]: for standing or driving straight, and besides for turning to the left.

    Friction opposes a turn, and is gone, or the other way round, when the turn is over. What was integrated against it
    would then drive the robot on, and stiction would hold it there.

    Attributes:
        straight: grows while the robot is not to turn.
        turning: grows while it is; its sign goes with the turn's.
    """

    straight: float = 0.0
    turning: float = 0.0

    def grown(self, torque: float, turning: float, most: float) -> "_Integrals":
        """With the torque of an error over a time.

        Args:
            torque: to add [N·m].
            turning: from -1 (to the right) to 1.
            most: bound of each part [N·m].
        """
        if turning:
            return self._replace(turning=min(max(self.turning + turning * torque, -most), most))
        return self._replace(straight=min(max(self.straight + STEADY_SHARE * torque, -most), most))

    def sum(self, turning: float) -> float:
        """What the law takes [N·m]."""
        return self.straight + turning * self.turning


class HeadingControl:
    """The loop of one rollout: estimate, reference and a PID law with the reference's acceleration fed forward.

    d = (2 r J / b) (ψ̈_r + 3 p ė + 3 p² e + p³ ∫e), e = ψ_r - ψ: the robot's yaw is an integrator of an integrator, ψ̈
    = b d / (2 r J) (`yaw_mobility`), so all three poles of the loop lie at -p. ∫e is kept in two parts, one of which is
    there in turns only (`_Integrals`); the other grows a fifth as fast, for which the poles lie at -0.07 p and (-1.46 ±
    0.81 i) p. All but the integral keeps within a quarter of the torque limit. Each part of the integral keeps within
    another quarter, as friction and dead zone may take all of the first, and the difference within what balancing
    leaves and the robot takes. The part for turns grows also where the rest is cut or the reference gives way: only so
    does a robot that sticks come loose. The other part may then shrink, but does not grow.

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
        self.reference = Reference(targets, NAME, leads_all_the_way=True)
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
        stands = max(map(abs, moving)) < STILL
        self._estimate.follow(seen.time, seen.yaw_rate, apart, stands)
        self._step = 0.0 if self._time is None else seen.time - self._time
        self._time = seen.time
        heading, rate = self._estimate.heading, self._estimate.rate
        asked = self.reference.follow(seen.time, heading, rate)
        self.samples.append(HeadingSample(asked.position, asked.speed, heading, rate, 0.0))

    def difference(self, command: float, limit: float = inf) -> float:
        """The difference of the wheel torques from now on [N·m].

        Args:
            command: their sum, which goes first [N·m].
            limit: largest difference that the robot takes [N·m].
        """
        now, pole = self.samples[-1], self._pole
        error, slip = now.reference - now.estimate, now.reference_rate - now.rate
        self._turning = turning = self._turn(now.reference_rate, error)
        asked = (self.reference.motion.acceleration + 3.0 * pole * slip + 3.0 * pole**2 * error) / self._mobility
        left = min(max(self._torque_limit - abs(command), 0.0), limit)
        most = min(TURNING_SHARE * self._torque_limit, left)
        moving = min(max(asked, -most), most)
        if moving != asked:
            self._calm_down(moving)
        is_cut = moving != asked or abs(moving + self._integrals.sum(turning)) > limit
        self._integrate(self._step * pole**3 * error / self._mobility, is_cut, limit)
        done = min(max(moving + self._integrals.sum(turning), -left), left)
        self.samples[-1] = now._replace(difference=done)
        return done

    def _integrate(self, torque: float, is_cut: bool, limit: float) -> None:
        """Let the integral grow by a torque [N·m].

        Args:
            torque: of the error since the observation before.
            is_cut: whether what moves the robot is cut, or the robot's limit cuts it together with the integral.
            limit: largest difference that the robot takes [N·m].
        """
        grown = self._integrals.grown(torque, self._turning, min(FRICTION_SHARE * self._torque_limit, limit))
        is_free = self._turning or not (is_cut or self.reference.gives_way)
        if is_free or abs(grown.straight) < abs(self._integrals.straight):
            self._integrals = grown

    def _calm_down(self, cut: float) -> None:
        """Slow the loop down where it shakes.

        Args:
            cut: what moves the robot is cut to [N·m].
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
