"""Whether a robot did not get all commands: whether it held the one before, in some control periods."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.optimize import brentq, minimize
from scipy.special import expit, gammaln, logit
from scipy.stats import chi2

from twbal.core.gaussian import Array, Mask
from twbal.diagnosis.held_commands import HeldScores, held_scores
from twbal.diagnosis.lost_commands_record import CommandLoss
from twbal.sysid.model import Data, Model

_SEEN = 0.3  # standard deviations of the errors' change that a command must make to be asked
_FEWEST = 200  # commands that are asked, at least
_EXACT = 0.002  # share of the commands' deviation that white torques have at least: no model is truer
_CERTAIN = 12.0  # nats by which lost commands must be likelier than none
_NEIGHBOURS = 3  # commands before and after one, which show alike
_PASSES = 12  # over the commands, each with what the one before found
_STARTS = (0.003, 0.03, 0.2)  # shares from which the search begins
_LEAST_DEGREES, _DEGREES = 2.0, 10.0  # of freedom of the scatter: least, as it has a variance, and to begin with
_TOLERANCE = 1e-4  # of the search, in nats and in its variables


class LostFound(NamedTuple):
    """What was found.

    Attributes:
        record: how many commands are lost.
        lost: of each recording (T,), the commands that are more likely lost than not.
    """

    record: CommandLoss
    lost: tuple[Mask, ...]


class _Mixture(NamedTuple):
    """Lost commands among others.

    Attributes:
        share: of commands that are lost.
        bias: mean of the scores of commands that acted, over their sizes: what the model gets wrong of all commands.
        scale: of the scores' scatter, a Student t [standard deviations of a prediction error].
        degrees: of freedom of it.
    """

    share: float
    bias: float
    scale: float
    degrees: float


def lost_commands(data: Data, model: Model, known: Sequence[Mask] | None = None) -> LostFound | None:
    r"""Which commands the robot did not get; None where the errors show none.

    A lost command leaves the one before acting. By a model whose filter is known, that changes the prediction errors
    that follow by d, and so tells whether it happened: with the decorrelated errors e, the score eᵀd / |d| scatters
    about |d| if it did, and about 0 if not. The scores of all commands are a mixture of both,

        q_t ~ (1 - p) t_ν(b |d_t|, σ) + p t_ν(|d_t|, σ),

    with the share p that is lost, and what is fitted beside it: a bias b, as a model whose delay is a little off makes
    for all commands, and the scatter's own scale σ and degrees of freedom ν. Lost commands must be likelier than none
    by `_CERTAIN` nats, and by as much likelier than commands that do the very opposite: errors that are now and then
    large for another reason would show these, too. As commands follow each other, what is likely lost is taken to be
    so, and all are asked again, until nothing changes.

    Args:
        data: recordings, with the commands that were sent.
        model: predicts them.
        known: of each recording (T,), what was found by another model, to begin with; that some were lost is certain
            then.
    """
    loud = _EXACT * float(np.std(np.concatenate([recording.commands for recording in data.recordings])))
    model = model._replace(noise=model.noise._replace(torques=np.maximum(model.noise.torques, loud)))
    lost = [np.zeros(len(recording), dtype=bool) for recording in data.recordings] if known is None else [*known]
    fitted = _fitted(_joined(_asked(data, model, lost)), is_certain=known is not None)
    if fitted is None:
        return None
    asked: list[HeldScores] = []
    for _ in range(_PASSES):
        asked = _asked(data, model, lost)
        fitted = _with_losses(_joined(asked), fitted)[0]
        before, lost = lost, [_decided(those, _log_odds(fitted, each)) for those, each in zip(lost, asked, strict=True)]
        if all(np.array_equal(a, b) for a, b in zip(before, lost, strict=True)):
            break
    record = _loss(fitted, _joined(asked), sum(int(each.sum()) for each in lost))
    return LostFound(record, tuple(lost))


def _asked(data: Data, model: Model, lost: Sequence[Mask]) -> list[HeldScores]:
    """What each recording says of each of its commands, given what is taken to be lost of the others."""
    kalman = data.filter(model)
    return [held_scores(data, model, kalman, number, those) for number, those in enumerate(lost)]


def _joined(asked: Sequence[HeldScores]) -> HeldScores:
    """Of all recordings, the commands that would show."""
    sizes, scores = (np.concatenate(each) for each in zip(*asked, strict=True))
    return HeldScores(sizes[sizes > _SEEN], scores[sizes > _SEEN])


def _log_density(mixture: _Mixture, scores: Array, means: Array) -> Array:
    """Of scores, by the Student t about other means."""
    nu, scale = mixture.degrees, mixture.scale
    constant = gammaln(0.5 * (nu + 1.0)) - gammaln(0.5 * nu) - 0.5 * np.log(nu * np.pi) - np.log(scale)
    return np.asarray(constant - 0.5 * (nu + 1.0) * np.log1p(((scores - means) / scale) ** 2 / nu))


def _log_likelihood(mixture: _Mixture, asked: HeldScores, direction: float = 1.0) -> float:
    """Of all scores; with direction -1, of commands that do the opposite of being lost."""
    acted = _log_density(mixture, asked.scores, mixture.bias * asked.sizes)
    if mixture.share == 0.0:
        return float(acted.sum())
    held = _log_density(mixture, asked.scores, direction * asked.sizes)
    return float(np.logaddexp(np.log1p(-mixture.share) + acted, np.log(mixture.share) + held).sum())


def _fitted(asked: HeldScores, is_certain: bool) -> _Mixture | None:
    """The likeliest mixture with lost commands; None where none, or what is no loss, is as likely, if not certain."""
    if len(asked.sizes) < (1 if is_certain else _FEWEST):
        return None
    spread = float(np.median(np.abs(asked.scores - np.median(asked.scores))))
    none, log_none = _likeliest(asked, _Mixture(0.0, 0.0, max(1.5 * spread, 1e-6), _DEGREES), 1.0)
    found, log_found = _with_losses(asked, none)
    if is_certain:
        return found
    _, log_opposite = _with_losses(asked, none, -1.0)
    return found if log_found - max(log_none, log_opposite) > _CERTAIN else None


def _with_losses(asked: HeldScores, begin: _Mixture, direction: float = 1.0) -> tuple[_Mixture, float]:
    """The likeliest mixture with lost commands, from several shares on, and its log likelihood."""
    shares = (begin.share,) if begin.share > 0.0 else _STARTS
    return max((_likeliest(asked, begin._replace(share=share), direction) for share in shares), key=lambda f: f[1])


def _likeliest(asked: HeldScores, begin: _Mixture, direction: float) -> tuple[_Mixture, float]:
    """The likeliest mixture, and its log likelihood; with no share in the beginning, of those without lost commands."""
    has_share = begin.share > 0.0
    variables = [begin.bias, np.log(begin.scale), np.log(max(begin.degrees - _LEAST_DEGREES, _TOLERANCE))]
    found = minimize(
        lambda x: -_log_likelihood(_mixture(x, has_share), asked, direction),
        [logit(begin.share), *variables] if has_share else variables,
        method="Nelder-Mead",
        options={"xatol": _TOLERANCE, "fatol": _TOLERANCE, "maxiter": 2000},
    )
    return _mixture(found.x, has_share), -float(found.fun)


def _mixture(x: Array, has_share: bool) -> _Mixture:
    """By the variables of a search: logit of the share, bias, and logarithms of scale and degrees of freedom."""
    share = float(expit(x[0])) if has_share else 0.0
    bias, scale, degrees = (float(value) for value in x[-3:])
    return _Mixture(share, bias, float(np.exp(scale)), _LEAST_DEGREES + float(np.exp(degrees)))


def _log_odds(mixture: _Mixture, asked: HeldScores) -> Array:
    """Of each command, that it was lost, not that it acted; those that would not show count as acting."""
    acted = _log_density(mixture, asked.scores, mixture.bias * asked.sizes)
    held = _log_density(mixture, asked.scores, asked.sizes)
    return np.where(asked.sizes > _SEEN, logit(mixture.share) + held - acted, -np.inf)


def _decided(lost: Mask, log_odds: Array) -> Mask:
    """Which commands are taken to be lost next: a command changes sides if no neighbour does so with more reason.

    Neighbours show alike: if one of them was lost, both seem to be, and together they would explain too much.
    """
    reason = np.where((log_odds > 0.0) != lost, np.abs(log_odds), 0.0)
    changes = (reason > 0.0) & (reason >= maximum_filter1d(reason, 2 * _NEIGHBOURS + 1, mode="constant"))
    return np.asarray(lost ^ changes)


def _loss(mixture: _Mixture, asked: HeldScores, lost: int) -> CommandLoss:
    """The share that is lost, with the interval in which the likelihood is not less than by a 95 % test."""
    most = _log_likelihood(mixture, asked)

    def less(share: float) -> float:
        return most - _log_likelihood(mixture._replace(share=share), asked) - 0.5 * float(chi2.ppf(0.95, 1))

    share, least = mixture.share, 1e-6
    low = brentq(less, least, share) if less(least) > 0.0 else 0.0
    high = brentq(less, share, 1.0 - least) if less(1.0 - least) > 0.0 else 1.0
    return CommandLoss(share, float(low), float(high), lost, len(asked.sizes))
