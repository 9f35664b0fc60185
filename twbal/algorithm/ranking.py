"""Which of several policies is the best, by what their trials show."""

from collections.abc import Iterable
from math import inf, isinf
from typing import NamedTuple

from twbal.core.evaluation import TrialVerdict

_ENOUGH = 0.8  # share of the limits of success: a policy that uses more of one is close to failing


class Shown(NamedTuple):
    """What the trials of a policy show.

    Attributes:
        share: of them that succeed.
        oscillation: of the tilt, the greatest [rad]; infinite where a trial ended early, 0 where all are too short to
            show it.
        used: greatest share of a limit of success that one of them used; infinite where one ended early.
    """

    share: float
    oscillation: float
    used: float

    def rank(self, oscillation_limit: float | None) -> tuple[float, ...]:
        """Lower is better: success first, then how far the tilt oscillates, then how close to failing it is.

        Args:
            oscillation_limit: up to which the tilt counts as still [rad]; None: how far it oscillates does not count.
        """
        oscillation = 0.0 if oscillation_limit is None else max(self.oscillation, oscillation_limit)
        return (-self.share, oscillation, max(self.used, _ENOUGH))


def shown_by(verdicts: Iterable[TrialVerdict]) -> Shown:
    """What one or more trials show."""
    found = list(verdicts)
    swings = [inf if isinf(verdict.used) else verdict.oscillation or 0.0 for verdict in found]
    share = sum(verdict.succeeded for verdict in found) / len(found)
    return Shown(share, max(swings), max(verdict.used for verdict in found))
