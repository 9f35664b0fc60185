"""Dry friction that grows over an angle, which a physics engine has no form for."""

from twbal.core.robot_parameters import RobotParameters


def cut(value: float, bound: float) -> float:
    """`value` within ±`bound`."""
    return min(max(value, -bound), bound)


def rates_apart(robot: RobotParameters) -> float:
    """By which the right wheel is faster than the mean of both, and the left one slower, for a yaw rate of 1 rad/s."""
    return 0.5 * robot.track / robot.wheel_radius


class Bristles:
    """Dry friction of both wheels, step by step; the equation is that of `planar.presliding.bristles`."""

    def __init__(self, robot: RobotParameters, angle: float, mobility: float, physics_step: float) -> None:
        """Friction without torque.

        Args:
            robot: whose wheels turn by different rates where it turns.
            angle: over which the friction grows [rad].
            mobility: rate that an impulse on both wheels adds to their mean [1/(kg·m²)].
            physics_step: [s].
        """
        self._apart = rates_apart(robot)
        self._angle, self._mobility, self._step = angle, mobility, physics_step
        self.begin((0.0, 0.0))

    def begin(self, torques: tuple[float, float]) -> None:
        """Begin a rollout with torques of the friction on the left wheel and the right one [N·m]."""
        self._torques = torques
        self._rate_before: float | None = None

    def apart(self, yaw_rate: float) -> float:
        """By which the right wheel is faster than the mean of both, and the left one slower [rad/s]."""
        return self._apart * yaw_rate

    def rub(self, rate: float, yaw_rate: float, bounds: tuple[float, float], at_rest: float) -> tuple[float, float]:
        """Torques on the left wheel and the right one in the next physics step [N·m].

        What else moves the wheels is taken to be as in the step before.

        Args:
            rate: mean of the wheels [rad/s].
            yaw_rate: of the robot, to the left [rad/s].
            bounds: of the torques on the left wheel and the right one at their rates [N·m].
            at_rest: the same of each at rest.
        """
        expected = rate if self._rate_before is None else 2.0 * rate - self._rate_before
        self._rate_before = rate
        left, right = self._torques
        apart = self.apart(yaw_rate)
        self._torques = (
            self._grown(left, expected - apart, bounds[0], at_rest),
            self._grown(right, expected + apart, bounds[1], at_rest),
        )
        return self._torques

    def _grown(self, torque: float, rate: float, bound: float, at_rest: float) -> float:
        if bound == 0.0:
            return 0.0
        before = cut(torque, bound)
        stiffness = self._step * at_rest * (1.0 + before / bound if rate > 0.0 else 1.0 - before / bound) / self._angle
        return cut(before - stiffness * rate / (1.0 + 2.0 * self._step * stiffness * self._mobility), bound)
