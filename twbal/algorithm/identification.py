"""What real rollouts tell of the parameters of a robot, and the simulation that has these parameters."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from twbal.core.episode import Episode
from twbal.core.errors import DataError
from twbal.core.robot_parameters import RobotParameters
from twbal.core.text import aligned
from twbal.effects.library import effect_name
from twbal.effects.parameter import parameters_of
from twbal.planar.parameters import field_of, planar_parameters
from twbal.planar.robot_distribution import RobotDistribution, prior_of
from twbal.sysid.posterior import posterior

EffectValues = dict[str, dict[str, float]]
"""By the names of effects and of their parameters."""
_FAR = 4.0  # standard deviations of what was known before, beyond which an estimate contradicts it
_FILTER = "1 / time constant of the tilt's filter"
_AT_BOUND = 1e-3  # share of a range from its end within which an estimate stands at a bound


@dataclass(frozen=True)
class Identification:
    """What is known of a robot after rollouts.

    Attributes:
        prior: by its sheet and simulation.
        known: by the rollouts too; the prior where they tell nothing.
        simulated: effects of the simulation that the prior is about.
        why_uninformative: why they tell nothing; "" where they do.
    """

    prior: RobotDistribution
    known: RobotDistribution
    simulated: EffectValues
    why_uninformative: str = ""

    @property
    def effects(self) -> EffectValues:
        """Those of the simulated robot that has the mean of the parameters; others as simulation and sheet say."""
        known = self.known
        mean = dict(zip(known.fields, known.mean.tolist(), strict=True))
        planar = planar_parameters(known.robot, {})._replace(**mean)
        found: EffectValues = dict(self.simulated)
        for own in planar.effects:
            name = effect_name(own.kind)
            values = dict(zip(own.values._fields, planar[own.first : own.end], strict=True))  # type: ignore[attr-defined]
            if any(field_of(name, parameter) in mean for parameter in values):
                found[name] = {parameter: float(value) for parameter, value in values.items()}
        return found

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Parameters whose estimate stands at a bound of its range; 0 is none, as friction and delay begin there."""
        known = self.known
        bounds = np.stack([known.low, known.high])
        near = _AT_BOUND * (known.high - known.low)  # a fit may end a little before a bound that it ran to
        is_there = ((np.abs(known.mean - bounds) <= near) & (bounds != 0.0)).any(axis=0)
        return tuple(name for name, there in zip(_names_and_units(known)[0], is_there, strict=True) if there)

    @property
    def far_off(self) -> tuple[str, ...]:
        """Parameters whose estimate is far from what was known of them before, but not at a bound."""
        names, _ = _names_and_units(self.known)
        moved = (self.known.mean - self.prior.mean) / np.sqrt(self.prior.covariance.diagonal())
        (rate, _), (before, sd) = self.known.filter_rate, self.prior.filter_rate
        found = [*zip(names, moved, strict=True), (_FILTER, (rate - before) / sd)]
        return tuple(name for name, by in found if abs(by) > _FAR and name not in self.at_bound)

    def table(self) -> list[str]:
        """Lines that say each parameter's name, unit, and mean ± standard deviation before and after the rollouts.

        The last column says by how many standard deviations, of those before, the mean has moved, and whether it stands
        at a bound of its range: then it is no estimate.
        """
        first = "by sheet and simulation" if self.simulated else "by the sheet"
        names, units = _names_and_units(self.known)
        names, units = [*names, _FILTER], [*units, "1/s"]
        before = [*_spreads(self.prior), self.prior.filter_rate]
        after = [*_spreads(self.known), self.known.filter_rate]
        rows = [("parameter", "unit", first, "by the rollouts", "moved [sd]")]
        for name, unit, (mean, sd), (mean_after, sd_after) in zip(names, units, before, after, strict=True):
            moved = f"{(mean_after - mean) / sd:+.1f}{', at its bound' if name in self.at_bound else ''}"
            rows.append((name, unit, _spread(mean, sd), _spread(mean_after, sd_after), moved))
        return aligned(rows)


def identify(
    robot: RobotParameters, simulated: EffectValues, episodes: Sequence[Episode], progress: Callable[[str], None]
) -> Identification:
    """The posterior of a robot's parameters after rollouts; the prior where they tell nothing.

    Args:
        robot: its sheet.
        simulated: effects of the simulation that the prior is about.
        episodes: real rollouts of it, in which it must not turn much.
        progress: is told what came of it, a line at a time.
    """
    prior = prior_of(robot, simulated)
    try:
        known = posterior(prior, episodes)
    except DataError as error:
        progress(f"nothing was estimated, all values are those of the sheet: {error}")
        return Identification(prior, prior, simulated, str(error))
    progress(f"estimated from the rollouts: {known}")
    return Identification(prior, known, simulated)


def _names_and_units(known: RobotDistribution) -> tuple[list[str], list[str]]:
    """Of the parameters, in the order of the fields."""
    found = {
        field_of(effect_name(own.kind), name): (
            f"{effect_name(own.kind)}.{name}",
            (parameter.unit or "1") + " a wheel" * parameter.is_of_each_wheel,
        )
        for own in planar_parameters(known.robot, {}).effects
        for name, parameter in parameters_of(own.kind).items()
    }
    return [found[field][0] for field in known.fields], [found[field][1] for field in known.fields]


def _spreads(known: RobotDistribution) -> list[tuple[float, float]]:
    return list(zip(known.mean.tolist(), np.sqrt(known.covariance.diagonal()).tolist(), strict=True))


def _spread(mean: float, sd: float) -> str:
    return f"{mean:.4g} ± {sd:.2g}"
