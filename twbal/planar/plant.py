"""The analytic twin behind the seam."""

from twbal.engine.engine import Engine, EnginePlant, Motion
from twbal.engine.machine import Machine, Running
from twbal.planar.dynamics import PlanarState, coefficients, step
from twbal.robot.start_pose import Stance, StartPose


class PlanarEngine(Engine):
    """Integrates a machine by its planar equations of motion.

    Args:
        machine: the robot with its effects.
        physics_step: [s].
    """

    def __init__(self, machine: Machine, physics_step: float) -> None:
        self._coefficients = coefficients(machine.robot)
        self._radius = machine.robot.wheel_radius
        self._drive = machine.drive
        self._physics_step = physics_step
        self._state = PlanarState(0.0, 0.0, 0.0, 0.0)

    def reset(self, stance: Stance) -> None:
        """Stand at the stance, with the encoders at 0."""
        self._state = PlanarState(stance.tilt, stance.tilt, stance.tilt_rate, stance.speed / self._radius)

    def advance(self, command: float, running: Running, steps: int) -> None:
        """Take physics steps."""
        for _ in range(steps):
            torque = running.actuate(command)
            self._state = step(self._coefficients, self._drive, self._state, torque, self._physics_step)

    def motion(self) -> Motion:
        """The motion now; there is no turning in the plane."""
        state = self._state
        return Motion(
            tilt=state.tilt,
            tilt_rate=state.tilt_rate,
            speed=self._radius * state.wheel_speed,
            wheel_angle=state.wheel - state.tilt,
            wheel_rate=state.wheel_speed - state.tilt_rate,
            yaw_rate=0.0,
        )

    def close(self) -> None:
        """Nothing is held."""


class PlanarPlant(EnginePlant):
    """A robot with effects that drives straight ahead, integrated by its own equations.

    The same machine, start and seed give the same start poses and noise as they give the robot in the physics engine.

    Args:
        machine: the robot with its effects.
        start: where rollouts begin.
        physics_step: [s]; divides the control period.
        seed: of all randomness.

    Raises:
        ConfigError: the physics step does not divide the control period.
    """

    def __init__(self, *, machine: Machine, start: StartPose, physics_step: float, seed: int) -> None:
        super().__init__(machine, PlanarEngine(machine, physics_step), start, physics_step, seed)
