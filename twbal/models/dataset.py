"""From episodes to the samples that a GP learns from."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from twbal.core.channels import Channels
from twbal.core.episode import Episode
from twbal.core.errors import DataError
from twbal.core.gaussian import Array, Mask
from twbal.core.plant import Observation
from twbal.models.gp import Posterior

_TIME = Observation._fields.index("time")
_SAME_PERIOD = 1e-6  # s
_MISSING = 1.5  # control periods between two samples: one or more of them is missing
_LEAST_KEPT = 0.5  # share of the control periods with both samples that those with known past commands must make up


class Transitions(NamedTuple):
    """One row for each control period.

    Attributes:
        inputs: (n, d), of the state x_{t-1} and the command u_{t-1} what changes depend on (`Channels.inputs`).
        targets: (n, E), the change x_t - x_{t-1} of the E measured channels (of eq. 4), or what a model leaves of it.
    """

    inputs: Array
    targets: Array


def transitions(episodes: Sequence[Episode], channels: Channels) -> Transitions:
    """The control periods of all episodes, in order.

    Left out are those at whose end a sample is missing: a host that was late, or a row that was lost, makes a change of
    two periods or more. So are those whose past commands reach back to such a gap, as what acted there is not known
    (but see `_usable`). Past commands among the channels are inputs only: they are copied from step to step, so there
    is nothing to learn. Of an episode with a reference the states are those over ground.

    Raises:
        DataError: an episode has other channels than `channels`, the control periods differ from each other or from
            that of `channels`, where it has one, or there is no change over one period.
    """
    for number, episode in enumerate(episodes):
        if episode.channels != channels.names:
            raise DataError(
                f"Episode {number} has the state channels {', '.join(episode.channels)}; expected are "
                f"{', '.join(channels.names)}. Collect or import it anew with this state, or choose the "
                "state it was made with."
            )
    episodes = [episode.over_ground() for episode in episodes]
    periods = sorted({episode.control_period for episode in episodes})
    if periods and periods[-1] - periods[0] > _SAME_PERIOD:
        named = dict.fromkeys(f"{period:g}" for period in periods)
        raise DataError(
            f"The episodes have control periods of {' s, '.join(named)} s; a model of one-step changes needs a single "
            "one."
        )
    if episodes and channels.control_period and abs(periods[0] - channels.control_period) > _SAME_PERIOD:
        raise DataError(
            f"The episodes have a control period of {periods[0]:g} s; expected is {channels.control_period:g} s, that "
            "of the state. Choose the robot that they were recorded with by robot=...; of imported logs, give "
            f"robot.control_period={periods[0]:g}."
        )
    usable = _usable(episodes, channels)
    if not any(each.any() for each in usable):
        raise DataError(
            f"There is no control period with both of its samples in {len(episodes)} episodes. Collect at least one "
            "rollout."
        )
    kept, measured = list(channels.inputs), list(channels.measured)
    rows = [np.column_stack([episode.states[:-1], episode.commands])[:, kept] for episode in episodes]
    inputs = [row[one] for row, one in zip(rows, usable, strict=True)]
    steps = [np.diff(episode.states, axis=0)[:, measured] for episode in episodes]
    changes = [step[one] for step, one in zip(steps, usable, strict=True)]
    return Transitions(np.concatenate(inputs), np.concatenate(changes))


def _usable(episodes: Sequence[Episode], channels: Channels) -> list[Mask]:
    """(T,) of each episode, whether no sample is missing between the two of a control period, nor where it looks back.

    In a period that a host or a line missed, the command before it acted, or the one after it for a part of the period.
    So what past commands of the states after it did is not known. Where that would leave less than half of the control
    periods, as with a poor line and a state of many past commands, they are taken as they were recorded.
    """
    whole = [np.diff(e.observations[:, _TIME]) < _MISSING * e.control_period for e in episodes]
    found = []
    for is_whole in whole:
        is_known = is_whole.copy()
        for lag in channels.lags.values():
            is_known[lag:] &= is_whole[:-lag]
        found.append(is_known)
    kept, most = (sum(int(each.sum()) for each in masks) for masks in (found, whole))
    return found if kept >= _LEAST_KEPT * most else whole


def unbroken(episodes: Sequence[Episode], channels: Channels) -> list[Episode]:
    """The stretches of episodes in which no sample is missing and past commands are known (`_usable`).

    Those without a control period are left out.

    Args:
        episodes: over ground.
        channels: of their states.
    """
    found: list[Episode] = []
    for episode, is_usable in zip(episodes, _usable(episodes, channels), strict=True):
        if len(episode) and is_usable.all():
            found.append(episode)
            continue
        edges = np.flatnonzero(np.diff(np.concatenate([[False], is_usable, [False]])))
        for begin, end in edges.reshape(-1, 2):
            rows = slice(begin, end + 1)
            part = replace(
                episode,
                observations=episode.observations[rows],
                states=episode.states[rows],
                commands=episode.commands[begin:end],
                poses=None,
                references=None,
                headings=None,
                events=(),
            )
            found.append(part)
    return found


def residuals(data: Transitions, f: Posterior) -> Transitions:
    """What the simulation model f leaves for the difference model g to learn: Δ - E_f[Δ] at the same inputs."""
    if data.inputs.shape[1] != f.inputs or data.targets.shape[1] != f.outputs:
        raise DataError(
            f"The samples have {data.inputs.shape[1]} inputs and {data.targets.shape[1]} targets; the model f has "
            f"{f.inputs} and {f.outputs}. Was f learned with another state?"
        )
    return Transitions(data.inputs, data.targets - f.mean(data.inputs))
