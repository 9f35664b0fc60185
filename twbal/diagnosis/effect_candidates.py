"""What the effects of the simulation tell a diagnosis."""

from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.candidates import Candidate, Parameter
from twbal.effects.effect import Effect, parameters_of
from twbal.effects.library import library

_TORQUE, _PERIOD = 20.0, 0.02  # of the robot that ranges are written for [N·m], [s]


def candidates_for(robot: RobotParameters) -> tuple[Candidate, ...]:
    """All effects that may be missing in a robot's simulation, with their ranges in its size."""
    return tuple(_candidate(name, kind, robot) for name, kind in library().items())


def _candidate(name: str, kind: type[Effect], robot: RobotParameters) -> Candidate:
    sizes = {"": 1.0, "torque": robot.torque_limit / _TORQUE, "period": robot.control_period / _PERIOD}
    parameters = []
    for key, p in parameters_of(kind).items():
        size = sizes[p.scale]
        low, high = size * p.low, size * p.high
        none = min(max(size * p.none, low), high)  # what no limit is: the far end of the range
        parameters.append(Parameter(key, p.unit, low, high, size * p.start, none))
    return Candidate(name, tuple(parameters), kind.same_as, kind.cannot_be_told_from, kind.separate_by)
