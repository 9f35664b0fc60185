"""Open-loop predictions of the planar model, from states that its own filter made of the measurements so far."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.core.sine_cosine import sine_and_cosine
from twbal.planar.actuation import EVEN
from twbal.planar.constants import Constants, constants
from twbal.planar.parameters import PlanarParameters
from twbal.planar.planar_plant import hold
from twbal.planar.planar_state import PlanarState, turning_at
from twbal.planar.sensing import filtered_tilt, periods_kept, read_sensors
from twbal.sysid.kalman_predictor import moved
from twbal.sysid.recording import Recording

EARLIEST = 4
"""Instant from which on there is a past to start with; what an IMU saw before the first instant is what it saw then."""


@kernel()
def _state(x: Array) -> PlanarState:
    return PlanarState(
        x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9], x[10], x[11], x[12], x[13], x[14], x[15], x[16],
        x[17],
    )  # fmt: skip


@kernel()
def _seen(k: Constants, x: Array) -> tuple[float, float, float]:
    """What the IMU saw at an instant: a row of its past, as of `imu_settled`."""
    s = _state(x)
    return filtered_tilt(k, s, x[18]), s.tilt_rate, x[18]


@kernel()
def _run(
    p: PlanarParameters,
    commands: Array,
    yaw_rate: Array,
    heading: Array,
    period: float,
    substeps: int,
    states: Array,
    starts: NDArray[np.int_],
    off: Array,
    limit: float,
    predicted: Array,
    fell: Array,
) -> None:
    """Write the readings after 1 .. S periods of each start to `predicted` (n, S, 4); see `predict_open_loop`.

    A body that comes to the tilt `limit` lies there: its readings stay. `fell` (n,) is the number of periods after
    which it does; S + 1 where it does not.
    """
    h = period / substeps
    k = constants(p, h)
    kept = periods_kept(k, substeps)
    imu = np.empty((kept * substeps, 4))
    steps = predicted.shape[1]
    for j in range(len(starts)):
        n, d = int(starts[j]), off[j]
        for i in range((kept - 1) * substeps):  # the filter's tilt and tilt rate, between its instants interpolated
            age = i // substeps
            share = i / substeps - age
            row = (n * substeps - i) % len(imu)
            near, far = 2 * min(age, 2), 2 * min(age + 1, 2)
            later, earlier = _seen(k, states[max(n - age, 0)]), _seen(k, states[max(n - age - 1, 0)])
            for c in range(3):
                imu[row, c] = (1.0 - share) * later[c] + share * earlier[c]
            for c in range(2):
                off_now = d[2 * c] if age == 0 else d[2 + near + c]
                imu[row, c] += (1.0 - share) * off_now + share * d[2 + far + c]
            imu[row, 3] = imu[row, 1]
        s = moved(_state(states[n]), k, d[0], d[1], d[2], d[3], sine_and_cosine(heading[n]))
        fell[j] = steps + 1
        for m in range(steps):
            turning = turning_at(0.5 * (yaw_rate[n + m] + yaw_rate[n + m + 1]), heading[n + m])
            s = hold(p, k, s, commands, n + m, substeps, turning, imu, EVEN)
            after = (n + m + 1) * substeps
            seen = read_sensors(p, k, s, imu, after, 0.5 * h, after * h)
            predicted[j, m, 0], predicted[j, m, 1] = seen.tilt, seen.tilt_rate
            predicted[j, m, 2], predicted[j, m, 3] = seen.wheel_angle, seen.wheel_rate
            if not abs(s.tilt) < limit:
                fell[j] = m + 1
                for rest in range(m + 1, steps):
                    predicted[j, rest] = predicted[j, m]
                break


class OpenLoop(NamedTuple):
    """Predictions from n starts.

    Attributes:
        readings: (n, S, 4) of the sensors after 1 .. S control periods, without noise, in the order of `MEASURED`.
        fell: (n,) number of periods after which the body comes to the tilt limit; S + 1 where it does not.
    """

    readings: Array
    fell: Array


def predict_open_loop(
    planar: PlanarParameters, recording: Recording, substeps: int, states: Array, starts: NDArray[np.int_], off: Array,
    steps: int, limit: float,
) -> OpenLoop:  # fmt: skip
    """What the planar model says of the next periods, under the commands and the yaw rate that were measured.

    Args:
        planar: the model.
        recording: with the commands.
        substeps: physics steps of a control period.
        states: (T + 1, 19), of an even loop (`Recording.even_states`): by the measurements up to each instant.
        starts: (n,) instants, from `EARLIEST` to T - steps.
        off: (n, 8) by which the starts are off: tilt, wheel, tilt rate, wheel speed; then tilt and tilt rate of one
            control period before, and of two.
        steps: S, control periods ahead.
        limit: tilt at which the body lies, and stays as it is [rad].
    """
    readings, fell = np.empty((len(starts), steps, 4)), np.empty(len(starts))
    _run(
        planar, recording.commands, recording.yaw_rate, recording.heading, recording.period, substeps, states, starts,
        off, limit, readings, fell,
    )  # fmt: skip
    return OpenLoop(readings, fell)
