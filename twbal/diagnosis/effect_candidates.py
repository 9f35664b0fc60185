"""What the effects of the simulation tell a diagnosis."""

from collections.abc import Sequence
from math import sqrt

from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import GRAVITY, RobotParameters
from twbal.diagnosis.candidates import Candidate, CandidateParameter
from twbal.effects.effect import Effect
from twbal.effects.library import library
from twbal.effects.parameter import Parameter, Scale, parameters_of

_FASTEST = 0.4
"""Of frequencies, times the control period: samples hardly tell a faster one from one below half their rate."""


def candidates_for(robot: RobotParameters, include: Sequence[str] = ()) -> tuple[Candidate, ...]:
    """All effects that may be missing in a robot's simulation, with their ranges in its size.

    Args:
        robot: data sheet.
        include: names of effects that are weighed although they are only where that is asked for.

    Raises:
        ConfigError: one of these is no effect.
    """
    known = library()
    if unknown := set(include) - set(known):
        listed = ", ".join(name for name, kind in known.items() if kind.weighed_if_asked)
        raise ConfigError(f"There is no effect {min(unknown)!r} to include; those that are weighed if asked: {listed}.")
    return tuple(
        _candidate(name, kind, robot) for name, kind in known.items() if not kind.weighed_if_asked or name in include
    )


def _usual_share(p: Parameter, robot: RobotParameters) -> float:
    """What the usual size of a parameter is multiplied by where the motors are far too strong for the robot.

    Ranges of torques grow with the torque limit alone. The torques that a robot uses also grow with its weight.
    """
    if p.scale is not Scale.TORQUE:
        return 1.0
    lying = robot.body_mass * GRAVITY * robot.com_height
    return sqrt(min(lying / robot.torque_limit, 1.0))


def _largest_share(p: Parameter, size: float) -> float:
    """What the largest value of a parameter is multiplied by, of a robot of a size.

    Delays of buses, radios and motors do not get shorter because a loop is fast: of times, no less than at 20 ms.
    """
    return max(size, 1.0) if p.scale is Scale.PERIOD else size


def _candidate(name: str, kind: type[Effect], robot: RobotParameters) -> Candidate:
    parameters = []
    for key, p in parameters_of(kind).items():
        size = p.size(robot)
        low, high = size * p.low, _largest_share(p, size) * p.high
        if p.unit == "Hz":
            high = min(high, _FASTEST / robot.control_period)
        neutral = min(max(size * p.neutral, low), high)  # what no limit is: the far end of the range
        if p.unit == "Hz":
            neutral = min(neutral, 0.99 * high)
        start = min(_usual_share(p, robot) * size * p.start, high)
        known = CandidateParameter(key, p.unit, low, high, start, neutral, p.covers_all, p.form, size * p.sd)
        parameters.append(known)
    alike = kind.same_as, kind.nearly_same_as
    beside = kind.never_beside, kind.acts_on
    return Candidate(name, tuple(parameters), *alike, kind.separate_by, *beside, tuple(kind.tried_at.items()))
