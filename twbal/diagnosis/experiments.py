"""Experiments that a balancing robot can do with `real-rollout experiment=excite`, and what a model does under them."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import islice
from typing import NamedTuple

import numpy as np

from twbal.core.compiled import kernel
from twbal.core.gaussian import Array
from twbal.core.motion_limits import MotionLimits
from twbal.core.robot_parameters import RobotParameters
from twbal.core.streams import Stream, generator
from twbal.planar.actuation import EVEN
from twbal.planar.constants import Constants, constants
from twbal.planar.parameters import PlanarParameters
from twbal.planar.planar_plant import hold, standing
from twbal.planar.planar_state import STRAIGHT, PlanarState
from twbal.planar.sensing import imu_settled, periods_kept, read_sensors
from twbal.policies.excitation import Excitation, ExcitationLaw, excited_command
from twbal.search.excited import excited_regulator
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import UNSENSED
from twbal.sysid.recording import Recording

SECONDS = 10.0
"""Of an episode [s]."""

CHANNELS = ("tilt", "tilt_rate", "speed")
WIDTHS = (0.1, 1.0, 1.0)
"""Deviations of the channels that cost alike in `policy=excite` [rad, rad/s, m/s]."""
FADE_TILT = 0.25
"""Where its disturbance has faded [rad]."""

_START_TILT = 0.05  # rad; by which a person is off who puts the robot upright
_MOST_TILT = 0.35  # rad; two thirds of the tilt at which a rollout ends
_CUT = 0.02  # share of the control periods in which the torque limit may cut the command
_COMMAND_WIDTH = 0.1  # of a gentle regulator, under which most robots stay up
_MULTISINE, _PRBS = 0.03, 0.06  # of the usual disturbance, that of `policy=excite`
SIZES = (0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6)
"""Of the disturbance, in the usual one."""
_SLOW, _FAST = 0.25, 0.6  # shares of the sheet's speed limit


@dataclass(frozen=True)
class Experiment:
    """A way to shake a robot that balances: settings of `policy=excite`.

    Attributes:
        command_width: of the regulator, as a share of the torque limit; smaller is gentler.
        multisine: standard deviation, as a share of the torque limit.
        prbs: of the binary torque, likewise.
        speed: that is asked for, forth and back [m/s].
    """

    command_width: float
    multisine: float
    prbs: float
    speed: float

    def policy(self, robot: RobotParameters) -> Excitation:
        """The policy of a robot by its data sheet."""
        return excited_regulator(robot, CHANNELS, WIDTHS, **asdict(self), fade_tilt=FADE_TILT)

    def settings(self, period: float) -> Mapping[str, float | int]:
        """Of `real-rollout experiment=excite`, by key, for a control period [s]."""
        policy = {f"policy.{name}": value for name, value in asdict(self).items()}
        return {**policy, "steps": round(SECONDS / period)}


def experiments_of(robot: RobotParameters) -> tuple[tuple[Experiment, ...], ...]:
    """The candidates: for each speed, the same experiment with a disturbance of each of `SIZES`.

    The robot is asked to stand, to drive slowly, and to drive fast. Before them comes one that drives slowly without a
    disturbance.
    """
    limit = MotionLimits.of_robot(robot).speed
    shaken = [[(size, share) for size in SIZES] for share in (0.0, _SLOW, _FAST)]
    return tuple(tuple(_experiment(size, share * limit) for size, share in each) for each in ([(0.0, _SLOW)], *shaken))


def _experiment(size: float, speed: float) -> Experiment:
    return Experiment(_COMMAND_WIDTH, round(size * _MULTISINE, 4), round(size * _PRBS, 4), float(f"{speed:.2g}"))


class SimulatedExperiment(NamedTuple):
    """What a model does under an experiment.

    Attributes:
        recording: as a diagnosis would read it; None where the robot fell.
        most_tilt: largest true tilt [rad].
        cut: share of the control periods in which the torque limit cut the command.
    """

    recording: Recording | None
    most_tilt: float
    cut: float

    @property
    def is_safe(self) -> bool:
        """Whether the robot stays far from falling, and seldom meets its torque limit."""
        return self.recording is not None and self.most_tilt <= _MOST_TILT and self.cut <= _CUT


def simulate(
    experiment: Experiment, robot: RobotParameters, model: Model, data: Data, seed: int
) -> SimulatedExperiment:
    """Drive the planar model straight ahead for an episode, with the noise of the sensors as fitted.

    Args:
        experiment: under which.
        robot: data sheet, by which the policy balances.
        model: of the robot, with its noise.
        data: recordings that it was fitted to: their period, physics steps and channels are taken over.
        seed: of the noise, and of the disturbance.
    """
    steps, planar = round(SECONDS / data.period), model.planar
    k = constants(planar, data.period / data.substeps)
    lead = data.lead - model.angle_lead
    levels = np.where(model.noise.sensors < 0.5 * UNSENSED, model.noise.sensors, 0.0)
    noise = levels * generator(Stream.SENSOR_NOISE, seed).standard_normal((steps + 1, 4))
    policy = experiment.policy(robot)
    drawn = np.array(list(islice(policy.drawn(generator(Stream.EXPLORATION, seed)), steps)))
    state = standing(k, _START_TILT - k.offset, 0.0, 0.0, 0.0)
    imu = imu_settled(k, state, periods_kept(k, data.substeps) * data.substeps)
    commands, measured = np.zeros(steps), np.empty((steps + 1, 4))
    radius = robot.wheel_radius
    most, cut = _driven(
        planar, k, state, imu, policy.law, radius, drawn, noise, data.substeps, lead, commands, measured
    )
    if not most < np.pi / 2:
        return SimulatedExperiment(None, np.inf, cut)
    return SimulatedExperiment(_recording(commands, measured, data), most, cut)


@kernel()
def _driven(
    planar: PlanarParameters,
    k: Constants,
    state: PlanarState,
    imu: Array,
    law: ExcitationLaw,
    radius: float,
    drawn: Array,
    noise: Array,
    substeps: int,
    lead: float,
    commands: Array,
    measured: Array,
) -> tuple[float, float]:
    """Drive a model through an experiment, up to a fall: its largest tilt, and the share of commands that were cut.

    Args:
        planar, k, state, imu: as of `hold`.
        law: that drives it.
        radius: of the wheels by the sheet [m].
        drawn: (T, 2) the speed that is asked for, and the disturbance as a share of the torque limit.
        noise: (T + 1, 4) of the sensors.
        substeps, lead: as of `hold` and `read_sensors`.
        commands: (T,) is written [N·m].
        measured: (T + 1, 4) is written, in the order of `MEASURED`.
    """
    most, cut, steps = abs(state.tilt), 0, len(commands)
    for n in range(steps + 1):
        seen = read_sensors(planar, k, state, imu, n * substeps, lead, n * substeps * k.step)
        measured[n, 0], measured[n, 1] = seen.tilt + noise[n, 0], seen.tilt_rate + noise[n, 1]
        measured[n, 2], measured[n, 3] = seen.wheel_angle + noise[n, 2], seen.wheel_rate + noise[n, 3]
        if n == steps:
            break
        tilt, rate = measured[n, 0], measured[n, 1]
        speed = radius * (measured[n, 3] + rate)
        commands[n], is_cut = excited_command(law, tilt, rate, speed, drawn[n])
        cut += is_cut
        state = hold(planar, k, state, commands, n, substeps, STRAIGHT, imu, EVEN)
        most = max(most, abs(state.tilt))
        if not most < np.pi / 2:
            break
    return most, cut / steps


def _recording(commands: Array, measured: Array, data: Data) -> Recording:
    """As it would be read of a robot that does not turn."""
    count = len(measured)
    return Recording(
        name="simulated",
        period=data.period,
        commands=commands,
        measured=measured,
        yaw_rate=np.zeros(count),
        usable=np.ones(count, bool),
        sensed=data.sensed,
    )
