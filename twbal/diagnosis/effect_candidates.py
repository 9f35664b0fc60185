"""What the effects of the simulation tell a diagnosis."""

from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.candidates import Candidate, CandidateParameter
from twbal.effects.effect import Effect
from twbal.effects.library import library
from twbal.effects.parameter import parameters_of

_FASTEST = 0.4
"""Of frequencies, times the control period: samples hardly tell a faster one from one below half their rate."""


def candidates_for(robot: RobotParameters) -> tuple[Candidate, ...]:
    """All effects that may be missing in a robot's simulation, with their ranges in its size."""
    return tuple(_candidate(name, kind, robot) for name, kind in library().items())


def _candidate(name: str, kind: type[Effect], robot: RobotParameters) -> Candidate:
    parameters = []
    for key, p in parameters_of(kind).items():
        size = p.size(robot)
        low, high = size * p.low, size * p.high
        if p.unit == "Hz":
            high = min(high, _FASTEST / robot.control_period)
        neutral = min(max(size * p.neutral, low), high)  # what no limit is: the far end of the range
        if p.unit == "Hz":
            neutral = min(neutral, 0.99 * high)
        start = min(size * p.start, high)
        known = CandidateParameter(key, p.unit, low, high, start, neutral, p.covers_all, p.form, size * p.sd)
        parameters.append(known)
    return Candidate(name, tuple(parameters), kind.same_as, kind.nearly_same_as, kind.separate_by, kind.never_beside)
