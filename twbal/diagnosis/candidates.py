"""What a diagnosis may name, and what is always free."""

from collections.abc import Collection, Sequence
from math import hypot, isfinite
from typing import NamedTuple

from twbal.core.robot_model import UNBOUNDED
from twbal.diagnosis.data_sheet import DATA_SHEET, WHEELS
from twbal.diagnosis.settings import Tolerances
from twbal.planar.parameters import PlanarParameters
from twbal.sysid.model import ANGLE_LEAD, FreeParameter, LogOffset

LOWEST, HIGHEST = 0.25, 2.5
"""Range of a data-sheet value, in its nominal value. So wide that the line `beyond` of every diagnosis lies inside."""

_IMU = "imu_delay_delay"  # field of how late the IMU is, which every model may change
_PHASE = "phase"  # parameter of waves, which has no bounds
_FREQUENCY, _DAMPING = "frequency", "damping"
_COUNTERS = (_FREQUENCY, "count", "waves")
_NUDGE = 1e-7  # of finite differences, as a share of a parameter's range; a larger one bends the gradient


class CandidateParameter(NamedTuple):
    """A parameter of a candidate.

    Attributes:
        name: as the effect in the simulation calls it.
        unit: "" for a plain number.
        low: lower bound.
        high: upper bound.
        start: where its gradient is not zero.
        none: where it does nothing, or next to nothing, within the bounds.
        covers_all: whether the bounds enclose all values that a robot can have.
        form, sd: as of `effects.parameter.Parameter`.
    """

    name: str
    unit: str
    low: float
    high: float
    start: float
    none: float
    covers_all: bool = False
    form: float = 0.0
    sd: float = float("inf")

    @property
    def has_bounds(self) -> bool:
        """Whether a value at an end of the range tells of a misfit: a phase has no ends."""
        return not (self.name == _PHASE or self.covers_all)

    @property
    def is_limit(self) -> bool:
        """Whether it does nothing at its upper bound."""
        return self.none >= self.high

    def size(self, value: float) -> float:
        """What a share of a value is a share of: of a limit the value itself, of others how far from nothing it is.

        Of what has a prior it is no less than the prior's standard deviation.
        """
        found = value if self.is_limit else value - self.none
        return max(abs(found), self.sd) if isfinite(self.sd) else found


class Candidate(NamedTuple):
    """An effect that may be missing.

    Attributes:
        name: as of `effects/`.
        parameters: of the effect.
        same_as: effects that no data of this kind tell from it.
        hard_to_tell_from: effects that data of this kind hardly tell from it.
        separate_by: the experiment that would.
        never_beside: effects that no robot has beside it.
        acts_on: effects of which a set must hold one, or it does nothing; empty where it acts alone.
        tried_at: names of parameters, and values at which they are tried, all with all; empty where one start will do.
    """

    name: str
    parameters: tuple[CandidateParameter, ...]
    same_as: tuple[str, ...]
    hard_to_tell_from: tuple[str, ...]
    separate_by: str
    never_beside: tuple[str, ...] = ()
    acts_on: tuple[str, ...] = ()
    tried_at: tuple[tuple[str, tuple[float, ...]], ...] = ()

    @property
    def in_data_sheet(self) -> bool:
        """Whether it is a value of the data sheet that is off, and no effect."""
        return any(self.field(p) in DATA_SHEET for p in self.parameters)

    @property
    def is_wave(self) -> bool:
        """Whether it has a phase; without a `counter` its period is a turn of the wheels, and a force from outside."""
        return any(p.name == _PHASE for p in self.parameters)

    @property
    def counter(self) -> CandidateParameter | None:
        """Of a wave, the parameter that counts its periods, which is looked for among many values; None: one a turn."""
        return next((p for p in self.parameters if p.name in _COUNTERS), None) if self.is_wave else None

    @property
    def resonance(self) -> CandidateParameter | None:
        """Of a resonance, which has a frequency and a damping: the frequency, which is looked for among many values."""
        known = {p.name: p for p in self.parameters}
        return known[_FREQUENCY] if {_FREQUENCY, _DAMPING} <= set(known) else None

    @property
    def sizes(self) -> tuple[CandidateParameter, ...]:
        """Those of its parameters that say how large it is.

        They are the first, and others without a prior that do nothing at their low end.
        """
        more = () if self.is_wave else (p for p in self.parameters[1:] if p.none == p.low and not isfinite(p.sd))
        return (self.parameters[0], *more)

    def may_stand_beside(self, names: Collection[str]) -> bool:
        """Whether a set of these effects may hold it, too."""
        is_of_use = not self.acts_on or any(name in names for name in self.acts_on)
        return is_of_use and not any(name in names for name in self.never_beside)

    def tempered(self, temperature: float) -> "Candidate":
        """The same for a likelihood to the power of one over the temperature: with priors narrower by its root."""
        root = temperature**0.5
        return self._replace(parameters=tuple(p._replace(sd=p.sd / root) for p in self.parameters))

    def field(self, parameter: CandidateParameter) -> str:
        """The field of the planar model that a parameter is."""
        return f"{self.name}_{parameter.name}"

    @property
    def none(self) -> dict[str, float]:
        """Values with which it does nothing at all, by field: of a limit none that its range has."""
        return {self.field(p): UNBOUNDED if p.is_limit else p.none for p in self.parameters}

    @property
    def free_parameters(self) -> tuple[FreeParameter, ...]:
        """Its parameters as free values, most of them without a prior."""
        return tuple(
            FreeParameter(
                self.field(p),
                *(p.low, p.high, p.none, p.sd, _NUDGE * (p.high - p.low)),
                *(self.name, p.name, p.has_bounds),
            )
            for p in self.parameters
        )

    def given(self, planar: PlanarParameters, share: float) -> tuple[FreeParameter, ...]:
        """Its sizes in a simulation that has it already: free, with a share of each as its standard deviation.

        Factors, whose size is their distance from 1, stay as they are.
        """
        found = []
        for p in self.sizes:
            value = float(getattr(planar, self.field(p)))
            if value and p.size(value) == value:
                low, high = sorted((LOWEST * value, HIGHEST * value))
                low, high = max(low, min(p.low, value)), min(high, max(p.high, value))
                sd, nudge = share * abs(value), _NUDGE * abs(value)
                found.append(FreeParameter(self.field(p), low, high, value, sd, nudge, self.name, p.name, False))
        return tuple(found)


def log_offsets(tolerances: Tolerances, recordings: int, several_runs: bool) -> tuple[FreeParameter, ...]:
    """What may differ from recording to recording; battery and floor do not within one run."""
    sds = {"tilt": tolerances.tilt_offset}
    if several_runs:
        sds |= {"torque": tolerances.battery, "slope": tolerances.floor_slope}
    return tuple(
        FreeParameter(LogOffset(number, kind), -10 * sd, 10 * sd, 0.0, sd, 1e-5 * sd)
        for number in range(recordings)
        for kind, sd in sds.items()
        if sd
    )


def always_free(
    tolerances: Tolerances,
    planar: PlanarParameters,
    recordings: int,
    several_runs: bool = False,
    given: Sequence[Candidate] = (),
) -> tuple[FreeParameter, ...]:
    """What every model may change within tolerances.

    These are the data sheet's values, the sensors' timing, sizes of effects that the simulation has already, and
    offsets of recordings.

    Args:
        tolerances: their standard deviations.
        planar: what the simulation has for them.
        recordings: how many there are.
        several_runs: whether these are of more than one run.
        given: effects that the simulation has.
    """
    values = [(field, float(getattr(planar, field))) for field in (*DATA_SHEET, *WHEELS)]
    sheet = [
        FreeParameter(
            field,
            *(LOWEST * value, HIGHEST * value, value, tolerances.of(field) * value, _NUDGE * value),
            *(DATA_SHEET[field][:2] if field in DATA_SHEET else ()),
        )
        for field, value in values
    ]
    late, lead, delay = tolerances.imu_timing, tolerances.angle_timing, planar.imu_delay_delay
    imu_sd = hypot(late, tolerances.effects * delay)
    imu = FreeParameter(_IMU, 0.0, delay + 20 * late, delay, imu_sd, 1e-5 * late, "imu_delay", "delay")
    sizes = [free for each in given for free in each.given(planar, tolerances.effects) if free.field != _IMU]
    return (
        *sheet,
        imu,
        FreeParameter(ANGLE_LEAD, -20 * lead, 20 * lead, 0.0, lead, 1e-5 * lead),
        *sizes,
        *log_offsets(tolerances, recordings, several_runs),
    )
