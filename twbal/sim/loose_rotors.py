"""Rotors behind a backlash, which a physics engine has no form for, beside it step by step."""

from typing import NamedTuple

from twbal.core.engine import RobotMotion
from twbal.core.mobility import inertias, slip_mobility
from twbal.core.play import Play, engage
from twbal.core.robot_model import UNBOUNDED, Ground
from twbal.core.robot_parameters import GRAVITY, RobotParameters


class GearedInertia(NamedTuple):
    """Where the inertia of rotors is that turn relative to the body.

    Attributes:
        carried: share of the inertia of the rotors behind a backlash that is of such ones.
        coupling: of those on the wheels' side of it [kg·m²].
        turning: by which all of them make the body harder to pitch [kg·m²].
    """

    carried: float
    coupling: float
    turning: float


def geared_inertia(geared: float, rotors: float) -> GearedInertia:
    """As much of it as there can be is on the rotors' side of a backlash.

    Args:
        geared: inertia of both geared rotors [kg·m²].
        rotors: of what is behind a backlash [kg·m²]; 0 where there is none.
    """
    behind = min(geared, rotors)
    carried = behind / rotors if behind > 0.0 else 0.0
    return GearedInertia(carried, geared - behind, geared - behind + (1.0 - carried) * behind)


class Mobilities(NamedTuple):
    """Rates that an impulse adds [1/(kg·m²)].

    Attributes:
        wheels: to the wheels', by one on them from outside.
        both: to the body's, by one on the wheels, and to the wheels', by one on the body.
        body: to the body's, by one on it.
    """

    wheels: float
    both: float
    body: float


def rolling_mobilities(robot: RobotParameters, turning: float, coupling: float) -> Mobilities:
    """Of the upright robot whose wheels roll.

    Args:
        robot: without what geared rotors do to its body.
        turning, coupling: as of `GearedInertia`.
    """
    a, b, c = inertias(robot)
    b, c = b - coupling, c + turning
    determinant = a * c - b**2
    return Mobilities(c / determinant, -b / determinant, a / determinant)


def sliding_mobilities(robot: RobotParameters, turning: float) -> Mobilities:
    """The same where the wheels slide, and turn by themselves."""
    a, b, c = inertias(robot)
    spin = 2.0 * robot.wheel_inertia
    axle = a - spin
    return Mobilities(1.0 / spin, 0.0, axle / (axle * (c + turning) - b**2))


class _Gains(NamedTuple):
    """Rates that an impulse of the rotors on the wheels adds to wheels and body [1/(kg·m²)].

    Attributes:
        wheels: to the wheels'.
        body: to the body's.
        apart: by which the rotors fall behind the wheels, beside their own change of rate.
    """

    wheels: float
    body: float
    apart: float


def _gains(free: Mobilities, carried: float) -> _Gains:
    wheels, body = free.wheels - carried * free.both, free.both - carried * free.body
    return _Gains(wheels, body, wheels - carried * body)


class LooseRotors:
    """What the rotors behind a backlash pass on to the wheels, step by step.

    What moves wheels and body beside the contact is taken to be as in the step before. The wheels roll as long as the
    tyres hold them, and what an impulse is beyond that turns wheels that slide.
    """

    def __init__(
        self, play: Play, geared: GearedInertia, robot: RobotParameters, ground: Ground, physics_step: float
    ) -> None:
        """Rotors without motion.

        Args:
            play: the backlash.
            geared: inertia of geared rotors.
            robot: its wheels without the rotors.
            ground: on which it stands.
            physics_step: [s].
        """
        self._play, self._carried, self._step = play, geared.carried, physics_step
        # Wheels that may slip feel the coupling a step later, and tyres that creep pull a step later.
        coupling = geared.coupling if ground.grip == UNBOUNDED else 0.0
        free = rolling_mobilities(robot, geared.turning, coupling)
        self._rolling = _gains(free, geared.carried)
        self._sliding = _gains(sliding_mobilities(robot, geared.turning), geared.carried)
        creeps = ground.grip < UNBOUNDED and ground.tyre_creep > 0.0
        weight = GRAVITY * (robot.body_mass + 2.0 * robot.wheel_mass)
        self._traction = 0.0 if creeps else physics_step * min(ground.grip, 1.0) * weight  # most in a step [N·s]
        self._radius, self._slip_mobility = robot.wheel_radius, slip_mobility(robot)
        self._per_traction = robot.wheel_radius / (1.0 - 2.0 * robot.wheel_inertia * free.wheels)
        self.begin(0.0, 0.0, (0.0, 0.0))

    def begin(self, ahead: float, faster: float, accelerations: tuple[float, float]) -> None:
        """Begin a rollout.

        Args:
            ahead: of the wheels are the rotors [rad].
            faster: than the wheels are they [rad/s].
            accelerations: of wheels and body in the step before [rad/s²].
        """
        self._ahead, self._faster, self._accelerations = ahead, faster, accelerations
        self._angle = self._own_rate = 0.0  # of the rotors in space; the rate, but for what the body takes along
        self._wheel_rate = self._tilt_rate = 0.0  # a step before
        self._held = self._beyond = 0.0  # of the contact's torque in that step, within the tyres' grip and beyond it
        self._begins = True

    def motion(self, motion: RobotMotion) -> tuple[float, float]:
        """Angle of the rotors relative to the body [rad], and its rate, at the motion of the robot."""
        if self._begins:
            return motion.wheel_angle + self._ahead, motion.wheel_rate + self._faster
        return self._angle - motion.tilt, self._own_rate + self._carried * motion.tilt_rate - motion.tilt_rate

    def pass_on(self, torque: float, motion: RobotMotion) -> float:
        """Torque that the wheels get of what the motors make [N·m], for one physics step."""
        h, carried, tilt_rate = self._step, self._carried, motion.tilt_rate
        rolling, sliding = self._rolling, self._sliding
        wheel, wheel_rate = motion.wheel_angle + motion.tilt, motion.wheel_rate + tilt_rate
        if self._begins:
            self._angle, self._own_rate = wheel + self._ahead, wheel_rate + self._faster - carried * tilt_rate
            self._wheel_rate = wheel_rate - h * self._accelerations[0]
            self._tilt_rate = tilt_rate - h * self._accelerations[1]
            self._begins = False
        drift = wheel_rate - self._wheel_rate - h * rolling.wheels * self._held - h * sliding.wheels * self._beyond
        turned = tilt_rate - self._tilt_rate - h * rolling.body * self._held - h * sliding.body * self._beyond
        wheels, before = wheel_rate + drift, self._own_rate + carried * tilt_rate - wheel_rate
        own_rate = self._own_rate + h * torque / self._play.rotors
        free = own_rate + carried * (tilt_rate + turned) - wheels
        held, beyond, ahead = self._meet(self._angle - wheel, before, free, motion)
        self._own_rate = own_rate - (held + beyond) / self._play.rotors
        self._angle = wheel + h * (wheels + rolling.wheels * held + sliding.wheels * beyond) + ahead
        self._wheel_rate, self._tilt_rate, self._held, self._beyond = wheel_rate, tilt_rate, held / h, beyond / h
        return (held + beyond) / h

    def _meet(self, ahead: float, before: float, free: float, motion: RobotMotion) -> tuple[float, float, float]:
        """Impulse on wheels that roll and what of it is beyond their grip [N·m·s], and how far ahead the rotors end.

        Args:
            ahead, before, free: as of `engage`.
            motion: of the robot.
        """
        h, rolling, sliding = self._step, self._rolling.apart, self._sliding.apart
        impulse, after = engage(self._play, h, ahead, before, free, rolling)
        slip = motion.speed - self._radius * (motion.wheel_rate + motion.tilt_rate)
        most = max(self._traction - abs(slip) / self._slip_mobility, 0.0) * self._per_traction
        held = min(max(impulse, -most), most)
        if held == impulse:
            return held, 0.0, after
        impulse, after = engage(self._play, h, ahead, before, free + (sliding - rolling) * held, sliding)
        return held, impulse - held, after
