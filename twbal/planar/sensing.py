"""What the sensors make of the planar model's motion."""

from math import floor

import numpy as np

from twbal.core.compiled import kernel, rarely
from twbal.core.gaussian import Array
from twbal.core.robot_model import Reading
from twbal.core.robot_parameters import GRAVITY
from twbal.effects.tilt_filter import HIGHEST, PitchMotion, beyond_linear, counted, unseen_turn
from twbal.planar.constants import Constants
from twbal.planar.parameters import PlanarParameters
from twbal.planar.planar_state import PlanarState
from twbal.planar.terms import sense

_PER_GRAVITY = 1.0 / GRAVITY  # [s²/m]


@kernel(is_inlined=True)
def _misleading(k: Constants, s: PlanarState) -> float:
    """What a filter of the tilt makes an error of as it changes, and forgets at its rate; see `TiltFilter` [rad]."""
    return k.filter.lead * s.tilt_rate - (k.radius * s.wheel_speed + s.slip) * (k.filter.rate * _PER_GRAVITY)


@kernel(is_inlined=True)
def filtered_tilt(k: Constants, s: PlanarState, forgotten: float) -> float:
    """Tilt that a filter shows, which has forgotten so much of what misleads it [rad]."""
    return s.tilt + _misleading(k, s) - forgotten


@kernel()
def ring_length(k: Constants, substeps: int) -> int:
    """Rows of the IMU's past that are read by an IMU that is late, and by a filter that sums late readings."""
    return substeps * (2 + int(k.imu_delay / (substeps * k.step))) + 1


@kernel()
def periods_kept(k: Constants, substeps: int) -> int:
    """Control periods of the IMU's past that are read by what moves the past along, period by period; four at least.

    Args:
        k: constants of the planar model.
        substeps: physics steps of a control period.
    """
    return max(3 + int(k.imu_delay / (substeps * k.step)), 4)


@kernel()
def imu_settled(k: Constants, s: PlanarState, rows: int) -> Array:
    """The IMU's past (rows, 4) where it has always seen the state `s`.

    Its columns are the tilt behind the filter that it has, the tilt rate, what that filter has forgotten of what
    misleads it [rad], and the tilt rate without what corrected the state at once: of it the changes count alone.
    """
    imu = np.empty((rows, 4))
    imu[:, 0], imu[:, 1], imu[:, 2], imu[:, 3] = s.tilt, s.tilt_rate, _misleading(k, s), s.tilt_rate
    return imu


@kernel(is_inlined=True)
def see(
    p: PlanarParameters, k: Constants, before: PlanarState, s: PlanarState, imu: Array, row: int, kept: float,
    time: float,
) -> None:  # fmt: skip
    """Write to the ring what the IMU sees of a state.

    Args:
        p: the planar model.
        k: its constants.
        before: state a physics step ago.
        s: state now.
        imu: as of `read_sensors`.
        row: of the ring, which is written.
        kept: share of what misleads it that a filter of the tilt keeps in a physics step.
        time: since the rollout began [s].
    """
    if k.filter.rate == 0.0 and k.filter.lead == 0.0:  # nothing misleads
        imu[row, 0], imu[row, 1], imu[row, 2] = s.tilt, s.tilt_rate, 0.0
        return
    now, last = _misleading(k, s), row - 1 if row > 0 else len(imu) - 1
    imu[row, 2] = now - kept * (now - imu[last, 2])
    if k.filter.rate > 0.0:
        gyro = sense(p, Reading(0.0, s.tilt_rate, 0.0, 0.0), time).tilt_rate  # which the filter adds up
        imu[row, 2] -= k.step * (gyro - s.tilt_rate)
    imu[row, 0], imu[row, 1] = filtered_tilt(k, s, imu[row, 2]), s.tilt_rate
    imu[row, 3] = imu[last, 3] + (s.tilt_rate - before.tilt_rate)


_unseen_turn, _beyond_linear, _counted = kernel()(unseen_turn), kernel()(beyond_linear), kernel()(counted)


@kernel(is_inlined=True)
def _felt(k: Constants, s: PlanarState, faster_tilt: float) -> PitchMotion:
    """What a filter of the tilt feels; angles run ahead of rates by half a physics step, which their changes share."""
    return PitchMotion(s.tilt - 0.5 * k.step * faster_tilt, s.tilt_rate, k.radius * s.wheel_speed + s.slip)


@kernel()
def fuse(k: Constants, before: PlanarState, s: PlanarState, period: float, imu: Array, row: int) -> None:
    """Add what a filter of the tilt makes of a control period beyond what is linear; see `TiltFilter`.

    The filter of an IMU that is late adds up late readings of the gyro. So what their sum does not see is that of a
    late period; it is in all that the filter has shown since.

    Args:
        k: constants of the planar model, with a filter of the tilt.
        before: state at the beginning of the period.
        s: state now.
        period: control period [s].
        imu: as of `read_sensors`.
        row: of the ring, which is of now.
    """
    first, last = _felt(k, before, 0.0), _felt(k, s, s.tilt_rate - before.tilt_rate)
    highest = HIGHEST * k.radius
    late = k.imu_delay / k.step if k.filter.rate > 0.0 else 0.0  # else no sum, and nothing that it does not see
    unseen = _unseen_turn(period, first, last) if late == 0.0 else _late_turn(k, period, imu, row)
    summed = _counted(k.filter.rate) * unseen
    if rarely(late > 0.0):
        for back in range(1, min(floor(late) + 2, len(imu) - 1)):
            imu[row - back, 2] -= summed
            imu[row - back, 0] += summed
    imu[row, 2] -= summed + _beyond_linear(k.filter.rate, k.filter.lead, highest, period, first, last)
    imu[row, 0] = filtered_tilt(k, s, imu[row, 2])


@kernel()
def _late_turn(k: Constants, period: float, imu: Array, row: int) -> float:
    """As `unseen_turn`, of a period that ended when an IMU that is late has last seen the robot [rad].

    Args:
        k: constants of the planar model, with an IMU that is late.
        period: control period [s].
        imu: as of `read_sensors`.
        row: of the ring, which is of now.
    """
    steps = round(period / k.step)
    back = k.imu_delay / k.step
    whole = floor(back)
    share = back - whole
    if whole + steps + 2 > len(imu):
        return 0.0
    first = (1.0 - share) * imu[row - whole - steps, 3] + share * imu[row - whole - steps - 1, 3]
    last = (1.0 - share) * imu[row - whole, 3] + share * imu[row - whole - 1, 3]
    turned = 0.0
    for i in range(steps):
        turned += (1.0 - share) * imu[row - whole - i, 3] + share * imu[row - whole - i - 1, 3]
    turned -= 0.5 * (last - first)  # angles run ahead of rates by half a physics step
    return float(0.5 * period * (first + last) - k.step * turned)


@kernel(is_inlined=True)
def encoder_angle(k: Constants, s: PlanarState) -> float:
    """Angle that perfect encoders show, which may sit on the motors' shafts [rad]."""
    if rarely(k.play.is_behind_encoder > 0.0):
        return s.rotor - s.tilt
    return s.wheel - s.tilt


@kernel(is_inlined=True)
def read_sensors(
    p: PlanarParameters, k: Constants, s: PlanarState, imu: Array, steps: int, lead: float, time: float
) -> Reading:
    """Read the sensors.

    Between physics steps what the IMU sees is interpolated; before the rollout it saw what it sees at its start.

    Args:
        p: the planar model.
        k: its constants.
        s: state now.
        imu: (N, 4), a ring: row i % N holds what the IMU sees after i physics steps, `steps` being now; see
            `imu_settled`.
        steps: physics steps since the rollout began.
        lead: time by which the integrator's angles run ahead of the truth [s]; 0 to read what the integrator has.
        time: since the rollout began [s].
    """
    back = k.imu_delay / k.step
    whole = floor(back)
    share = back - whole
    near = max(steps - whole, 0) % len(imu)
    far = near if steps <= whole else near - 1 if near > 0 else len(imu) - 1  # cheaper than another remainder
    tilt = (1.0 - share) * imu[near, 0] + share * imu[far, 0]
    rate = (1.0 - share) * imu[near, 1] + share * imu[far, 1]
    relative = s.wheel_speed - s.tilt_rate
    if rarely(k.play.is_behind_encoder > 0.0):
        relative = s.rotor_speed - s.tilt_rate
    truth = Reading(tilt - lead * rate, rate, encoder_angle(k, s) - lead * relative, relative)
    return sense(p, truth, time)


@kernel()
def sensor_slopes(p: PlanarParameters) -> Array:
    """Derivative of what sensors show by what there is, (4, 4), by differences from 0."""
    zero = sense(p, Reading(0.0, 0.0, 0.0, 0.0), 0.0)
    slopes, eye = np.empty((4, 4)), np.eye(4)
    for i in range(4):
        seen = sense(p, Reading(eye[i, 0], eye[i, 1], eye[i, 2], eye[i, 3]), 0.0)
        for j in range(4):
            slopes[j, i] = seen[j] - zero[j]
    return slopes
