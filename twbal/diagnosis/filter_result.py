"""What a model makes of recordings: the motion it sees in them, and what it did not expect."""

from collections.abc import Sequence

import numpy as np

from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.findings import Effects, FilterResult, Trajectory
from twbal.planar.constants import constants
from twbal.planar.parameters import planar_parameters
from twbal.sysid.kalman import error_variances
from twbal.sysid.model import Data, FreeParameter, Model, Offsets
from twbal.sysid.noise import NoiseModel
from twbal.sysid.open_loop import EARLIEST, predict_open_loop
from twbal.sysid.prediction_error_fit import descend
from twbal.sysid.recording import Recording

_OFFSET_STEPS = 6


def filter_recordings(
    robot: RobotParameters,
    effects: Effects,
    noise: NoiseModel,
    angle_lead: float,
    recordings: Sequence[Recording],
    substeps: int,
    offsets: tuple[Offsets, ...] | Sequence[FreeParameter] = (),
) -> FilterResult:
    """What a model with known values makes of recordings, whether it was fitted to them or not.

    Args:
        robot: data sheet.
        effects: all that the model has beyond it.
        noise: levels by which its filter weighs measurements.
        angle_lead: time by which measured angles run ahead of rates [s].
        recordings: at least one.
        substeps: physics steps of a control period.
        offsets: of each recording, or what is free of them; none where they are all 0.
    """
    data = Data(recordings, substeps)
    model = Model(planar_parameters(robot, effects), angle_lead, noise)
    return filter_result_of(data, with_offsets(data, model, offsets), effects)


def with_offsets(data: Data, model: Model, offsets: tuple[Offsets, ...] | Sequence[FreeParameter]) -> Model:
    """The model with these offsets, or with those that fit best; all else stays."""
    free_parameters = [offset for offset in offsets if isinstance(offset, FreeParameter)]
    if not free_parameters:
        return model._replace(offsets=tuple(offset for offset in offsets if isinstance(offset, Offsets)), balanced=0)
    start = model._replace(offsets=(Offsets(),) * len(data.recordings), balanced=0)
    return descend(data, start, data.filter(start), free_parameters, _OFFSET_STEPS).model


def one_step_errors(data: Data, model: Model, best: Model) -> tuple[Array, ...]:
    """Measured less what a model predicts of it from the motion that another one sees at the instant before.

    So the errors are those of the model alone: a filter of its own would be misled by what it gets wrong, or would take
    that for noise.

    Args:
        data: recordings.
        model: whose errors these are.
        best: whose filter says what the motion was.

    Returns:
        per recording (T + 1, 4) in the order of `MEASURED`; 0 at the first instants, which have too little past.
    """
    found = []
    for number, prediction in enumerate(data.predictions(best, data.filter(best))):
        recording = data.recordings[number]
        starts = np.arange(EARLIEST, len(recording))
        errors = np.zeros((len(recording) + 1, 4))
        ahead = predict_open_loop(
            model.planar_for(number),
            recording,
            data.substeps,
            recording.even_states(prediction.states),
            starts,
            np.zeros((len(starts), 8)),
            1,
            np.inf,
        )
        errors[EARLIEST + 1 :] = recording.measured[EARLIEST + 1 :] - ahead.readings[:, 0]
        errors[:, ~data.sensed] = 0.0
        found.append(errors)
    return tuple(found)


def filter_result_of(data: Data, model: Model, effects: Effects) -> FilterResult:
    """What a model makes of recordings; `effects` are its values as the simulation takes them."""
    kalman = data.filter(model)
    predictions = data.predictions(model, kalman)
    radius = constants(model.planar, data.period).radius
    trajectories = tuple(
        _trajectory(radius, data.lead, recording, recording.even_states(prediction.states))
        for recording, prediction in zip(data.recordings, predictions, strict=True)
    )
    errors = tuple(prediction.errors for prediction in predictions)
    return FilterResult(
        effects,
        trajectories,
        errors,
        np.sqrt(error_variances(kalman)),
        model.noise,
        model.angle_lead,
        model.apart.offsets,
        kalman.covariance,
        model.planar.tilt_filter_rate,
    )


def _trajectory(radius: float, lead: float, recording: Recording, states: Array) -> Trajectory:
    """The motion in the predictor's states (T + 1, 19), of wheels of a radius [m]; its angles run ahead by a time."""
    tilt, wheel, tilt_rate, wheel_speed, torque, rotor, rotor_speed, slip, position, _, *rest, _ = states.T
    sway, sway_rate, x, y, *dry = rest
    return Trajectory(
        tilt=tilt - lead * tilt_rate,
        tilt_rate=tilt_rate,
        speed=radius * wheel_speed + slip,
        wheel_angle=wheel - tilt - lead * (wheel_speed - tilt_rate),
        wheel_rate=wheel_speed - tilt_rate,
        position=position,
        x=x,
        y=y,
        torque=torque,
        gap=rotor - wheel,
        gap_rate=rotor_speed - wheel_speed,
        slip=slip,
        sway=sway,
        sway_rate=sway_rate,
        dry=np.column_stack(dry),
        yaw_rate=recording.yaw_rate,
        heading=recording.heading,
    )
