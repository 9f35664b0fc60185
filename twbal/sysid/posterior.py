"""What rollouts tell of the parameters of a robot: their posterior, by prediction error and a normal approximation.

All parameters are fitted at once from the prior that the robot's sheet gives (`planar.robot_distribution`), through the
Kalman predictor of `sysid.kalman_predictor`; the covariance is the inverse of the curvature there (Laplace). Nothing is
named or left out, as a diagnosis does: what rollouts do not tell stays as uncertain as it was before.

A tilt may come from a complementary filter, which takes speeding up for leaning. Its time constant is found over a
grid: what such a filter adds is taken off the tilt, all is fitted, and a parabola through the costs gives the rate and
its standard deviation. The other parameters are those of the best rate of the grid.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from twbal.core.episode import Episode
from twbal.core.errors import DataError
from twbal.core.gaussian import Array, Mask
from twbal.core.plant import Observation
from twbal.core.robot_parameters import GRAVITY
from twbal.core.threads import in_threads
from twbal.core.time_base import evened
from twbal.planar.parameters import planar_parameters
from twbal.planar.robot_distribution import SLOW_FILTERS, RobotDistribution, filter_lead
from twbal.sysid.model import Data, FreeParameter, Model
from twbal.sysid.noise import UNSENSED, NoiseModel
from twbal.sysid.prediction_error_fit import Fit, refit, slopes_of
from twbal.sysid.recording import MEASURED, Recording

_SUBSTEPS = 10  # physics steps of a control period
_ROUNDS, _ITERATIONS, _NOISE_ITERATIONS = 4, 30, 20
_FIRST_SENSORS = (0.003, 0.02, 0.001, 0.05)  # rad, rad/s: where the search for the noise begins
_LOUDEST_SENSORS = (0.01, 0.1, 0.02, 3.0)  # rad, rad/s: noise must not explain what the model should
_FIRST_TORQUES, _LOUDEST_TORQUES = 0.005, 0.05  # of the torque limit; likewise
_BENT = 0.026  # rad; 1.5 degrees, by which a torque moves the tilt at which the body balances
_ROOM = 1.5  # factor on what second differences tell of the noise, as some are few
_NORMAL_MEDIAN = 0.6745  # of the size of a standard normal number
_FASTER, _FASTEST = 1.6, 6.0  # factor from rate to rate where the highest is the best one so far, and up to where [1/s]
_REFINED = 2  # times that the steps between such rates are halved about the best one
_OF_PARABOLA = 3  # rates that tell one
_CLEARLY = 100.0  # of -2 log posterior density; less may be fits that stopped in optima of their own
_FIRST_DELAYS = (0.25, 1.0, 2.0, 2.75)  # control periods: fits with a delay that is far off end in optima of their own
_DELAY, _BALANCE = "actuation_delay_delay", "com_offset_angle"
_DELAY_SD = 0.25  # control periods; a delay stands for the lags of drive and filters, which turn the phase otherwise
_BALANCE_SD = 0.003  # rad; a filter of the tilt drifts by as much with the noise of its gyro, from rollout to rollout
_TIME = Observation._fields.index("time")
_COLUMNS = [Observation._fields.index(name) for name in MEASURED]
_NUDGE = 2e-5  # of finite differences, in prior standard deviations: posterior ones can be a hundredth of these
FALLEN = 0.3
"""Tilt [rad] from which on nothing of an episode is used: that is no balancing, but saturation and wheels that slip."""
SHORTEST = 5
"""Control periods, below which an episode is left out."""


class _Attempt(NamedTuple):
    """A fit to rollouts whose tilt was freed of the error of a filter of some rate.

    Attributes:
        data: the rollouts.
        fit: to them.
        cost: -2 log posterior density of the robot and the rate, but for a constant.
    """

    data: Data
    fit: Fit
    cost: float


def posterior(prior: RobotDistribution, episodes: Sequence[Episode]) -> RobotDistribution:
    """The distribution of a robot's parameters after episodes of it, in which it must not turn much: yaw is left out.

    Slow torques get the size of the prior and of what the fit leaves together, as rollouts too short to show them do
    not tell that there are none; but no more than bends the body by `_BENT`: beyond, it is friction that is not quite
    Coulomb's.

    Raises:
        DataError: no episode has a few control periods of a robot that stands.
    """
    if not _recordings(prior, episodes, 0.0):
        raise DataError(f"None of {len(episodes)} episodes has {SHORTEST} control periods of a robot that stands.")
    attempts = _attempts(prior, episodes)
    costs = {rate: attempt.cost for rate, attempt in attempts.items()}
    data, fit, _ = attempts[_best(attempts)]
    return replace(
        prior,
        mean=fit.values,
        covariance=_covariance(data, fit, prior),
        sensor_sd=np.where(data.sensed, fit.model.noise.sensors, prior.sensor_sd),
        torque_sd=_slow_torques(fit.model.noise.torques, prior),
        filter_rate=_vertex(costs, prior.filter_rate[1]) if data.sensed[0] else prior.filter_rate,
    )


def _slow_torques(left: Array, prior: RobotDistribution) -> Array:
    """(2,) standard deviations of slow torques, where a fit leaves torques of the size `left` [N·m]."""
    robot = prior.robot
    most = np.maximum(prior.torque_sd, _BENT * robot.body_mass * GRAVITY * robot.com_height)
    return np.asarray(np.minimum(np.hypot(left, prior.torque_sd), most))


def _attempts(prior: RobotDistribution, episodes: Sequence[Episode]) -> dict[float, _Attempt]:
    """A fit for each of `SLOW_FILTERS`; all but the first begin where that ends.

    A filter that is not there can take parameters so far off that fits which begin there end in an optimum of their
    own. So a robot without a filter is fitted from the prior's mean, too; if that is another optimum, and a better one,
    the fits of the other rates begin there once more.

    Where the highest rate is the best, higher ones are tried, and then some between them. Where no tilt was measured
    nothing is asked of its filter.
    """

    def attempt(task: tuple[float, Model | None]) -> _Attempt:
        rate, begin = task
        data = _data(prior, episodes, rate)
        fit = _first_fit(data, prior) if begin is None else _fitted(data, begin, prior)
        return _Attempt(data, fit, fit.cost + _penalty(prior, rate))

    if not _data(prior, episodes, 0.0).sensed[0]:
        return {0.0: attempt((0.0, None))}
    usable = partial(_recordings, prior, episodes)  # empty where a filter would have hidden that the robot lay
    first, *others = filter(usable, SLOW_FILTERS)
    found = {first: attempt((first, None))}
    near = found[first].fit.model
    mean = _at_mean(prior, found[first].data.sensed)
    *begun, unfiltered = in_threads(attempt, [*((rate, near) for rate in others), (0.0, mean)])
    found |= dict(zip(others, begun, strict=True))
    if unfiltered.cost < found[0.0].cost - _CLEARLY:
        rates = [rate for rate in (first, *others) if rate]
        again = in_threads(attempt, [(rate, unfiltered.fit.model) for rate in rates])
        better = [min(found[rate], other, key=_cost) for rate, other in zip(rates, again, strict=True)]
        found |= {0.0: unfiltered} | dict(zip(rates, better, strict=True))
    while 0.0 < (best := _best(found)) == max(found) and best < _FASTEST and usable(_FASTER * best):
        found[_FASTER * best] = attempt((_FASTER * best, found[best].fit.model))
    for _ in range(_REFINED if best > max(SLOW_FILTERS) else 0):
        best, rates = _best(found), sorted(found)
        beside = [rates[max(rates.index(best) - 1, 0)], rates[min(rates.index(best) + 1, len(rates) - 1)]]
        between = list(filter(usable, [float(np.sqrt(best * other)) for other in beside if other != best]))
        found |= dict(zip(between, in_threads(attempt, [(r, found[best].fit.model) for r in between]), strict=True))
    return found


def _best(attempts: Mapping[float, _Attempt]) -> float:
    """The filter rate of the likeliest fit."""
    return min(attempts, key=lambda rate: attempts[rate].cost)


def _cost(attempt: _Attempt) -> float:
    return attempt.cost


def _at_mean(prior: RobotDistribution, sensed: Mask) -> Model:
    """The prior's mean, with little noise: fitted to a model far off, noise explains what the model should."""
    begin = planar_parameters(prior.robot, {})._replace(**dict(zip(prior.fields, prior.mean.tolist(), strict=True)))
    sensors = np.where(sensed, _FIRST_SENSORS, UNSENSED)
    return Model(begin, 0.0, NoiseModel(sensors, np.full(2, _FIRST_TORQUES * prior.robot.torque_limit)))


def _first_fit(data: Data, prior: RobotDistribution) -> Fit:
    """The best of the fits that begin at the prior's mean, with several delays."""
    mean = _at_mean(prior, data.sensed)
    delays = [{_DELAY: late * data.period} for late in _FIRST_DELAYS]
    starts = [mean._replace(planar=mean.planar._replace(**late)) for late in delays]
    fits = in_threads(lambda start: _fitted(data, start, prior), starts)
    return min(fits, key=lambda found: found.cost)


def _data(prior: RobotDistribution, episodes: Sequence[Episode], filter_rate: float) -> Data:
    """Episodes that are long enough, without the error of a tilt filter [1/s], and the loudest noise that is allowed.

    Bounds on noise keep a fit from calling noise what the model should explain.
    """
    recordings = _recordings(prior, episodes, filter_rate)
    data = Data(recordings, _SUBSTEPS)
    seen = np.maximum(_ROOM * roughness(recordings), 2.0 * data.resolution)
    sensors = np.clip(seen, _FIRST_SENSORS, _LOUDEST_SENSORS)
    return replace(data, loudest=NoiseModel(sensors, np.full(2, _LOUDEST_TORQUES * prior.robot.torque_limit)))


def roughness(recordings: Sequence[Recording]) -> Array:
    """(4,) standard deviations of white noise whose second differences are as large as those of `MEASURED`.

    The motion's own second differences are in it, so that it errs upwards. By the median of their sizes, which falls
    and bumps do not move much (P. J. Huber, E. M. Ronchetti: Robust Statistics, 2nd ed., Wiley 2009, section 5.1).
    """
    bends = np.concatenate([np.diff(recording.measured, n=2, axis=0) for recording in recordings])
    return np.asarray(np.median(np.abs(bends), axis=0) / (_NORMAL_MEDIAN * np.sqrt(6.0)))


def _fitted(data: Data, model: Model, prior: RobotDistribution) -> Fit:
    """The fit of all parameters that begins at a model."""
    return refit(data, model, _free(prior), _ROUNDS, _ITERATIONS, _NOISE_ITERATIONS)


def _penalty(prior: RobotDistribution, filter_rate: float) -> float:
    """-2 log prior density of a filter rate [1/s], but for a constant."""
    mean, sd = prior.filter_rate
    return ((filter_rate - mean) / sd) ** 2


def _vertex(costs: Mapping[float, float], most: float) -> tuple[float, float]:
    """Mean and standard deviation of the normal distribution whose -2 log density runs through the least of `costs`.

    Through it and its neighbours, as a parabola; the deviation is at most `most`. Where the parabola has no least value
    although all others are clearly greater, each neighbour alone tells of a deviation, and the greater one holds.
    """
    rates = sorted(costs)
    if len(rates) < _OF_PARABOLA:
        return min(costs, key=costs.__getitem__), most
    middle = min(max(rates.index(min(costs, key=costs.__getitem__)), 1), len(rates) - 2)
    near = rates[middle - 1 : middle + 2]
    curvature, slope, _ = np.polyfit(near, [costs[rate] for rate in near], 2)
    if curvature <= 0.0:
        best = min(costs, key=costs.__getitem__)
        rises = {rate: cost - costs[best] for rate, cost in costs.items() if rate != best}
        if min(rises.values()) < _CLEARLY:
            return best, most
        return best, min(max(abs(rate - best) * rises[rate] ** -0.5 for rate in near if rate != best), most)
    return float(np.clip(-0.5 * slope / curvature, rates[0], rates[-1])), float(min(curvature**-0.5, most))


def _recordings(robots: RobotDistribution, episodes: Sequence[Episode], filter_rate: float) -> list[Recording]:
    """The episodes that are long enough, each with what all of them measured; a rate that was worked out is none."""
    found = [r for e in episodes if len(r := _recording(e, robots, filter_rate)) >= SHORTEST]
    return [replace(recording, sensed=np.all([r.sensed for r in found], axis=0)) for recording in found]


def _recording(episode: Episode, robots: RobotDistribution, filter_rate: float) -> Recording:
    """An episode up to `FALLEN`, its tilt without the error of a filter of a rate [1/s]; missed periods do not count.

    What the robot did in a period whose sample is missing is worked out from the others: the command before was held.
    """
    times, angles, rates = episode.observations[:, _TIME], _COLUMNS[::2], _COLUMNS[1::2]
    even = evened(times, episode.observations, episode.commands, episode.control_period, angles, rates, uneven=False)
    seen = even.values.copy()
    seen[:, _COLUMNS[0]] -= tilt_error(seen, robots.robot.wheel_radius, episode.control_period, filter_rate)
    fallen = np.flatnonzero(np.abs(seen[:, _COLUMNS[0]]) > FALLEN)
    end = int(fallen[0]) if len(fallen) else len(seen)
    worked_out = {channel for channel, _ in episode.estimated}
    return Recording(
        "",
        episode.control_period,
        robots.possible(even.commands[: max(end - 1, 0)]),
        np.ascontiguousarray(seen[:end, _COLUMNS]),
        np.zeros(end),
        even.measured[:end],
        np.array([channel not in worked_out for channel in MEASURED]),
    )


def tilt_error(observations: Array, wheel_radius: float, period: float, filter_rate: float) -> Array:
    """(T + 1,) what a complementary filter adds to the tilt, as it takes speeding up for leaning [rad].

    Its accelerometer sees θ - v̇ / g, of which the filter passes what is slower than its time constant. The filter
    begins at the true tilt; the speed v of the axle comes from encoders and gyro. Filters faster than those that are
    tried in any case are firmware's, which adds up rectangles of the gyro: such a sum runs ahead by half a period.

    R. Mahony, T. Hamel, J.-M. Pflimlin: Nonlinear complementary filters on the special orthogonal group, IEEE
    Transactions on Automatic Control 53 (5), 2008, 1203-1218; here about one axis.

    Args:
        observations: (T + 1, 7) in the order of `Observation`.
        wheel_radius: [m].
        period: control period [s].
        filter_rate: 1 / time constant [1/s].
    """
    seen = Observation(*observations.T)
    gained = np.diff(wheel_radius * (seen.wheel_rate + seen.tilt_rate)) / GRAVITY
    error = np.zeros(len(observations))
    lead = filter_lead(filter_rate, period) * np.diff(seen.tilt_rate)
    for t, gain in enumerate(gained):
        error[t + 1] = error[t] - filter_rate * (gain + period * error[t]) + lead[t]
    return error


def _free(prior: RobotDistribution) -> list[FreeParameter]:
    sds = np.sqrt(np.diag(prior.covariance))
    return [
        FreeParameter(field, float(low), float(high), float(mean), float(sd), float(_NUDGE * sd))
        for field, low, high, mean, sd in zip(prior.fields, prior.low, prior.high, prior.mean, sds, strict=True)
    ]


def _covariance(data: Data, fit: Fit, prior: RobotDistribution) -> Array:
    J = slopes_of(data, fit)
    found: Array = np.linalg.inv(J.T @ J / data.slope_excess + np.linalg.inv(prior.covariance))
    late = prior.fields.index(_DELAY)
    found[late, late] = min(found[late, late] + (_DELAY_SD * data.period) ** 2, prior.covariance[late, late])
    balance = prior.fields.index(_BALANCE)
    found[balance, balance] += _BALANCE_SD**2
    return 0.5 * (found + found.T)
