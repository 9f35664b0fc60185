"""The search for the hyper-parameters of SE GPs, with the care that keeps such fits from going wrong.

By hand, as the closed form of the evidence (`Evidence`) is several times faster than GPyTorch's automatic
differentiation, and the same seed gives the same bits. Other kernels are fitted by GPyTorch (`models.kernels`).
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from twbal.core.copies import may_be_copied, shared
from twbal.core.gaussian import Array
from twbal.core.streams import Stream, generator
from twbal.core.threads import in_threads
from twbal.models.evidence import Evidence
from twbal.models.fit_objective import FitObjective, Minimum
from twbal.models.fit_settings import (
    START_NOISE,
    FitSettings,
    PriorReference,
    changing,
    check_samples,
    reference_of,
)

Integers = NDArray[np.int64]
Begin = TypeVar("Begin")

_SAME = 0.02  # ends of searches that are closer than that, in each of their logarithms, are one optimum


class Hyperparameters(NamedTuple):
    """Of E GPs.

    Attributes:
        length_scales: (E, d).
        signal_variance: (E,).
        noise_variance: (E,).
    """

    length_scales: Array
    signal_variance: Array
    noise_variance: Array

    def theta(self, output: int) -> Array:
        """One output's coordinates in `Evidence`, (d + 2,)."""
        noise = self.noise_variance[output]
        ratio = self.signal_variance[output] / noise
        return np.concatenate([np.log(self.length_scales[output]), 0.5 * np.log([ratio, noise])])

    @classmethod
    def from_thetas(cls, thetas: Array) -> Self:
        """From the coordinates of E outputs, (E, d + 2)."""
        noise = np.exp(2.0 * thetas[:, -1])
        return cls(np.exp(thetas[:, :-2]), noise * np.exp(2.0 * thetas[:, -2]), noise)


def fit_hyperparameters(
    inputs: Array,
    targets: Array,
    settings: FitSettings,
    seed: int,
    reference: PriorReference | None = None,
    near: Hyperparameters | None = None,
) -> Hyperparameters:
    """Hyper-parameters that maximise the evidence, less penalties and, where given, with priors.

    Args:
        inputs: (n, d), in any units.
        targets: (n, E).
        settings: how to search.
        seed: of the perturbed starts and of the samples that they compete on.
        reference: what the priors are relative to; None means std(X) and std(y)/10.
        near: of much the same samples. They and the usual first start are searched from, instead of all starts.

    Raises:
        FitError: too few samples, shapes that do not fit, a value that is not finite.
    """
    check_samples(inputs, targets)
    rng = generator(Stream.FIT_RESTARTS, seed)
    searches = [
        _Search.drawn(objective, inputs, target, settings, rng)
        for objective, target in zip(objectives(inputs, targets, settings, reference), targets.T, strict=True)
    ]
    if near is not None:
        searches = [search.beginning_at(near.theta(a)) for a, search in enumerate(searches)]
    are_short = not any(search.apart for search in searches)  # then few samples compete, or there are few
    begun = _beside_each_other(_Search.begun, [(search, search.numbers) for search in searches], are_short)
    finalists = [search.finalists(found) for search, found in zip(searches, begun, strict=True)]
    ended = _beside_each_other(_Search.finished, list(zip(searches, finalists, strict=True)))
    best = [search.best(last or first) for search, first, last in zip(searches, begun, ended, strict=True)]
    return Hyperparameters.from_thetas(np.array(best))


def objectives(
    inputs: Array, targets: Array, settings: FitSettings, reference: PriorReference | None
) -> list[FitObjective]:
    """One objective an output, for inputs (n, d) and targets (n, E)."""
    return [
        FitObjective(inputs, target, settings, length_scales, float(noise_sd))
        for target, length_scales, noise_sd in zip(
            targets.T, *(reference or reference_of(inputs, targets)), strict=True
        )
    ]


class _Search(NamedTuple):
    """The searches of one output, with all that is random in them drawn.

    Attributes:
        objective: what they minimise.
        inputs: (n, d).
        target: (n,).
        starts: (S, d + 2), in the coordinates of the objective.
        choices: of samples: the one that all starts compete on, or one for each start; none where the target is 0.
        apart: whether there is one for each start.
        settings: how to search.
    """

    objective: FitObjective
    inputs: Array
    target: Array
    starts: Array
    choices: list[Integers]
    apart: bool
    settings: FitSettings

    @classmethod
    def drawn(
        cls, objective: FitObjective, inputs: Array, target: Array, settings: FitSettings, rng: np.random.Generator
    ) -> Self:
        """Starts about one that is a good guess."""
        n, d = inputs.shape
        start = np.append(np.zeros(d), np.log([1.0 / START_NOISE, START_NOISE]))
        moving = np.append(changing(inputs), [True, True])  # the data say nothing about the other inputs
        apart = n > settings.screening_points and settings.own_choices > 0
        count = settings.own_choices if apart else settings.starts
        away = settings.perturbation * rng.standard_normal((count, d + 2)) * moving
        choices = [rng.permutation(n)[: settings.screening_points]]
        starts = np.vstack([start, start + away[1:]])
        if not target.any():
            choices = []
        elif apart:
            choices += [rng.permutation(n)[: len(choices[0])] for _ in starts[1:]]
        return cls(objective, inputs, target, starts, choices, apart, settings)

    def beginning_at(self, theta: Array) -> Self:
        """The same, but searched from two starts: a point, in the coordinates of `Evidence`, and the good guess."""
        starts = np.vstack([theta - self.objective.origin, self.starts[0]])
        return self._replace(starts=starts, choices=self.choices[:1], apart=False)

    @property
    def numbers(self) -> Sequence[int]:
        """Of the starts that are searched from; none where the target is 0."""
        return range(len(self.starts)) if self.choices else ()

    def begun(self, number: int) -> Minimum:
        """Where the search from one start ends: of starts that compete on a choice of samples, on that choice."""
        if self.apart:
            return self._on_own_choice(number)
        if not self._are_screened:
            all_samples = Evidence(self.inputs, self.target)
            return self.objective.minimise(all_samples, self.starts[number], self.settings.iterations)
        return self.objective.minimise(self._chosen(0), self.starts[number], self.settings.iterations)

    def finalists(self, begun: Sequence[Minimum]) -> list[Array]:
        """Of the starts that competed on a choice of samples, the ends of the best, (d + 2,): they go on on all.

        Most starts end at the same optimum, from which one goes on.
        """
        if not begun or self.apart or not self._are_screened:
            return []
        ends = [minimum.theta for minimum in sorted(begun, key=lambda minimum: minimum.value)]
        new = [end for i, end in enumerate(ends) if all(np.abs(end - other).max() > _SAME for other in ends[:i])]
        return new[: self.settings.finalists]

    def finished(self, start: Array) -> Minimum:
        """Where a search on all samples ends that begins at the end of one on the common choice of samples."""
        return self._polished(start, 0)

    def best(self, results: Sequence[Minimum]) -> Array:
        """Where the best search ended, (d + 2,), in the coordinates of `Evidence`; the first start where none was."""
        found = min(results, key=lambda minimum: minimum.value).theta if results else self.starts[0]
        return np.asarray(found + self.objective.origin)

    @property
    def _are_screened(self) -> bool:
        return len(self.choices[0]) < len(self.target)

    def _chosen(self, choice: int) -> Evidence:
        chosen = self.choices[choice]
        return Evidence(self.inputs[chosen], self.target[chosen])

    def _on_own_choice(self, number: int) -> Minimum:
        """A search that begins on a start's own choice of samples and ends on all."""
        near = self.objective.minimise(self._chosen(number), self.starts[number], self.settings.iterations)
        return self._polished(near.theta, number)

    def _polished(self, near: Array, choice: int) -> Minimum:
        """Where a search on all samples ends that begins at an optimum on some of them.

        That is near one on all of them, and has its curvature but for the number of samples.
        """
        curvature = self.objective.curvature(self._chosen(choice), near)
        scaled = curvature * (len(self.target) / len(self.choices[choice]))
        all_samples = Evidence(self.inputs, self.target)
        return self.objective.polish(all_samples, near, scaled, self.settings.iterations)


def _beside_each_other(
    work: Callable[[_Search, Begin], Minimum],
    tasks: Sequence[tuple[_Search, Sequence[Begin]]],
    are_short: bool = False,
) -> list[list[Minimum]]:
    """What comes of each beginning of each search, in order; all of them share the cores.

    Of evidences of few samples many calls hold Python's lock, for which threads would wait: a copy of this process has
    its own.
    """
    calls = [partial(work, search, each) for search, begins in tasks for each in begins]
    found = iter(shared(calls) if are_short and may_be_copied() else in_threads(lambda call: call(), calls))
    return [[next(found) for _ in begins] for _, begins in tasks]
