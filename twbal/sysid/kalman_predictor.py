"""Kalman predictor on the planar model: what a model says of each measurement from those before it.

At each control instant the measurement corrects the predicted state by a gain that depends on the instant's number
alone (`noise`), and the planar model carries the corrected state to the next instant with all its effects: past
commands for a delay, the torques of a lag and of a slew limit, the rotor of a backlash, what swings on the body, the
IMU's past. A correction moves the past of a late IMU along.
"""

from math import floor, isfinite, nan
from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel, rarely
from twbal.core.gaussian import Array
from twbal.core.robot_model import Reading
from twbal.core.sine_cosine import SineCosine, sine_and_cosine
from twbal.planar.actuation import EVEN
from twbal.planar.constants import Constants, constants, with_step
from twbal.planar.parameters import PlanarParameters
from twbal.planar.planar_plant import hold
from twbal.planar.planar_state import PlanarState, Turning
from twbal.planar.sensing import imu_settled, periods_kept, read_sensors
from twbal.planar.terms import correct
from twbal.sysid.kalman import Filter
from twbal.sysid.noise import LASTING
from twbal.sysid.recording import Recording

STATE_COLUMNS = len(PlanarState._fields) + 1
"""Columns of its states: `PlanarState`, and what a filter of the tilt has forgotten of what misleads it [rad]."""
_NOTHING = (0.0,) * (len(PlanarState._fields) - 7)


@kernel()
def _first(p: PlanarParameters, k: Constants, measured: Array, lead: float) -> PlanarState:
    """The state that the first measurement tells."""
    true = correct(p, Reading(measured[0], measured[1], measured[2], measured[3]), 0.0)
    rate = true.tilt_rate
    tilt = true.tilt + (lead + k.imu_delay) * rate
    speed = true.wheel_rate + rate
    wheel = true.wheel_angle + lead * true.wheel_rate + tilt
    return PlanarState(tilt, wheel, rate, speed, 0.0, wheel, speed, *_NOTHING)


@kernel()
def steps_behind(instants: Array, n: int, delay: float, period: float, substeps: int, most: int) -> float:
    """Physics steps before instant n of an uneven loop in which an IMU has last seen the robot.

    Each period has as many physics steps, of its own length.

    Args:
        instants: (T + 1,) of the loop [s].
        n: number of the instant.
        delay: of the IMU [s].
        period: mean control period, as long as those before the first instant [s].
        substeps: physics steps of a period.
        most: physics steps of the past that are kept.
    """
    behind = 0.0
    while n > 0 and delay > instants[n] - instants[n - 1]:
        delay -= instants[n] - instants[n - 1]
        behind += substeps
        n -= 1
    lasts = instants[n] - instants[n - 1] if n > 0 else period
    return min(behind + substeps * delay / lasts, float(most - substeps))


@kernel(is_inlined=True)
def _correct_past(
    imu: Array, now: int, steps: int, substeps: int, late: int, gains: Array, instant: int, error: Array
) -> None:
    """Move the IMU's past along with a correction, interpolated between the instants that the gain is for.

    Row `now` is of this instant, `steps` physics steps after the first, and has been moved. Of the others, those are
    that an IMU which is `late` whole physics steps, a control period or more, reads from the next instant on.
    """
    oldest = min(late + 1 - substeps, 2 * substeps, steps)
    moves = np.zeros((3, 2))  # of tilt and tilt rate: now, one control period ago, two ago
    for j in range(4):
        for c in range(2):
            moves[0, c] += gains[instant, 2 * c, j] * error[j]
            moves[1, c] += gains[instant, 4 + c, j] * error[j]
            moves[2, c] += gains[instant, 6 + c, j] * error[j]
    row, age = now, 0
    for i in range(1, oldest + 1):
        row = row - 1 if row > 0 else len(imu) - 1  # cheaper than a remainder
        if i == (age + 1) * substeps:
            age += 1
        share = i / substeps - age
        for c in range(2):
            older = moves[age + 1, c] if age < 2 else 0.0
            imu[row, c] += (1.0 - share) * moves[age, c] + share * older


@kernel(is_inlined=True)
def moved(
    s: PlanarState, k: Constants, tilt: float, wheel: float, tilt_rate: float, speed: float, facing: SineCosine
) -> PlanarState:
    """The state with these added; the rotor goes with the wheel, and what swings on the body with the body.

    The axle goes with the wheel, too, in the direction in which the robot is `facing`.
    """
    way = k.radius * wheel
    return PlanarState(
        s.tilt + tilt,
        s.wheel + wheel,
        s.tilt_rate + tilt_rate,
        s.wheel_speed + speed,
        s.torque,
        s.rotor + wheel,
        s.rotor_speed + speed,
        s.slip,
        s.position + way,
        s.driver_torque,
        s.sway,
        s.sway_rate,
        s.x + way * facing.cosine,
        s.y + way * facing.sine,
        s.left_joint,
        s.right_joint,
        s.left_ground,
        s.right_ground,
    )


@kernel(is_inlined=True)
def _push(
    s: PlanarState,
    k: Constants,
    missing: Array,
    pushes: Array,
    facing: SineCosine,
    imu: Array,
    now: int,
    substeps: int,
    late: int,
) -> PlanarState:
    """The state with what the torques of a model discrepancy added in the last control period, and the IMU's past, too.

    A torque adds to the tilt rate in proportion to the time for which it acts, and to the tilt to the square of it. Of
    the IMU's past, those rows are changed that one which is `late` whole physics steps reads.
    """
    tilt, wheel, tilt_rate, speed = (
        missing[0] * pushes[0, 0] + missing[1] * pushes[1, 0],
        missing[0] * pushes[0, 1] + missing[1] * pushes[1, 1],
        missing[0] * pushes[0, 2] + missing[1] * pushes[1, 2],
        missing[0] * pushes[0, 3] + missing[1] * pushes[1, 3],
    )
    first, last = (late, late + 1) if late + 1 < substeps else (0, substeps - 1)
    row = now - first if now >= first else now - first + len(imu)
    for i in range(first, last + 1):
        share = 1.0 - i / substeps
        imu[row, 0] += share * share * tilt
        imu[row, 1] += share * tilt_rate
        row = row - 1 if row > 0 else len(imu) - 1
    return moved(s, k, tilt, wheel, tilt_rate, speed, facing)


@kernel(is_inlined=True)
def _with_one_lead(
    k: Constants, before: PlanarState, s: PlanarState, more: float, facing: SineCosine, imu: Array, now: int
) -> PlanarState:
    """The state with angles that run ahead of its rates as after physics steps of an even loop (`Data.lead`).

    Angles gain the change of their rates in a control period times half of a physics step: `more` than usual [s], where
    the period is longer.
    """
    tilt = more * (s.tilt_rate - before.tilt_rate)
    imu[now, 0] -= tilt
    return moved(s, k, -tilt, -more * (s.wheel_speed - before.wheel_speed), 0.0, 0.0, facing)


@kernel(is_inlined=True)
def _carry(missing: Array, decay: Array, summed: float) -> None:
    """Carry a model discrepancy over a control period: it decays, and the tilt adds up the gyro's bias."""
    added = summed * missing[5]
    for i in range(len(decay)):
        missing[i] *= decay[i]
    missing[2] += added


@kernel(is_inlined=True)
def _compare(measured: Array, seen: Reading, missing: Array, error: Array) -> bool:
    """Write what is measured less what is predicted, with a model discrepancy, (4,); whether these are numbers."""
    error[0] = measured[0] - seen.tilt - missing[2]
    error[1] = measured[1] - seen.tilt_rate - missing[3] - missing[5]
    error[2] = measured[2] - seen.wheel_angle - missing[4]
    error[3] = measured[3] - seen.wheel_rate
    return isfinite(error[0] + error[1] + error[2] + error[3])


@kernel(is_inlined=True)
def _gained(gain: Array, error: Array) -> float:
    """What a row of the gain (4,) makes of a prediction error (4,)."""
    return float(gain[0] * error[0] + gain[1] * error[1] + gain[2] * error[2] + gain[3] * error[3])


@kernel(is_inlined=True)
def _correct_missing(missing: Array, gain: Array, error: Array, components: int) -> None:
    """Correct a model discrepancy by a gain (S, 4) and a prediction error (4,)."""
    for i in range(components):
        for j in range(4):
            missing[i] += gain[8 + i, j] * error[j]


@kernel()
def run_predictor(
    p: PlanarParameters,
    commands: Array,
    measured: Array,
    yaw_rate: Array,
    period: float,
    instants: Array,
    substeps: int,
    lead: float,
    gains: Array,
    pushes: Array,
    decay: Array,
    summed: float,
    errors: Array,
    states: Array,
) -> None:
    """Predict a recording, measurement by measurement.

    Args:
        p: the planar model. commands: (T,); measured: (T + 1, 4); yaw_rate: (T + 1,), as of `Recording`.
        period: control period [s]. substeps: physics steps of one. lead: as of `read_sensors`.
        instants: (T + 1,) of an uneven loop [s], as of `hold`: each of its periods is integrated over its own length.
        gains: (G, S, 4), of the first G instants, the last one for all that follow. Rows: tilt, wheel, tilt rate, wheel
            speed; then tilt and tilt rate of one control period before, and of two; with a model discrepancy, its
            six components, as of `NoiseModel`.
        pushes: (2, 4), what the torques of the discrepancy add to tilt, wheel, tilt rate and wheel speed in a period.
        decay: (6,) of the discrepancy in a period; empty without one. summed: as of `LinearPlanarModel` [s].
        errors: (T + 1, 4), written: measured less predicted; 0 at the first instant; NaN from where it diverges.
        states: (T + 1, 19), written: `PlanarState` after the correction, and as of `STATE_COLUMNS`; likewise.
    """
    nominal = k = constants(p, period / substeps)
    late = max(floor(k.imu_delay / k.step), 0)
    s = _first(p, k, measured[0], lead)
    heading, now, facing = 0.0, 0, sine_and_cosine(0.0)
    missing, error, imu = np.zeros(LASTING), np.zeros(4), imu_settled(k, s, periods_kept(k, substeps) * substeps)
    for n in range(len(measured)):
        if n > 0:
            now = now + substeps if now + substeps < len(imu) else 0  # n substeps % len(imu)
            turning = Turning(0.5 * (yaw_rate[n - 1] + yaw_rate[n]), heading, facing.cosine, facing.sine)
            lasts, time = period, n * substeps * k.step
            if len(instants) > 0:
                lasts, time = instants[n] - instants[n - 1], instants[n]
                behind = steps_behind(instants, n, nominal.imu_delay, period, substeps, len(imu))
                k = with_step(nominal, lasts / substeps, behind * lasts / substeps)
                late = floor(behind)
            before = s
            s = hold(p, k, s, commands, n - 1, substeps, turning, imu, instants)
            heading += lasts * turning.rate
            facing = sine_and_cosine(heading)
            if len(instants) > 0:
                s = _with_one_lead(k, before, s, 0.5 * (lasts - period) / substeps, facing, imu, now)
            if len(decay) > 0:
                s = _push(s, k, missing, pushes, facing, imu, now, substeps, late)
                _carry(missing, decay, summed)
            seen = read_sensors(p, k, s, imu, n * substeps, lead, time)
            if rarely(not _compare(measured[n], seen, missing, error)):
                errors[n:, :] = states[n:, :] = nan
                return
            instant = min(n, len(gains) - 1)
            _correct_missing(missing, gains[instant], error, len(decay))
            tilt, wheel = _gained(gains[instant, 0], error), _gained(gains[instant, 1], error)
            tilt_rate, speed = _gained(gains[instant, 2], error), _gained(gains[instant, 3], error)
            s = moved(s, k, tilt, wheel, tilt_rate, speed, facing)
            imu[now, 0], imu[now, 1] = imu[now, 0] + tilt, imu[now, 1] + tilt_rate
            if late >= substeps:  # the call costs as much as a physics step even where it does nothing
                _correct_past(imu, now, n * substeps, substeps, late, gains, instant, error)
        errors[n, :] = error
        for i in range(len(s)):
            states[n, i] = s[i]
        states[n, len(s)] = imu[now, 2]


class PredictorOutput(NamedTuple):
    """What the predictor makes of a recording.

    Attributes:
        errors: (T + 1, 4), measured less predicted from the instant before, in the order of `MEASURED`.
        states: (T + 1, 19), `PlanarState` after the correction, and as of `STATE_COLUMNS`.
    """

    errors: Array
    states: Array


def predict(
    planar: PlanarParameters, recording: Recording, substeps: int, lead: float, kalman: Filter
) -> PredictorOutput:
    """Run the predictor of a planar model with a filter over a recording; arguments as of `run_predictor`.

    Of an uneven loop the readings are predicted at the instants at which they were taken.
    """
    commands, measured, instants = recording.commands, recording.measured, EVEN
    if recording.uneven is not None:
        loop = recording.uneven
        commands, measured, instants = (
            loop.commands,
            loop.read(planar.tilt_filter_rate, recording.period),
            loop.instants,
        )
    errors, states = np.empty((len(recording) + 1, 4)), np.empty((len(recording) + 1, STATE_COLUMNS))
    run_predictor(
        planar, commands, measured, recording.yaw_rate, recording.period, instants, substeps, lead, kalman.gains,
        kalman.pushes, kalman.decay, kalman.summed, errors, states,
    )  # fmt: skip
    return PredictorOutput(errors, states)
