"""Sets of effects as hypotheses: full fits of the most promising, with their noise refitted."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.errors import DataError
from twbal.core.gaussian import Array
from twbal.core.threads import in_threads
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.filter_starts import filter_starts, has_lasting_tilt_error
from twbal.diagnosis.grid_search import improved
from twbal.diagnosis.score_test import ScoredCandidate, score_candidates
from twbal.planar.actuation import equivalent_gain
from twbal.planar.robot_distribution import TILT_FILTER
from twbal.sysid.model import Data, FreeParameter, Model
from twbal.sysid.prediction_error_fit import Fit, refit

_ITERATIONS, _NOISE_ITERATIONS = 4, 12  # of values and of noise, in each round; fewer end in other optima
FULL_ROUNDS = 6  # of values and noise in turn, in the fit of a candidate
_CLOSE, _NEAR = 0.5, 50.0  # share of the best gain, and -2 log likelihood, within which the noise is fitted, too
_AT_BOUND = 0.01  # share of its range from a bound at which a parameter has run to it
_OF_BOUND = 0.1  # of a limit's low bound, within which it has run there
_LEAST_INFLUENCE = 0.1  # equivalent gain of the driver below which its nonlinearity takes the place of the commands
_WAVES = 200.0  # frequencies or counts among which a wave is looked for: the best of many is good by chance
_RESONANCES = 10.0  # the same of a resonance: peaks a fifth wide between 1.5 and 20 Hz
ALIKE = 0.2  # difference in -2 log likelihood below which sets fit equally well
_PROMISING = 0.2  # share of the best predicted gain from which on a candidate is fitted in full

_DIVERGES = (
    "The simulation's predictions diverge within the recordings, whatever its masses and lengths. Is it the robot's "
    "data sheet (robot=...), has sim=... a friction, a gain or a delay that cannot be, and were the logs imported "
    "without warnings?"
)


class FittedHypothesis(NamedTuple):
    """A set of effects, fitted in full.

    Attributes:
        candidates: the effects; none for the data sheet refitted.
        fit: with all that is always free.
        autocorrelations: of the errors that it leaves, in each channel that was measured; 1 is white, and infinite is
            that of predictions that diverge, as is the cost then.
        bic_penalty: of its parameters, in -2 log likelihood.
        overriding: names of effects that swallow nearly all the commands' variation (`actuation.equivalent_gain`).
        temperature: by which the log likelihood was divided for its values (`tempered.settled`).
        unsettled: autocorrelation that it left before; None where its values are those of the likelihood as it is.
    """

    candidates: tuple[Candidate, ...]
    fit: Fit
    autocorrelations: Array
    bic_penalty: float
    overriding: tuple[str, ...] = ()
    temperature: float = 1.0
    unsettled: float | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects, sorted."""
        return tuple(sorted(candidate.name for candidate in self.candidates))

    @property
    def effects(self) -> tuple[Candidate, ...]:
        """Those of its candidates that are no values of the data sheet."""
        return tuple(candidate for candidate in self.candidates if not candidate.in_data_sheet)

    @property
    def bic(self) -> float:
        """Cost and penalty."""
        return self.fit.cost + self.bic_penalty

    @property
    def autocorrelation(self) -> float:
        """Residual autocorrelation of the channels together; at least 1."""
        return max(float(np.mean(self.autocorrelations)), 1.0)

    @property
    def compared_by(self) -> float:
        """Autocorrelation by which its gain was compared with those of other sets."""
        return self.autocorrelation if self.unsettled is None else self.unsettled

    @property
    def size(self) -> float:
        """Of its last candidate, as a share of its start values."""
        return self.size_of(self.candidates[-1])

    def size_of(self, candidate: Candidate) -> float:
        """Of one of its candidates, as a share of its start values."""
        return max(
            abs(self.fit.model.value(candidate.field(p)) - p.none) / abs(p.start - p.none) for p in candidate.sizes
        )

    @property
    def at_bound(self) -> tuple[FreeParameter, ...]:
        """What is no value but where a search ended.

        Parameters that ran to a bound other than the one that is no effect, those of the data sheet and of the sensors
        among them; and the first parameters of overriding effects.
        """
        found = [free for free in self.fit.free_parameters if is_at_bound(free, self.fit.model.value(free.field))]
        overriding = [
            candidate.free_parameters[0] for candidate in self.candidates if candidate.name in self.overriding
        ]
        return tuple(dict.fromkeys([*found, *overriding]))


def is_at_bound(free: FreeParameter, value: float) -> bool:
    """Whether a free value ran to a bound; the mean of its prior is none, and not all values have bounds.

    Limits have ranges over decades: how near their low bound is, that bound says.
    """
    is_limit = free.mean == free.high
    margin = _OF_BOUND * free.low if is_limit else _AT_BOUND * (free.high - free.low)
    ends = [end for end in (free.low, free.high) if end != free.mean]
    return free.has_bounds and any(abs(value - end) < margin for end in ends)


class Round(NamedTuple):
    """A step of the selection.

    Attributes:
        base: what candidates were added to.
        scored: all candidates, with the gain that each is predicted to bring.
        hypotheses: the best of them, fitted, the likeliest first.
    """

    base: FittedHypothesis
    scored: list[ScoredCandidate]
    hypotheses: list[FittedHypothesis]


def fit_hypothesis(
    data: Data,
    model: Model,
    always: Sequence[FreeParameter],
    candidates: Sequence[Candidate],
    rounds: int,
    added: Sequence[Candidate] = (),
) -> FittedHypothesis:
    """Fit a set of effects in full.

    Args:
        data: recordings.
        model: where the fit begins.
        always: what is always free; a candidate's own parameters take the place of those of the same name.
        candidates: the set.
        rounds: of values and noise in turn.
        added: those of the set whose values may still be far off; where one of the set is tried on a grid, a simplex
            search moves them together with that one.

    Raises:
        DataError: predictions without any of the effects diverge.
    """
    own = [free for candidate in candidates for free in candidate.free_parameters]
    free_parameters = [free for free in always if free.field not in {o.field for o in own}] + own
    fit = refit(data, model, free_parameters, rounds, _ITERATIONS, _NOISE_ITERATIONS)
    if rounds and any(candidate.tried_at for candidate in candidates):
        fit = _improved(data, fit, [each for each in candidates if each.tried_at or each in added], rounds)
    kalman = data.filter(fit.model)
    errors = data.errors(fit.model, kalman)
    if not (np.isfinite(fit.cost) and all(np.isfinite(each).all() for each in errors)):
        if not candidates:
            raise DataError(_DIVERGES)
        fit, left = fit._replace(cost=np.inf), np.full(int(data.sensed.sum()), np.inf)
    else:
        left = data.autocorrelation(errors, kalman)[data.sensed]
    price = bic_penalty(candidates, data.count)
    return FittedHypothesis(tuple(candidates), fit, left, price, overriding(data, fit.model, candidates))


def _improved(data: Data, fit: Fit, effects: Sequence[Candidate], rounds: int) -> Fit:
    """The better of a fit and of one from likelier values of some effects."""
    better = improved(data, fit, effects)
    if better is None:
        return fit
    found = refit(data, better, fit.free_parameters, rounds, _ITERATIONS, _NOISE_ITERATIONS)
    return min(fit, found, key=lambda each: each.cost)


def fit_from_all(
    data: Data,
    model: Model,
    always: Sequence[FreeParameter],
    candidates: Sequence[Candidate],
    rounds: int,
    added: Sequence[Candidate],
    elsewhere: Sequence[Model] = (),
) -> FittedHypothesis:
    """As `fit_hypothesis`, of a set to which candidates were `added`: the best of fits from all that these begin at.

    Models `elsewhere` are further ones from which to begin.
    """
    begins = [model, *filter_starts(model, added, data.period), *elsewhere]
    return min((fit_hypothesis(data, each, always, candidates, rounds, added) for each in begins), key=lambda w: w.bic)


def bic_penalty(candidates: Sequence[Candidate], count: int) -> float:
    """Of the parameters of effects, in -2 log likelihood, for so many instants; a prior is a price of its own."""
    searched = sum(np.log(_WAVES) for each in candidates if each.counter)
    searched += sum(np.log(_RESONANCES) for each in candidates if each.resonance)
    parameters = sum(not np.isfinite(p.sd) for each in candidates for p in each.parameters)
    return parameters * float(np.log(count)) + 2.0 * float(searched)


def overriding(data: Data, model: Model, candidates: Sequence[Candidate]) -> tuple[str, ...]:
    """Effects without which the commands would have influence."""
    commands = np.concatenate([recording.commands for recording in data.recordings])
    left = equivalent_gain(model.planar, commands)
    if left >= _LEAST_INFLUENCE:
        return ()
    without = {c.name: model.put(c.none) for c in candidates}
    return tuple(name for name, other in without.items() if equivalent_gain(other.planar, commands) > left)


def may_hide_a_filter(data: Data, base: FittedHypothesis) -> bool:
    """Whether a lasting error of the tilt may hide the gain of a filter that makes the tilt of a gyro."""
    return bool(data.sensed[1]) and has_lasting_tilt_error(base.fit.model)


def add_one(
    data: Data,
    base: FittedHypothesis,
    always: Sequence[FreeParameter],
    candidates: Sequence[Candidate],
    shortlist: int,
    rounds: int = FULL_ROUNDS,
    filter_is_tried: bool = False,
) -> Round:
    """Fit what one more effect would bring.

    Args:
        data: recordings.
        base: the set so far.
        always: what is always free.
        candidates: that are not in it.
        shortlist: candidates that are fitted, at most.
        rounds: of the fit of each that comes close to the best (`fit_hypothesis`), and of a filter of the tilt; of the
            others the noise stays.
        filter_is_tried: whether a filter of the tilt is fitted only where it is among the most promising.
    """
    screened = score_candidates(data, base.fit, candidates)
    best = max((s.gain for s in screened), default=0.0)
    chosen = [s for s in screened[:shortlist] if s.gain > max(_PROMISING * best, 3.0)]
    if not filter_is_tried and may_hide_a_filter(data, base):
        chosen += [s for s in screened if s.candidate.name == TILT_FILTER and s not in chosen]
    light = in_threads(lambda s: fit_hypothesis(data, s.model, always, (*base.candidates, s.candidate), 0), chosen)
    elsewhere = {s.candidate.name: s.elsewhere for s in chosen}
    best = min((w.bic for w in light), default=0.0)
    close = best + max(_CLOSE * (base.bic - best), _NEAR)
    hypotheses = in_threads(
        lambda w: (
            fit_from_all(
                data, w.fit.model, always, w.candidates, rounds, w.candidates[-1:], elsewhere[w.candidates[-1].name]
            )
            if w.bic <= close or w.candidates[-1].name == TILT_FILTER
            else w
        ),
        light,
    )
    best = min((w.bic for w in hypotheses), default=0.0)
    order = [candidate.name for candidate in candidates]

    def rank(w: FittedHypothesis) -> tuple[float, int]:
        """Of what fits equally well, the first in the library goes first."""
        return (max(w.bic, best + ALIKE), order.index(w.candidates[-1].name))

    return Round(base, screened, sorted(hypotheses, key=rank))
