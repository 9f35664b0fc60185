"""Which effects to name: forward selection, one effect after the other, as long as the data ask for more."""

from collections.abc import Sequence
from typing import NamedTuple

from twbal.diagnose.candidates import Candidate
from twbal.diagnose.model import Data, Free, Model
from twbal.diagnose.settings import Settings
from twbal.diagnose.weigh import Round, Weighed, add_one, weigh

_BASE_ROUNDS = 8


class Selection(NamedTuple):
    """How the selection went.

    Attributes:
        base: the data sheet refitted.
        rounds: what was weighed, round by round.
        chosen: the set that it ended with; `base` where nothing is worth its price.
    """

    base: Weighed
    rounds: tuple[Round, ...]
    chosen: Weighed


def select(
    data: Data, model: Model, always: Sequence[Free], candidates: Sequence[Candidate], settings: Settings
) -> Selection:
    """Add effects to the data sheet as long as they are worth their price.

    One that was chosen while another was missing may be the wrong one, so with two effects each is reconsidered with
    the other in place.

    Args:
        data: recordings.
        model: where fits begin.
        always: what is always free.
        candidates: all that may be named.
        settings: of the diagnosis.
    """
    base = weigh(data, data.with_noise(model, 30), always, (), _BASE_ROUNDS)
    rounds: list[Round] = []
    chosen = base
    while len(chosen.effects) < settings.most_effects and len(chosen.candidates) <= settings.most_effects:
        step = add_one(data, chosen, always, _beside(chosen, candidates), settings.shortlist)
        rounds.append(step)
        best = next((w for w in step.weighed if worth(w, chosen, settings)), None)
        if best is None:
            break
        chosen = best
    if len(chosen.candidates) > 1:
        step = _reconsider(data, chosen, always, candidates, settings)
        rounds.append(step)
        chosen = min([chosen, *step.weighed], key=lambda w: w.total)
    return Selection(base, tuple(rounds), chosen)


def _beside(chosen: Weighed, candidates: Sequence[Candidate]) -> list[Candidate]:
    """Candidates that a set neither holds nor has an equivalent of."""
    held = set(chosen.names)
    return [c for c in candidates if c.name not in held and not set(c.equivalents) & held]


def _reconsider(
    data: Data, chosen: Weighed, always: Sequence[Free], candidates: Sequence[Candidate], settings: Settings
) -> Round:
    """Weigh what could stand in the place of the effect that was chosen first."""
    first, *rest = chosen.candidates
    without = chosen.fit.model.put({f"{first.name}_{p.name}": p.none for p in first.parameters})
    base = weigh(data, without, always, rest, _BASE_ROUNDS)
    left = [c for c in _beside(base, candidates) if c.name != first.name]
    return add_one(data, base, always, left, max(settings.shortlist // 2, 1))


def worth(weighed: Weighed, base: Weighed, settings: Settings) -> bool:
    """Whether the data ask for the effects that one set has beyond another.

    A gain as large as this one's share of the whole cannot be chance, however coloured what is left.
    """
    gain = base.total - weighed.total
    return gain / min(weighed.colour, settings.lines.whiteness) >= settings.lines.score
