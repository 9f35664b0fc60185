"""Whether what was predicted of hidden robots was borne out: costs, bands, and probabilities of success.

    python -m benchmarks.hidden_robots.prediction [families=hard,moderate,regbot,balboa,esp32] [recipe=default]

Reads benchmarks/results/hidden_robots_<family>.json as `python -m benchmarks.hidden_robots` left them, and prints the
tables of docs/benchmarks.md. What a result of an older version does not note is not counted.
"""

import json
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from benchmarks.hidden_robots.families import FAMILIES
from benchmarks.hidden_robots.tables import successes
from benchmarks.settings import text_settings

RESULTS = Path("benchmarks/results")
DEFAULTS = {"families": "hard,moderate,regbot,balboa,esp32", "recipe": "default"}
COSTS = (0.8, 1.25)
"""Predicted over real cost, for a prediction that holds."""
COVERAGES = (0.85, 0.99)
CRPS_RATIO = 2.0
"""Over that of the trials' own spread, at most, for a band that is sharp."""
CONFIDENT = 0.9
"""Probability above which a policy is expected to succeed."""
BINS = 10
_RECALIBRATED = "new model"  # the reason of an iteration in which nothing is decided (`twbal.algorithm.summary.Reason`)

Record = Mapping[str, Any]


class Forecast(NamedTuple):
    """A probability of success that a search gave a policy, and the trials that followed.

    Attributes:
        probability: that a trial succeeds.
        successes: trials that did.
        trials: one at least.
    """

    probability: float
    successes: int
    trials: int


class Share(NamedTuple):
    """How many of those of whom it is known."""

    number: int
    of: int

    @property
    def words(self) -> str:
        """As in a table."""
        return f"{self.number} of {self.of} ({self.number / self.of:.0%})" if self.of else "-"


class Reliability(NamedTuple):
    """How probabilities and trials agree (Brier, Verification of forecasts expressed in terms of probability, 1950).

    Attributes:
        policies: that were driven, each as often as it was decided for.
        brier: mean squared difference of probability and outcome, over all trials.
        brier_of_share: the same of a forecaster who always gives the share of all trials that succeed.
        refuted: of the policies given more than `CONFIDENT`, those that fail more than half of their trials.
    """

    policies: int
    brier: float
    brier_of_share: float
    refuted: Share

    @property
    def improvement(self) -> float | None:
        """By how much the score is below that of the overall share, as a share of that; None where that is 0."""
        return 1.0 - self.brier / self.brier_of_share if self.brier_of_share else None


class Bin(NamedTuple):
    """A point of the reliability diagram.

    Attributes:
        low, high: probabilities, the higher included only in the last bin.
        policies: that were given one of them.
        expected: mean probability, each trial counting once.
        real: share of their trials that succeed.
    """

    low: float
    high: float
    policies: int
    expected: float
    real: float


def forecasts(robots: Iterable[Record]) -> list[Forecast]:
    """Of all decisions for a policy that was then driven in trials.

    An iteration that has the policy before, for which only the model is new, decides nothing, and is left out.
    """
    return [
        Forecast(step["success_probability"], successes(step, "default"), len(step["trials"]))
        for robot in robots
        for step in robot["iterations"]
        if step.get("success_probability") is not None and step["trials"] and step.get("reason") != _RECALIBRATED
    ]


def reliability(found: Sequence[Forecast]) -> Reliability | None:
    """Of forecasts; None without any."""
    if not found:
        return None
    trials, successes = sum(f.trials for f in found), sum(f.successes for f in found)
    squares = sum(f.successes * (1.0 - f.probability) ** 2 + (f.trials - f.successes) * f.probability**2 for f in found)
    share = successes / trials
    confident = [f for f in found if f.probability > CONFIDENT]
    refuted = Share(sum(2 * f.successes < f.trials for f in confident), len(confident))
    return Reliability(len(found), squares / trials, share * (1.0 - share), refuted)


def brier_of_knowing_more(families: Iterable[Record]) -> float | None:
    """The Brier score of a forecaster who knows what no forecaster can.

    He gives each policy 0 the share of trials in which those of the same data sheet succeed, and each later policy the
    share of its own trials. Before a robot drives, nothing tells it from the others of its sheet. So over many robots
    no forecaster is better at policies 0. None without a forecast.
    """
    first, later = dict[str, list[Forecast]](), list[Forecast]()
    for family in families:
        for robot in family["robots"]:
            for step in robot["iterations"]:
                of_one_sheet = first.setdefault(FAMILIES[family["family"]].sheet, [])
                (later if step.get("index") else of_one_sheet).extend(forecasts([{"iterations": [step]}]))
    trials = sum(f.trials for f in (*later, *(f for these in first.values() for f in these)))
    if not trials:
        return None
    squares = 0.0
    for known in (*first.values(), *([f] for f in later)):
        of, successes = sum(f.trials for f in known), sum(f.successes for f in known)
        squares += successes * (1.0 - successes / of) if of else 0.0
    return squares / trials


def diagram(found: Sequence[Forecast]) -> list[Bin]:
    """The reliability diagram: tenths of the probability in which there are policies."""
    bins = []
    for i in range(BINS):
        within = [f for f in found if min(int(BINS * f.probability), BINS - 1) == i]
        if within:
            trials = sum(f.trials for f in within)
            expected = sum(f.trials * f.probability for f in within) / trials
            real = sum(f.successes for f in within) / trials
            bins.append(Bin(i / BINS, (i + 1) / BINS, len(within), expected, real))
    return bins


def cost_ratios(steps: Iterable[Record]) -> list[float]:
    """Predicted over real cost of those iterations of which both are known."""
    return [
        step["predicted_cost"] / step["real_cost"]
        for step in steps
        if step.get("predicted_cost") is not None and step.get("real_cost")
    ]


def last_steps(robots: Iterable[Record]) -> list[Record]:
    """The last iteration of each robot."""
    return [robot["iterations"][-1] for robot in robots]


def earlier_steps(robots: Iterable[Record]) -> list[Record]:
    """All iterations but the last of each robot."""
    return [step for robot in robots for step in robot["iterations"][:-1]]


def costs_hold(steps: Iterable[Record]) -> Share:
    """Iterations whose real cost is about the predicted one."""
    ratios = cost_ratios(steps)
    return Share(sum(_within(ratio, COSTS) for ratio in ratios), len(ratios))


def bands_hold(steps: Iterable[Record]) -> Share:
    """Iterations whose bands cover what they should, and are sharp."""
    known = [s for s in steps if s.get("coverage95") is not None and s.get("crps_ratio") is not None]
    good = [s for s in known if _within(s["coverage95"], COVERAGES) and s["crps_ratio"] <= CRPS_RATIO]
    return Share(len(good), len(known))


def figures(families: Sequence[Record]) -> dict[str, str]:
    """Each figure of the robots of some families, in words."""
    robots = [robot for family in families for robot in family["robots"]]
    last, earlier, found = last_steps(robots), earlier_steps(robots), reliability(forecasts(robots))
    least = brier_of_knowing_more(families)
    return {
        "robots": str(len(robots)),
        "last predicted over real cost 0.8-1.25": costs_hold(last).words,
        "its lowest, median, highest": _spread(cost_ratios(last)),
        "earlier iterations with 0.8-1.25": costs_hold(earlier).words,
        "last coverage 0.85-0.99, CRPS at most 2 × that of the trials": bands_hold(last).words,
        "last CRPS over that of the trials: lowest, median, highest": _spread(_known(last, "crps_ratio")),
        "earlier iterations with such bands": bands_hold(earlier).words,
        "policies driven, with a probability of success": str(found.policies) if found else "-",
        "Brier score": _number(found, lambda r: f"{r.brier:.3f}"),
        "the same of always giving the overall share": _number(found, lambda r: f"{r.brier_of_share:.3f}"),
        "the same of knowing each sheet's share at policy 0, and all later outcomes": _known_number(least),
        "below that of the overall share by": _number(
            found, lambda r: "-" if r.improvement is None else f"{r.improvement:.0%}"
        ),
        "given over 0.9, and failing in more than half of the trials": _number(found, lambda r: r.refuted.words),
    }


def prediction_table(families: Sequence[Record]) -> list[str]:
    """One line a figure, a column for each family and, last, for all."""
    columns = {family["family"]: figures([family]) for family in families}
    columns["all"] = figures(families)
    lines = [f"| figure | {' | '.join(columns)} |", "|" + "---|" * (len(columns) + 1)]
    return [*lines, *(f"| {n} | {' | '.join(c[n] for c in columns.values())} |" for n in columns["all"])]


def reliability_table(families: Sequence[Record]) -> list[str]:
    """The reliability diagram of all families together, one line a bin."""
    points = diagram(forecasts(robot for family in families for robot in family["robots"]))
    if not points:
        return ["Not measured yet."]
    lines = ["| probability given | policies | mean of it | trials that succeed |", "|---|---|---|---|"]
    return [*lines, *(f"| {p.low:.1f}-{p.high:.1f} | {p.policies} | {p.expected:.2f} | {p.real:.2f} |" for p in points)]


def read(families: Iterable[str], recipe: str, folder: Path = RESULTS) -> list[Record]:
    """The results that are there."""
    suffix = "" if recipe == "default" else f"_{recipe}"
    files = [folder / f"hidden_robots_{family}{suffix}.json" for family in families]
    return [json.loads(file.read_text()) for file in files if file.exists()]


def _within(value: float, limits: tuple[float, float]) -> bool:
    return limits[0] <= value <= limits[1]


def _known(steps: Iterable[Record], name: str) -> list[float]:
    return [step[name] for step in steps if step.get(name) is not None]


def _spread(values: Sequence[float]) -> str:
    return f"{min(values):.2f}, {median(values):.2f}, {max(values):.2f}" if values else "-"


def _known_number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def _number(found: Reliability | None, words: Callable[[Reliability], str]) -> str:
    return "-" if found is None else words(found)


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    settings = text_settings(DEFAULTS, words)
    found = read(settings["families"].split(","), settings["recipe"])
    if not found:
        raise SystemExit(f"No results of {settings['families']} ({settings['recipe']}) in {RESULTS}.\n{__doc__}")
    print("\n".join([*prediction_table(found), "", *reliability_table(found)]))


if __name__ == "__main__":
    main(sys.argv[1:])
