"""Rollouts of planar models under one policy, compiled: what a policy is worth on robots that are known by parameters.

A second or so of one core drives hundreds of robots for ten seconds each. Beside noise of the sensors, robots may meet
slow torques that no parameter explains; these act by jolts at the end of each control period, after its readings. Their
tilt may come from a complementary filter (as of `sysid.posterior.tilt_error`), which takes speeding up for leaning.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from twbal.core.channels import Channels
from twbal.core.compiled import kernel, of_row
from twbal.core.cost import Cost, CostNumbers, price
from twbal.core.gaussian import Array
from twbal.core.robot_model import Reading
from twbal.core.robot_parameters import GRAVITY
from twbal.models.moments.multi_index import Integers
from twbal.planar.constants import Constants, constants
from twbal.planar.parameters import PlanarParameters
from twbal.planar.planar_plant import drive_on, standing
from twbal.planar.planar_state import PlanarState
from twbal.planar.sensing import imu_settled, ring_length
from twbal.planar.terms import sense
from twbal.policies.rbf import RbfPolicy
from twbal.policies.rbf_moments import Network
from twbal.search.sampled_rollouts import Limits, command_of

_SHOWN = ("tilt", "tilt_rate", "speed", "acceleration", "yaw_rate", "position", "position_integral")
"""Channels of the state that are no past commands; a channel's code is its place here."""

_PAST = len(_SHOWN)  # a past command's code is this and how many control periods it is old
_MAX_STEP = 0.001  # of the physics [s]
_FALLEN = 3.0  # of the limits, by a robot that fell; others are cut to it


class Driven(NamedTuple):
    """What became of n robots.

    Attributes:
        used: (n,) how much of the limits each used: the greatest of its tilt once settled, its distance once back in
            place and the change of its command, over their limits; it succeeded where that is at most 1. A robot that
            fell has 3 and the share of the time that was left.
        swings: (n,) its tilt's oscillation in place, peak to peak, over the limit of the settled tilt; 3 for a robot
            that fell.
        costs: (n,) mean cost of a step; a fallen robot costs 1 from its fall on.
    """

    used: Array
    swings: Array
    costs: Array

    @property
    def success(self) -> float:
        """Share of the robots that succeeded."""
        return float((self.used <= 1.0).mean())

    @property
    def mean_use(self) -> float:
        """Mean of the greater of `used` and `swings`: less is better, also among robots that succeed."""
        return float(np.maximum(self.used, self.swings).mean())


class PlanarDraws(NamedTuple):
    """What is random in the rollouts of n robots over T control periods.

    Attributes:
        start: (n, 3), tilt, tilt rate and speed at their beginning.
        sensors: (n, T, 4), errors of tilt, tilt rate, wheel angle and wheel rate.
        jolts: (n, T, 2), what disturbing torques add to the rates of body and wheels within a control period [rad/s].
        filter_rates: (n,), of the complementary filters that tilts come from [1/s]; see `RobotDistribution`.
        rate_ages: (n,), how old measured wheel rates are [control periods, from 0 to 1]: a difference of two angles is
            half as old as the time between them.
    """

    start: Array
    sensors: Array
    jolts: Array
    filter_rates: Array
    rate_ages: Array

    def first(self, robots: int | None) -> "PlanarDraws":
        """Those of the first robots; None: of all."""
        return PlanarDraws(*(part[:robots] for part in self))


def planar_rollouts(
    models: Sequence[PlanarParameters],
    channels: Channels,
    policy: RbfPolicy,
    cost: Cost,
    limits: Limits,
    draws: PlanarDraws,
    control_period: float,
    shown: Array | None = None,
) -> Driven:
    """Drive one robot of each model by a policy.

    Args:
        models: n of them.
        channels: of the state.
        policy: drives all of them.
        cost: of a state.
        limits: when a robot balances.
        draws: starts and noises.
        control_period: [s].
        shown: (n, S, D), into which the states at t = 0..S - 1 are written as the sensors show them, up to a fall.
    """
    lags = channels.lags
    codes = np.array([_PAST + lags[name] if name in lags else _SHOWN.index(name) for name in channels.names])
    substeps = max(round(control_period / _MAX_STEP), 1)
    bound = channels.max_position_integral
    shown = np.empty((len(models), 0, len(codes))) if shown is None else shown
    if wrong := [len(part) for part in (*draws, shown) if len(part) != len(models)]:  # a kernel does not look
        raise ValueError(f"{len(models)} robots have draws, or states to be shown, of {wrong[0]}")
    found = _rollouts(
        models[0],
        np.array(models),
        control_period / substeps,
        substeps,
        codes,
        bound,
        policy.network,
        cost.numbers,
        limits,
        shown,
        draws,
    )
    return Driven(*found)


@kernel()
def jolted(s: PlanarState, by: Array) -> PlanarState:
    """The state after torques have changed the rates of body and wheels."""
    rate, wheel, rotor = s.tilt_rate + by[0], s.wheel_speed + by[1], s.rotor_speed + by[1]
    return PlanarState(
        s.tilt, s.wheel, rate, wheel, s.torque, s.rotor, rotor, s.slip, s.position, s.driver_torque, s.sway,
        s.sway_rate, s.x, s.y, s.left_joint, s.right_joint, s.left_ground, s.right_ground,
    )  # fmt: skip


@kernel()
def fill(state: Array, codes: Integers, shown: tuple[float, ...], commands: Array, step: int) -> None:
    """Write a state (D,): what is shown of each channel's code, or the command that it is to remember."""
    for i, code in enumerate(codes):
        lag = code - _PAST
        if lag < 0:
            state[i] = shown[code]
        else:
            state[i] = commands[step - lag] if step >= lag else 0.0


@kernel()
def _rollouts(  # type: ignore[no-untyped-def]
    like: PlanarParameters,
    models: Array,
    step: float,
    substeps: int,
    codes: Integers,
    bound: float,
    network: Network,
    cost: CostNumbers,
    limits: Limits,
    shown: Array,
    draws: PlanarDraws,
):
    """What became of all robots, (n,) each as of `Driven`; in one call, as each call costs as much as many steps.

    Args:
        like: of the class of the models.
        models: (n, P), their numbers.
        step: of the physics [s].
        others: as of `planar_rollouts`.
    """
    n = len(models)
    used, swings, costs = np.empty(n), np.empty(n), np.empty(n)
    for i in range(n):
        p = of_row(like, models[i])
        used[i], swings[i], costs[i] = _rollout(
            p,
            constants(p, step),
            substeps,
            codes,
            bound,
            network,
            cost,
            limits,
            shown[i],
            draws.start[i],
            draws.sensors[i],
            draws.jolts[i],
            draws.filter_rates[i],
            draws.rate_ages[i],
        )
    return used, swings, costs


@kernel(is_kept=False)
def _rollout(  # type: ignore[no-untyped-def]
    p: PlanarParameters,
    k: Constants,
    substeps: int,
    codes: Integers,
    bound: float,
    network: Network,
    cost: CostNumbers,
    limits: Limits,
    states: Array,
    start: Array,
    sensors: Array,
    jolts: Array,
    filter_rate: float,
    rate_age: float,
):
    """One robot: how much of the limits it used, its oscillation, and the mean cost of a step; writes its `states`."""
    steps, D = len(sensors), len(codes)
    period = substeps * k.step
    commands, state = np.zeros(steps), np.empty(D)
    s = standing(k, start[0], start[1], start[2], 0.0)
    imu = imu_settled(k, s, ring_length(k, substeps))
    used, total, restless, lowest, highest = 0.0, 0.0, 0.0, np.inf, -np.inf
    tilt, rate, wheel, wheel_rate = sense(p, Reading(start[0], start[1], 0.0, start[2] / k.radius - start[1]), 0.0)
    turning = wheel_rate  # as it is; `wheel_rate` is what is measured
    # A state goes by the wheels' radius of the data sheet: a robot does not know its own.
    origin, position, integral, speed = 0.0, 0.0, 0.0, p.wheel_radius / k.radius * start[2]
    astray, axle = 0.0, start[2]  # error of a tilt that takes speeding up for leaning [rad]; true speed of the axle
    for step in range(steps + 1):
        noise = sensors[min(step, steps - 1)]
        seen_rate, before = rate + noise[1], speed
        speed = p.wheel_radius * (wheel_rate + noise[3] + seen_rate)
        path = p.wheel_radius * (wheel + noise[2] + tilt + noise[0])
        if step == 0:
            origin = path
        else:
            integral = min(max(integral + period * position, -bound), bound)
        position = path - origin
        shown = (tilt + noise[0], seen_rate, speed, (speed - before) / period, 0.0, position, integral)
        fill(state, codes, shown, commands, step)
        if step < len(states):
            states[step] = state
        if step > 0:
            total += price(cost, state)
        if step == steps:
            break
        command = command_of(network, state)
        commands[step] = command
        if step > limits.settle_step:
            restless += (command - commands[step - 1]) ** 2
        after = drive_on(p, k, s, commands, step, substeps, imu)
        s = jolted(after.state, jolts[step])
        astray -= filter_rate * ((k.radius * s.wheel_speed - axle) / GRAVITY + period * astray)
        axle = k.radius * s.wheel_speed
        # The torques act all through the period, of which the readings know nothing: half of it is there on average.
        tilt, rate = after.reading.tilt + astray, after.reading.tilt_rate + 0.5 * jolts[step, 0]
        wheel = after.reading.wheel_angle
        turned = turning
        turning = after.reading.wheel_rate + 0.5 * (jolts[step, 1] - jolts[step, 0])
        wheel_rate = turning - rate_age * (turning - turned)
        if not abs(s.tilt) <= limits.limit:
            return _FALLEN + (steps - step) / steps, _FALLEN, (total + steps - step) / steps
        if step + 1 >= limits.settle_step:
            used = max(used, abs(s.tilt) / limits.settled_tilt_limit)
        if step + 1 >= limits.place_step:
            used = max(used, abs(s.position) / limits.place_radius)
            lowest, highest = min(lowest, s.tilt), max(highest, s.tilt)
    change = np.sqrt(restless / max(steps - 1 - limits.settle_step, 1))
    swing = min(max(highest - lowest, 0.0) / limits.settled_tilt_limit, _FALLEN)
    return min(max(used, change / limits.command_change), _FALLEN), swing, total / steps
