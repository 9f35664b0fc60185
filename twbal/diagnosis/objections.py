"""What speaks against the set of effects that a selection ended with: each reason a sentence, with its numbers."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.constancy import Inconstancy
from twbal.diagnosis.data_sheet import DATA_SHEET, WHEELS
from twbal.diagnosis.hypothesis import FittedHypothesis, is_at_bound
from twbal.diagnosis.record import GIVEN_EFFECTS, Shift
from twbal.diagnosis.settings import Settings
from twbal.sysid.model import ANGLE_LEAD
from twbal.sysid.noise import NoiseModel, discrepancy_sigmas

_WHERE = {"speed": "the wheels turn fast", "time": "time has gone by", "command": "the command is large"}
_DISCREPANCY = {
    0: ("torque at the joints", "N·m"),
    1: ("torque from outside", "N·m"),
    2: ("lasting error of the tilt", "rad"),
    5: ("walking bias of the gyro", "rad/s"),
}  # its components that are no noise of sensors
_INSTANTS = (
    2000  # for which the limit of the autocorrelation is set; that of autocorrelated errors grows with their number
)
_PULLED = 1.5  # tolerances by which a set may pull a value of the data sheet without another search or settled values
_LATE = 4.0  # tolerances by which a set may have angles read before or after rates without another search


class Extent(NamedTuple):
    """How far recordings go: what a wave must have room in, to be told from a slow change.

    Attributes:
        seconds: duration of the longest one.
        metres: largest distance between two places of one.
        turns: largest angle between two places of a wheel, by the body, in turns.
        falls: duration of the longest one, in falling times of the robot (`mobility.falling_time`).
    """

    seconds: float
    metres: float
    turns: float
    falls: float = np.inf

    def along(self) -> dict[str, float]:
        """The same by the parameter of a wave that counts its periods there."""
        return {"frequency": self.seconds, "waves": self.metres, "count": self.turns}


BOUNDLESS = Extent(np.inf, np.inf, np.inf)
"""Of recordings that hold any wave."""

_FALLS = 15.0
"""Falling times that the longest recording must last. In shorter ones, such as falls, a slope, a battery that sags, a
spring and a centre of mass that is off make up for each other. One of four virtual robots that fell within that was
said to lack a slope, a spring and an eccentric wheel, which it has not; none of six that stood for longer (2026-11-28).
"""

_PERIODS = {"frequency": 2.0, "waves": 1.0, "count": 1.0}
"""How many periods of a wave a recording must hold, by the parameter that counts them: more in time, where a force may
drift, than along a way, where the same comes again when the robot does."""


class Objection(NamedTuple):
    """What speaks against a set of effects.

    Attributes:
        text: a sentence.
        effects: names of those that it speaks against; none where it speaks against the whole set.
        is_of_weights: whether it says no more than what the probabilities of sets say already.
        is_of_length: whether it says no more than that the recordings are short.
        is_of_own: whether the other effects of the set are as sure as without it.
    """

    text: str
    effects: tuple[str, ...] = ()
    is_of_weights: bool = False
    is_of_length: bool = False
    is_of_own: bool = False

    def concerns(self, effect: str) -> bool:
        """Whether it speaks against an effect of the set."""
        return not self.effects or effect in self.effects


def objections(
    chosen: FittedHypothesis,
    largest: NoiseModel,
    inconstant: Sequence[Inconstancy],
    settings: Settings,
    extent: Extent = BOUNDLESS,
) -> tuple[Objection, ...]:
    """Why a set of effects is no finding; nothing where nothing speaks against it.

    Args:
        chosen: the set; without effects, the data sheet refitted.
        largest: noise with which it was fitted: its model discrepancy is three standard deviations of the prior.
        inconstant: effects of the set that are not of one size.
        settings: of the diagnosis.
        extent: how far the recordings go.
    """
    limit = autocorrelation_limit(len(chosen.fit.white) // 4, settings)
    found = list[Objection]()
    if chosen.compared_by > limit:  # of values that a set has settled to, more remains (`graded.remaining_of`)
        said = f"The residuals stay autocorrelated: their Ljung-Box statistic is {chosen.compared_by:.3g} times "
        said += "that of white noise; "
        found.append(Objection(f"{said}the limit is {limit:.3g}."))
    if not chosen.effects:
        found += _to_a_discrepancy(chosen.fit.model.noise, largest, settings)
    swallowing, bounded = _swallowing(chosen), _bounded_values(chosen)
    found += to_bounds(chosen, {*swallowing, *bounded})
    found += _to_sizes(chosen, settings)
    found += to_slow_waves(chosen, extent)
    found += to_short_recordings(chosen, extent)
    found += [Objection(text, (name,)) for name, text in swallowing.items()]
    found += map(Objection, _to_the_data_sheet(chosen, bounded, settings))
    for effect, axis, share, _ in inconstant:
        change = f"{abs(share):.0%} {'larger' if share > 0 else 'smaller'} where {_WHERE[axis]}"
        said = f"The best guess, {spaced(effect)}, would have to be {change}: what moves the robot has another form."
        found.append(Objection(said, (effect,)))
    return tuple(found)


def to_bounds(chosen: FittedHypothesis, passed_over: Collection[str] = ()) -> Iterator[Objection]:
    """To parameters that ran to a bound, but for those of some effects and values."""
    for free in chosen.at_bound:
        if (free.effect or free.name) not in passed_over:
            value = chosen.fit.model.value(free.field)
            said = (
                f"The best guess ran to a bound of its range ({free.name}: {value:.3g}), so it is none. If the robot "
                "may have that much, put the effect into the simulation first (docs/effects.md), and diagnose again."
            )
            yield Objection(said, (free.effect,) if free.effect in chosen.names else ())


def autocorrelation_limit(instants: int, settings: Settings) -> float:
    """Autocorrelation of residuals at so many instants from which on something is left that nothing explains."""
    return 1.0 + (settings.thresholds.max_autocorrelation - 1.0) * max(instants / _INSTANTS, 1.0)


def is_doubtful(chosen: FittedHypothesis, settings: Settings) -> bool:
    """Whether a set leaves something unexplained, so that another may be better.

    Its errors stay autocorrelated, a parameter is at a bound, or a value of the data sheet that it does not name is out
    of its tolerances, as where the set of a robot that lacks other effects makes up for them. So is the time by which
    angles are read before rates, where a delay or a lag is missing.
    """
    is_late = any(
        free.field == ANGLE_LEAD and abs(chosen.fit.model.angle_lead - free.mean) > _LATE * free.sd
        for free in chosen.fit.free_parameters
    )
    return is_late or not may_be_a_finding(chosen, settings) or pulls_the_data_sheet(chosen, settings)


def may_be_a_finding(chosen: FittedHypothesis, settings: Settings) -> bool:
    """Whether a set's errors are little autocorrelated, with no parameter at a bound."""
    limit = autocorrelation_limit(len(chosen.fit.white) // 4, settings)
    return chosen.autocorrelation <= limit and not chosen.at_bound


def pulls_the_data_sheet(chosen: FittedHypothesis, settings: Settings) -> bool:
    """Whether a set needs a value of the data sheet that it does not name out of its tolerance."""
    return bool(_bounded_values(chosen) or pulled_values(chosen, settings))


def pulled_values(chosen: FittedHypothesis, settings: Settings) -> list[str]:
    """Values of the data sheet that a set needs out of their tolerances and does not name, as their effects' names."""
    shifts = shifts_of(chosen, settings)
    return [shift.name for shift in shifts if shift.name not in chosen.names and abs(shift.sigmas) > _PULLED]


def shifts_of(hypothesis: FittedHypothesis, settings: Settings) -> tuple[Shift, ...]:
    """How far the data pull values of the data sheet, and sizes of effects that are given, the largest first."""
    found, tolerances = [], settings.tolerances
    for free in hypothesis.fit.free_parameters:
        factor = hypothesis.fit.model.value(free.field) / free.mean if free.mean else 1.0
        if free.field in DATA_SHEET:
            sigmas = (factor - 1.0) / tolerances.of(free.field)
            found.append(Shift(free.effect, DATA_SHEET[free.field].group, factor, sigmas))
        elif free.mean and free.effect and free.effect not in hypothesis.names:
            sigmas = (factor - 1.0) / tolerances.effects
            found.append(Shift(f"{free.effect} {free.parameter}", GIVEN_EFFECTS, factor, sigmas))
    return tuple(sorted(found, key=lambda shift: -abs(shift.sigmas)))


def negligible(hypothesis: FittedHypothesis, settings: Settings) -> tuple[Candidate, ...]:
    """Effects of a set that are too small to be named, however sure the data are of them."""
    return tuple(
        candidate
        for candidate in hypothesis.effects
        if hypothesis.size_of(candidate) < settings.thresholds.min_effect_size
    )


def with_values(hypothesis: FittedHypothesis, candidates: Iterable[Candidate]) -> str:
    """Effects with the values of their first parameters: `torque saturation of 0.0335 N·m`."""
    found = []
    for candidate in candidates:
        size = candidate.parameters[0]
        value = hypothesis.fit.model.value(candidate.field(size))
        found.append(f"{spaced(candidate.name)} of {value:.3g} {size.unit}".rstrip())
    return ", ".join(found)


def spaced(name: str) -> str:
    """A name as it stands in a sentence."""
    return name.replace("_", " ")


def _to_a_discrepancy(noise: NoiseModel, largest: NoiseModel, settings: Settings) -> list[Objection]:
    """To "nothing is missing" where a model discrepancy, larger than that of a right model, stands for what is."""
    found, sigmas = [], discrepancy_sigmas(noise, largest)
    for i, (what, unit) in _DISCREPANCY.items():
        if sigmas[i] > settings.thresholds.max_discrepancy:
            level = noise.discrepancy[i]
            limit = settings.thresholds.max_discrepancy * level / sigmas[i]
            said = f"The data ask for a {what} of {level:.2g} {unit} that no effect explains; "
            found.append(Objection(f"{said}the limit is {limit:.2g} {unit}."))
    return found


def _to_sizes(chosen: FittedHypothesis, settings: Settings) -> list[Objection]:
    """To a set that holds nothing but trifles."""
    trifles = negligible(chosen, settings)
    if not trifles or len(trifles) < len(chosen.effects):
        return []
    least = f"less than {settings.thresholds.min_effect_size:.0%} of its usual size"
    said = f"All that the data ask for is {with_values(chosen, trifles)}: negligible, {least}."
    return [Objection(said, tuple(candidate.name for candidate in trifles))]


def to_slow_waves(chosen: FittedHypothesis, extent: Extent) -> list[Objection]:
    """To waves of which no recording holds as many periods as `_PERIODS` asks for: any slow change looks like one."""
    found = []
    for candidate in chosen.effects:
        if not candidate.is_wave:
            continue
        counter = candidate.counter
        along, number = "count", 1.0  # once in a turn of the wheel
        if counter is not None:
            along, number = counter.name, chosen.fit.model.value(candidate.field(counter))
        periods, least = extent.along()[along] * number, _PERIODS[along]
        if periods < least:
            said = f"No recording holds more than {periods:.2g} periods of the {spaced(candidate.name)}; below"
            text = f"{said} {least:g} it cannot be told from any slow change."
            found.append(Objection(text, (candidate.name,), is_of_own=True))
    return found


def to_short_recordings(chosen: FittedHypothesis, extent: Extent) -> list[Objection]:
    """To effects that were found in nothing but short recordings."""
    if not chosen.effects or extent.falls >= _FALLS:
        return []
    said = f"The longest recording lasts {extent.seconds:.2g} s, {extent.falls:.2g} times the time constant of a fall. "
    said += f"Below {_FALLS:g} times, other effects may look the same: record the robot for longer."
    return [Objection(said, is_of_length=True)]


def _swallowing(chosen: FittedHypothesis) -> dict[str, str]:
    """Objections, by effect, to effects that let next to nothing of the commands' variation pass."""
    return {
        candidate.name: f"The best guess, {with_values(chosen, [candidate])}, lets next to nothing of the commands "
        "pass: it replaces them and explains nothing."
        for candidate in chosen.effects
        if candidate.name in chosen.overriding
    }


def _to_the_data_sheet(
    chosen: FittedHypothesis, bounded: Mapping[str, tuple[float, str]], settings: Settings
) -> list[str]:
    """To given values that nothing names: at a bound of their range (`_bounded_values`), or far off."""
    found = [
        f"The best guess needs a {spaced(name)} of {factor:.2g} times the data sheet's, the {side} bound of its range: "
        "that is no finding."
        for name, (factor, side) in bounded.items()
    ]
    limit, known = settings.thresholds.max_shift, {*chosen.names, *bounded}
    far = [shift for shift in shifts_of(chosen, settings) if abs(shift.sigmas) > limit and shift.name not in known]
    found += [
        f"The best guess needs a {spaced(shift.name)} of {shift.factor:.2g} times {shift.whose}, "
        f"{abs(shift.sigmas):.0f} tolerances off: that is no finding."
        for shift in far
    ]
    given = [shift for shift in far if shift.group == GIVEN_EFFECTS]
    rough = settings.tolerances.rough
    if (bounded or len(given) < len(far)) and settings.tolerances.data_sheet < rough:
        found.append(
            f"If the data sheet may be as wrong as that (by {rough:.0%} or so), say "
            f"diagnosis.tolerances.data_sheet={rough:g}."
        )
    if given:
        found.append(
            "If what the simulation has may be as wrong as that, say by which share: diagnosis.tolerances.effects=0.5."
        )
    return found


def _bounded_values(hypothesis: FittedHypothesis) -> dict[str, tuple[float, str]]:
    """Factors of the data sheet's values that ran to a bound although a prior holds them, and which bound."""
    found = {}
    for free in hypothesis.fit.free_parameters:
        if free.field in (*DATA_SHEET, *WHEELS) and np.isfinite(free.sd):
            value = hypothesis.fit.model.value(free.field)
            if is_at_bound(free, value):
                found[free.effect or free.name] = (value / free.mean, "lower" if value < free.mean else "upper")
    return found
