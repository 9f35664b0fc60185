"""Weighing sets of effects against each other: full fits of the most promising, with their noise refitted."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.gaussian import Array
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.screen import Screened, screen
from twbal.planar.actuation import equivalent_gain
from twbal.planar.parameters import dotted
from twbal.sysid.fit import Fit, refit
from twbal.sysid.model import Data, Free, Model

_ROUNDS, _ITERATIONS, _NOISE_ITERATIONS = 6, 4, 12
_AT_BOUND = 0.01  # share of its range from a bound at which a parameter has run to it
_LEAST_INFLUENCE = 0.1  # equivalent gain of the driver below which its nonlinearity takes the place of the commands
_WAVES = 200.0  # frequencies or counts among which a wave is looked for: the best of many is good by chance
ALIKE = 0.2  # difference in -2 log likelihood below which sets fit equally well
_PROMISING = 0.2  # share of the best gain at a glance from which on a candidate is fitted in full


class Weighed(NamedTuple):
    """A set of effects, fitted in full.

    Attributes:
        candidates: the effects; none for the data sheet refitted.
        fit: with all that is always free.
        whiteness: that it leaves in each channel that was measured.
        price: of its parameters, in -2 log likelihood.
        overriding: names of effects that swallow nearly all the commands' variation (`actuation.equivalent_gain`).
    """

    candidates: tuple[Candidate, ...]
    fit: Fit
    whiteness: Array
    price: float
    overriding: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects, sorted."""
        return tuple(sorted(candidate.name for candidate in self.candidates))

    @property
    def effects(self) -> tuple[Candidate, ...]:
        """Those of its candidates that are no values of the data sheet."""
        return tuple(candidate for candidate in self.candidates if not candidate.in_data_sheet)

    @property
    def total(self) -> float:
        """Cost and price."""
        return self.fit.cost + self.price

    @property
    def colour(self) -> float:
        """Whiteness of the channels together; at least 1."""
        return max(float(np.mean(self.whiteness)), 1.0)

    @property
    def size(self) -> float:
        """Of its last candidate, as a share of its start values."""
        return self.size_of(self.candidates[-1])

    def size_of(self, candidate: Candidate) -> float:
        """Of one of its candidates, as a share of its start values."""
        return max(
            abs(self.fit.model.value(f"{candidate.name}_{p.name}") - p.none) / abs(p.start - p.none)
            for p in candidate.sizes
        )

    @property
    def stuck(self) -> tuple[str, ...]:
        """What is no value but where a search ended, as `effect.parameter`.

        Parameters that ran to a bound other than the one that is no effect, those of the data sheet and of the sensors
        among them; and the first parameters of overriding effects.
        """
        found = [dotted(free.field) for free in self.fit.frees if at_bound(free, self.fit.model.value(free.field))]
        swallowing = [f"{c.name}.{c.parameters[0].name}" for c in self.candidates if c.name in self.overriding]
        return tuple(dict.fromkeys([*found, *swallowing]))


def at_bound(free: Free, value: float) -> bool:
    """Whether a free value ran to a bound; the mean of its prior is none, and a phase has none."""
    margin = _AT_BOUND * (free.high - free.low)
    ends = [end for end in (free.low, free.high) if end != free.mean]
    return not free.field.endswith("_phase") and any(abs(value - end) < margin for end in ends)


class Round(NamedTuple):
    """A step of the selection.

    Attributes:
        base: what candidates were added to.
        screened: all candidates at a glance.
        weighed: the best of them in full, the likeliest first.
    """

    base: Weighed
    screened: list[Screened]
    weighed: list[Weighed]


def weigh(data: Data, model: Model, always: Sequence[Free], candidates: Sequence[Candidate], rounds: int) -> Weighed:
    """Fit a set of effects in full.

    Args:
        data: recordings.
        model: where the fit begins.
        always: what is always free; a candidate's own parameters take the place of those of the same name.
        candidates: the set.
        rounds: of values and noise in turn.
    """
    own = [free for candidate in candidates for free in candidate.frees]
    frees = [free for free in always if free.field not in {o.field for o in own}] + own
    fit = refit(data, model, frees, rounds, _ITERATIONS, _NOISE_ITERATIONS)
    kalman = data.filter(fit.model)
    left = data.colour(data.errors(fit.model, kalman), kalman)[data.sensed]
    searched = 2.0 * sum(candidate.is_wave for candidate in candidates) * np.log(_WAVES)
    price = len(own) * float(np.log(data.count)) + float(searched)
    return Weighed(tuple(candidates), fit, left, price, overriding(data, fit.model, candidates))


def overriding(data: Data, model: Model, candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """Effects without which the commands would have influence."""
    commands = np.concatenate([recording.commands for recording in data.recordings])
    left = equivalent_gain(model.twin, commands)
    if left >= _LEAST_INFLUENCE:
        return ()
    without = {c.name: model.put({f"{c.name}_{p.name}": p.none for p in c.parameters}) for c in candidates}
    return tuple(name for name, other in without.items() if equivalent_gain(other.twin, commands) > left)


def add_one(
    data: Data, base: Weighed, always: Sequence[Free], candidates: Sequence[Candidate], shortlist: int
) -> Round:
    """Weigh what one more effect would bring.

    Args:
        data: recordings.
        base: the set so far.
        always: what is always free.
        candidates: that are not in it.
        shortlist: candidates that are fitted in full, at most.
    """
    screened = screen(data, base.fit, candidates)
    best = max((s.gain for s in screened), default=0.0)
    chosen = [s for s in screened[:shortlist] if s.gain > max(_PROMISING * best, 3.0)]
    weighed = [weigh(data, s.model, always, (*base.candidates, s.candidate), _ROUNDS) for s in chosen]
    best = min((w.total for w in weighed), default=0.0)
    order = [candidate.name for candidate in candidates]

    def rank(w: Weighed) -> tuple[float, int]:
        """Of what fits equally well, the first in the library goes first."""
        return (max(w.total, best + ALIKE), order.index(w.candidates[-1].name))

    return Round(base, screened, sorted(weighed, key=rank))
