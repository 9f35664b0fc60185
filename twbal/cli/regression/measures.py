"""Numbers that each part of twbal makes of logged data, by name: `part/what`."""

from collections.abc import Mapping, Sequence

import numpy as np

from twbal.core.channels import Channels
from twbal.core.cost import Cost
from twbal.core.episode import Episode
from twbal.core.evaluation import SuccessCriterion, judged
from twbal.core.gaussian import Array, Gaussian
from twbal.core.plant import Observation
from twbal.core.robot_parameters import RobotParameters
from twbal.core.start_pose import StartPose
from twbal.diagnosis.candidates import Candidate
from twbal.diagnosis.name import name_effects
from twbal.diagnosis.settings import Settings as DiagnosisSettings
from twbal.effects.effect import Effect
from twbal.models.dynamics import DynamicsModel
from twbal.models.moments.truncation import Truncation
from twbal.models.recipe import ModelRecipe
from twbal.planar.robot_distribution import prior_of
from twbal.policies.rbf import RbfPolicy
from twbal.search.long_term_cost import long_term_cost
from twbal.search.start_state import start_state
from twbal.search.transition import transition_model
from twbal.sim.bullet_plant import SimPlant
from twbal.sysid.posterior import posterior
from twbal.sysid.recording import Recording

Measures = dict[str, float | str]
_AHEAD, _EVERY = 10, 7  # steps of a multi-step prediction, and control periods from one to the next
_HORIZONS = (10, 30)
_PERIODS = 15  # of a rollout with an effect
_NORMAL95 = 1.959964
_SHOWN = 12  # commands of a policy, spread over the logged states


def log_measures(name: str, episodes: Sequence[Episode]) -> Measures:
    """What the log reader makes of logs: how much, and mean and rms of every number."""
    found: Measures = {f"logs/{name}/samples": float(sum(map(len, episodes)))}
    columns = {
        field: np.concatenate([e.observations[:, i] for e in episodes]) for i, field in enumerate(Observation._fields)
    }
    columns["command"] = np.concatenate([e.commands for e in episodes])
    for i, channel in enumerate(episodes[0].channels):
        columns[f"state_{channel}"] = np.concatenate([e.states[:, i] for e in episodes])
    for field, values in columns.items():
        found[f"logs/{name}/{field}/mean"] = float(values.mean())
        found[f"logs/{name}/{field}/rms"] = _rms(values)
    return found


def model_measures(name: str, model: DynamicsModel, episodes: Sequence[Episode]) -> Measures:
    """One-step and multi-step errors, log predictive density and coverage of a model on other episodes."""
    measured = list(model.channels.measured)
    noise = model.process_noise + 2.0 * model.observation_noise  # a change has the sensors' noise twice
    errors, variances, ahead = [], [], []
    for episode in episodes:
        step = model.step_distribution(episode.states[:-1], episode.commands)
        errors.append((episode.states[1:] - step.mean)[:, measured])
        variances.append(step.variance + noise)
        ahead.append(_after(model, episode, measured))
    error, variance = np.concatenate(errors), np.concatenate(variances)
    density = -0.5 * (error**2 / variance + np.log(2 * np.pi * variance)).sum(axis=1)
    found: Measures = {
        f"{name}/log predictive density": float(density.mean()),
        f"{name}/coverage of the 95 % interval": float((np.abs(error) < _NORMAL95 * np.sqrt(variance)).mean()),
    }
    for k, i in enumerate(measured):
        channel = model.channels.names[i]
        found[f"{name}/one-step error/{channel}"] = _rms(error[:, k])
        found[f"{name}/{_AHEAD}-step error/{channel}"] = _rms(np.concatenate(ahead)[:, k])
    return found


def _after(model: DynamicsModel, episode: Episode, measured: list[int]) -> Array:
    """Errors of the mean after some steps under the logged commands, (n, E)."""
    begins = np.arange(0, len(episode) - _AHEAD, _EVERY)
    states = episode.states[begins]
    for k in range(_AHEAD):
        states = model.step_mean(states, episode.commands[begins + k])
    return np.asarray((episode.states[begins + _AHEAD] - states)[:, measured])


def fit_measures(
    recipe: ModelRecipe,
    channels: Channels,
    simulated: Sequence[Episode],
    real: Sequence[Episode],
    held_out: Sequence[Episode],
) -> Measures:
    """f and f + g learned anew from the logs, and what they are worth on others."""
    f = recipe.learn_simulation(simulated, channels, seed=0)
    both = recipe.learn_difference(f.model, real, seed=0)
    found: Measures = {}
    for name, learned in (("f", f), ("f + g", both)):
        found |= model_measures(f"fit/{name}", learned.model, held_out)
        for channel, value in zip([channels.names[i] for i in channels.measured], learned.log_evidence, strict=True):
            found[f"fit/{name}/log evidence/{channel}"] = float(value)
    return found


def policy_measures(policy: RbfPolicy, episodes: Sequence[Episode]) -> Measures:
    """A policy's commands on logged states."""
    states = np.concatenate([episode.states for episode in episodes])
    commands = policy.command(states)
    found: Measures = {"policy/commands/mean": float(commands.mean()), "policy/commands/rms": _rms(commands)}
    for row in np.linspace(0, len(states) - 1, _SHOWN).astype(int):
        found[f"policy/command at state {row}"] = float(commands[row])
    return found


def search_measures(model: DynamicsModel, policy: RbfPolicy, cost: Cost, pose: StartPose) -> Measures:
    """Expected long-term cost of a policy on a model, and its gradient: moment matching, squash and cost."""
    start = start_state(pose, model.names)
    found: Measures = {}
    for horizon in _HORIZONS:
        expected = long_term_cost(transition_model(model), policy, cost, start, horizon, Truncation())
        found[f"search/cost over {horizon} periods"] = expected.value
        for part, values in expected.gradient._asdict().items():
            found[f"search/gradient by {part} over {horizon} periods"] = float(np.linalg.norm(values))
    return found


def cost_measures(cost: Cost, episodes: Sequence[Episode]) -> Measures:
    """The cost of logged states, and that expected of their distribution."""
    states = np.concatenate([episode.states for episode in episodes])
    spread = Gaussian(states.mean(axis=0), np.cov(states.T))
    return {
        "cost/mean over logged states": float(cost(states).mean()),
        "cost/expected of a normal distribution": float(cost.expected(spread).value),
    }


def effect_measures(robot: RobotParameters, effects: Mapping[str, Effect], physics_step: float) -> Measures:
    """Where the simulated robot is, with one effect at a time, after some periods of given commands.

    One that acts on others is put beside the first of these.
    """
    commands = 0.25 * robot.torque_limit * np.sin(0.9 * np.arange(_PERIODS))
    start = StartPose(0.05, 0.0, 0.0, 0.0)
    found: Measures = {}
    for name, effect in effects.items():
        settings = {"robot": robot, "start": start, "physics_step": physics_step, "seed": 0}
        together = [effect, *(effects[other] for other in effect.acts_on[:1])]
        with SimPlant(effects=together, **settings) as plant:  # type: ignore[arg-type]
            seen = [plant.reset(0), *(plant.step(float(command)) for command in commands)]
        for channel in ("tilt", "wheel_angle"):
            found[f"effects/{name}/{channel}"] = _rms(np.array([getattr(each, channel) for each in seen]))
    return found


def diagnosis_measures(
    recordings: Sequence[Recording],
    robot: RobotParameters,
    candidates: Sequence[Candidate],
    settings: DiagnosisSettings,
) -> Measures:
    """The verdict on logged data, and the values that come with it."""
    found = name_effects(recordings, robot, {}, candidates, settings)
    measures: Measures = {
        "diagnosis/verdict": found.verdict.value,
        "diagnosis/effects": ", ".join(effect.name for effect in found.named_effects),
    }
    for effect in found.named_effects:
        for name, estimate in effect.parameters.items():
            measures[f"diagnosis/{effect.name}/{name}"] = estimate.value
    for each in found.autocorrelation:
        measures[f"diagnosis/whiteness/{each.channel}"] = each.after  # its name in stored baselines
    return measures


def place_measures(
    policy: RbfPolicy, episodes: Sequence[Episode], robot: RobotParameters, rule: SuccessCriterion
) -> Measures:
    """What is made of rollouts that keep a place: commands, numbers of the robot that they tell, parts of success."""
    states = np.concatenate([episode.states for episode in episodes])
    found: Measures = {"place/commands/rms": _rms(policy.command(states))}
    known = posterior(prior_of(robot), episodes)
    for field, mean, variance in zip(known.fields, known.mean, np.diag(known.covariance), strict=True):
        found[f"place/robot/{field}"] = float(mean)
        found[f"place/robot/sd of {field}"] = float(np.sqrt(variance))
    verdict = judged(max(episodes, key=len), rule)
    for name in ("farthest", "command_change", "oscillation"):
        found[f"place/success/{name}"] = float(getattr(verdict, name))
    return found


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
