"""Whether a robot did not get all commands: whether it held the one before, in some control periods."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.optimize import minimize
from scipy.special import betaincinv, betaln, expit, logit, stdtrit

from twbal.core.gaussian import Array, Mask
from twbal.diagnosis.held_commands import HeldScores, SentCommands, held_scores, sent_commands, with_several_lost
from twbal.diagnosis.side_findings import CommandLoss
from twbal.sysid.model import Data, Model

_SEEN = 0.3  # standard deviations of the errors' change that a command must make to be asked
_FEWEST = 200  # commands that are asked, at least
_EXACT = 0.002  # share of the commands' deviation that white torques have at least: no model is truer
_CERTAIN = 12.0  # nats by which lost commands must be likelier than none
_NEIGHBOURS = 3  # commands before and after one, which show alike
_PASSES = 12  # over the commands, each with what the one before found
_STARTS = (0.003, 0.03, 0.2)  # shares from which the search begins
_RANGE, _DEGREES = (2.0, 200.0), 10.0  # of freedom of the scatter: least, as it has a variance, and most; at first
_LEAST_SHARE = 1e-6  # of commands that are lost
_TIMES = 2  # that single commands are asked, and then several at once
_TOLERANCE = 1e-4  # of the search, in nats and in its variables


class LostFound(NamedTuple):
    """What was found.

    Attributes:
        record: how many commands are lost.
        lost: of each recording (T,), the commands that are more likely lost than not.
        mixture: of all commands.
    """

    record: CommandLoss
    lost: tuple[Mask, ...]
    mixture: "Mixture"


class Mixture(NamedTuple):
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
        known: of each recording (T,), what was found by another model, to begin with.
    """
    commands = _sent(data, model)
    lost = [np.zeros(len(recording), dtype=bool) for recording in data.recordings] if known is None else [*known]
    fitted = _found(_joined(_asked(commands, lost)))
    if fitted is None:
        return None
    free = [np.ones(len(those), dtype=bool) for those in lost]
    for _ in range(_TIMES):
        fitted, lost = _settled(commands, lost, free, fitted, is_fixed=False)
        lost = _several(commands, lost, free, fitted)
    asked = _asked(commands, lost)
    loss = _loss(fitted, asked, lost)
    return None if loss is None else LostFound(loss, tuple(lost), fitted)


def lost_by(
    mixture: Mixture, data: Data, model: Model, known: Sequence[Mask], may_change: Sequence[Mask]
) -> tuple[Mask, ...]:
    """Which commands of other recordings are lost, by the mixture that was found.

    Args:
        mixture: that was found.
        data: the other recordings, with the commands that were sent.
        model: predicts them.
        known: of each recording (T,), what is taken to be lost to begin with.
        may_change: of each recording (T,), of which commands that is asked.
    """
    commands, lost = _sent(data, model), list(known)
    for _ in range(_TIMES):
        _, lost = _settled(commands, lost, may_change, mixture, is_fixed=True)
        lost = _several(commands, lost, may_change, mixture)
    return tuple(lost)


def _sent(data: Data, model: Model) -> list[SentCommands]:
    """The recordings, and a model that is no truer than can be."""
    loud = _EXACT * float(np.std(np.concatenate([recording.commands for recording in data.recordings])))
    noise = model.noise._replace(torques=np.maximum(model.noise.torques, loud))
    return sent_commands(data, model._replace(noise=noise))


def _asked(commands: Sequence[SentCommands], lost: Sequence[Mask]) -> list[HeldScores]:
    """What each recording says of each of its commands, given what is taken to be lost of the others."""
    return [held_scores(one, those) for one, those in zip(commands, lost, strict=True)]


def _several(
    commands: Sequence[SentCommands], lost: Sequence[Mask], may_change: Sequence[Mask], fitted: Mixture
) -> list[Mask]:
    """What is lost, after several neighbours were asked at once."""
    odds = float(logit(fitted.share))
    return [
        with_several_lost(one, those, free, odds) for one, those, free in zip(commands, lost, may_change, strict=True)
    ]


def _settled(
    commands: Sequence[SentCommands],
    lost: list[Mask],
    may_change: Sequence[Mask],
    fitted: Mixture,
    is_fixed: bool,
) -> tuple[Mixture, list[Mask]]:
    """Ask all commands again and again, until the answers stay; with a fixed mixture, or one that is fitted again."""
    for _ in range(_PASSES):
        asked = _asked(commands, lost)
        if not is_fixed:
            fitted = _with_losses(_joined(asked), fitted)[0]
        before = lost
        lost = [
            _decided(those, np.where(free, _log_odds(fitted, each), 0.0))
            for those, free, each in zip(before, may_change, asked, strict=True)
        ]
        if all(np.array_equal(a, b) for a, b in zip(before, lost, strict=True)):
            break
    return fitted, lost


def _joined(asked: Sequence[HeldScores]) -> HeldScores:
    """Of all recordings, the commands that would show."""
    sizes, scores = (np.concatenate(each) for each in zip(*asked, strict=True))
    return HeldScores(sizes[sizes > _SEEN], scores[sizes > _SEEN])


def _log_density(mixture: Mixture, scores: Array, means: Array) -> Array:
    """Of scores, by the Student t about other means."""
    nu, scale = mixture.degrees, mixture.scale
    constant = -betaln(0.5 * nu, 0.5) - 0.5 * np.log(nu) - np.log(scale)
    return np.asarray(constant - 0.5 * (nu + 1.0) * np.log1p(((scores - means) / scale) ** 2 / nu))


def _log_likelihood(mixture: Mixture, asked: HeldScores, direction: float = 1.0) -> float:
    """Of all scores; with direction -1, of commands that do the opposite of being lost."""
    acted = _log_density(mixture, asked.scores, mixture.bias * asked.sizes)
    if mixture.share == 0.0:
        return float(acted.sum())
    held = _log_density(mixture, asked.scores, direction * asked.sizes)
    return float(np.logaddexp(np.log1p(-mixture.share) + acted, np.log(mixture.share) + held).sum())


def _found(asked: HeldScores) -> Mixture | None:
    """The likeliest mixture with lost commands; None where none, or what is no loss, is as likely."""
    if len(asked.sizes) < _FEWEST:
        return None
    spread = float(np.median(np.abs(asked.scores - np.median(asked.scores))))
    none, log_none = _likeliest(asked, Mixture(0.0, 0.0, max(1.5 * spread, 1e-6), _DEGREES), 1.0)
    found, log_found = _with_losses(asked, none)
    _, log_opposite = _with_losses(asked, none, -1.0)
    return found if log_found - max(log_none, log_opposite) > _CERTAIN else None


def _with_losses(asked: HeldScores, begin: Mixture, direction: float = 1.0) -> tuple[Mixture, float]:
    """The likeliest mixture with lost commands, from several shares on, and its log likelihood."""
    shares = (begin.share,) if begin.share > 0.0 else _STARTS
    return max((_likeliest(asked, begin._replace(share=share), direction) for share in shares), key=lambda f: f[1])


def _likeliest(asked: HeldScores, begin: Mixture, direction: float) -> tuple[Mixture, float]:
    """The likeliest mixture, and its log likelihood; with no share in the beginning, of those without lost commands."""
    has_share = begin.share > 0.0
    least, most = _RANGE
    variables = [begin.bias, np.log(begin.scale), logit((begin.degrees - least) / (most - least))]
    found = minimize(
        lambda x: -_log_likelihood(_mixture(x, has_share), asked, direction),
        [logit(begin.share), *variables] if has_share else variables,
        method="Nelder-Mead",
        options={"xatol": _TOLERANCE, "fatol": _TOLERANCE, "maxiter": 2000},
    )
    return _mixture(found.x, has_share), -float(found.fun)


def _mixture(x: Array, has_share: bool) -> Mixture:
    """By the variables of a search: logit of the share, bias, logarithm of the scale, and the degrees of freedom.

    These lie within `_RANGE`: the likelihood of normal scores is flat where they are many.
    """
    share = float(np.clip(expit(x[0]), _LEAST_SHARE, 1.0 - _LEAST_SHARE)) if has_share else 0.0
    bias, scale, degrees = (float(value) for value in x[-3:])
    least, most = _RANGE
    inside = float(np.clip(expit(degrees), 1e-6, 1.0 - 1e-6))
    return Mixture(share, bias, float(np.exp(scale)), least + (most - least) * inside)


def _log_odds(mixture: Mixture, asked: HeldScores) -> Array:
    """Of each command, that it was lost, not that it acted; 0 of those that would not show."""
    acted = _log_density(mixture, asked.scores, mixture.bias * asked.sizes)
    held = _log_density(mixture, asked.scores, asked.sizes)
    return np.where(asked.sizes > _SEEN, logit(mixture.share) + held - acted, 0.0)


def _decided(lost: Mask, log_odds: Array) -> Mask:
    """Which commands are taken to be lost next: a command changes sides if no neighbour does so with more reason.

    Neighbours show alike: if one of them was lost, both seem to be, and together they would explain too much. A command
    of which nothing is asked has log odds of 0.
    """
    reason = np.where(((log_odds > 0.0) != lost) & (log_odds != 0.0), np.abs(log_odds), 0.0)
    changes = (reason > 0.0) & (reason >= maximum_filter1d(reason, 2 * _NEIGHBOURS + 1, mode="constant"))
    return np.asarray(lost ^ changes)


def _loss(mixture: Mixture, asked: Sequence[HeldScores], lost: Sequence[Mask]) -> CommandLoss | None:
    """The share that is lost of the commands that show clearly; None of none.

    A lost command shows clearly where half of its size is more than one score in a hundred scatters by. Whether a
    command shows does not depend on whether it is lost, so that the share of these is that of all. The interval is that
    of Clopper and Pearson (1934).
    """
    clear = 2.0 * mixture.scale * float(stdtrit(mixture.degrees, 0.99))
    shows = np.concatenate([each.sizes > clear for each in asked])
    count, total = int(np.sum(np.concatenate(lost) & shows)), int(np.sum(shows))
    if count == 0:
        return None
    low = float(betaincinv(count, total - count + 1, 0.025))
    high = float(betaincinv(count + 1, total - count, 0.975)) if count < total else 1.0
    return CommandLoss(count / total, low, high, count, total)
