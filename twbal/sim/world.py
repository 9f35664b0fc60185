"""A PyBullet world with one robot on a plane.

Its contacts have no slop, or the robot falls 10 µm before the ground carries it, and its wheels spin meanwhile.
"""

from math import atan2, cos, sin

from twbal.core.engine import NEARLY, Engine, RobotMotion
from twbal.core.errors import ConfigError
from twbal.core.plant import Pose
from twbal.core.robot_model import EffectState, JointMotion, RobotModel
from twbal.core.robot_parameters import GRAVITY
from twbal.core.start_pose import InitialState
from twbal.core.swinging_part import swinging_part, without_part
from twbal.sim.bullet import Client, pybullet
from twbal.sim.bullet_robot import BulletRobot
from twbal.sim.gears import Gears
from twbal.sim.restart_state import RestartState
from twbal.sim.surroundings import OutsideForces

_LARGEST_STEP = 0.001
_START = Pose(0.0, 0.0, 0.0, 0.0)
_RESIDUAL = 1e-12  # of the contact solver; at PyBullet's 1e-7 the robot yaws by itself at 0.1 mrad/s


class World(Engine):
    """Integrates a robot by PyBullet.

    Friction of joints and tyres is that of `BulletRobot`, a slope is gravity that leans, and what swings on the body is
    a body of its own: all inside the engine. What the engine has no form for acts on it step by step: see `Gears` and
    `OutsideForces`.

    Args:
        model: the robot with its effects.
        physics_step: [s], at most 1 ms.

    Raises:
        ConfigError: the physics step is too long, a part that swings is too heavy, or PyBullet has no world left.
    """

    def __init__(self, model: RobotModel, physics_step: float) -> None:
        if not 0 < physics_step <= (1.0 + NEARLY) * _LARGEST_STEP:
            raise ConfigError(
                f"PyBullet rolls wheels rightly at physics steps of at most {_LARGEST_STEP} s; found {physics_step} s."
            )
        self._slope = model.ground.slope
        self._physics_step = physics_step
        self._gears = Gears(model, physics_step)
        self._surroundings = OutsideForces(model, self._gears.robot, physics_step)
        self._part = swinging_part(model)
        self._accelerations = 0.0, 0.0  # of wheels and body where a rollout begins, without torque
        self._model = model
        self._build()

    def _build(self) -> None:
        self._client = client = Client()
        client.setPhysicsEngineParameter(
            fixedTimeStep=self._physics_step,
            deterministicOverlappingPairs=1,
            contactSlop=0,
            solverResidualThreshold=_RESIDUAL,
        )
        ground = client.createMultiBody(0, client.createCollisionShape(pybullet.GEOM_PLANE))
        client.changeDynamics(ground, -1, lateralFriction=1)
        part, robot = self._part, self._gears.robot
        rigid = without_part(robot, part) if part else robot
        self._robot = BulletRobot(client, rigid, self._model, part, self._gears.geared)
        if self._surroundings.creeps:
            self._robot.let_slip()
        self._fresh = client.saveState()  # to restore it takes a hundredth of the time

    def reset(self, initial: InitialState, heading: float = 0.0) -> None:
        """Put the robot into the world as it was built, wheels on the ground and rolling at the initial speed.

        Args:
            initial: tilt, tilt rate and speed.
            heading: by which it looks away from where a slope rises, to the left [rad].
        """
        if self._robot.is_lost():  # PyBullet leaves out for good what was nowhere once
            self._client.close()
            self._build()
        self._put(initial, heading)
        if self._gears.feels_accelerations:  # rotors feel the accelerations of the step before
            self._accelerations = self._glide()
            self._put(initial, heading)
        self._gears.reset(accelerations=self._accelerations)
        self._surroundings.reset()

    def _put(self, initial: InitialState, heading: float) -> None:
        # Contacts are not a part of the state: they end where the robot is lifted off the ground.
        self._robot.lift()
        self._client.performCollisionDetection()
        self._client.restoreState(stateId=self._fresh)
        slope = self._slope  # the ground stays level and the vertical leans
        self._vertical = (sin(slope) * cos(heading), -sin(slope) * sin(heading), cos(slope))
        self._client.setGravity(*(-GRAVITY * part for part in self._vertical))
        self._robot.place(initial, rising=atan2(self._vertical[0], self._vertical[2]))
        self._robot.hold()

    def _glide(self) -> tuple[float, float]:
        """Take one physics step without torque and return the accelerations of wheels and body in it [rad/s²]."""
        before = self._robot.motion(self._vertical)
        self._client.stepSimulation()
        after = self._robot.motion(self._vertical)
        body = (after.tilt_rate - before.tilt_rate) / self._physics_step
        return body + (after.wheel_rate - before.wheel_rate) / self._physics_step, body

    def resume(self, restart: RestartState, time: float) -> None:
        """After a reset with its heading: be in the middle of a rollout.

        Args:
            restart: what that is beyond the initial state.
            time: since the rollout began [s].
        """
        self._robot.restart(restart)
        self._gears.reset(restart.rotor_ahead, restart.rotor_faster, restart.joints, self._accelerations)
        self._surroundings.reset(restart, time)

    def turn_at(self, yaw_rate: float) -> None:
        """Turn at a rate from now on, to the left [rad/s], whatever turned the robot."""
        self._robot.turn_at(yaw_rate)

    def advance(self, command: float, effect_state: EffectState, steps: int) -> None:
        """Take physics steps with half of the torque on each wheel's joint."""
        step, drive = self._client.stepSimulation, self._robot.drive
        if self._gears.needed or self._surroundings.needed or effect_state.joints or self._part:
            for _ in range(steps):
                self._act(effect_state.actuate(command), effect_state)
                step()
        elif effect_state.actuators:
            for _ in range(steps):
                drive(effect_state.actuate(command))
                step()
        else:
            for _ in range(steps):
                drive(command)
                step()

    def motion(self) -> RobotMotion:
        """The motion now, of the wheels what the encoders see."""
        return self._gears.seen(self._robot.motion(self._vertical))

    def pose(self) -> Pose:
        """Where the robot is now, in the frame in which `reset` put it down."""
        return self._robot.pose(self._vertical)

    def close(self) -> None:
        """Disconnect from PyBullet."""
        self._client.close()

    def _act(self, torque: float, effect_state: EffectState) -> None:
        """Give the engine all that it must have anew in each physics step.

        Args:
            torque: of the motors, as the actuators give it [N·m].
            effect_state: what acts in the joints.
        """
        motion = self._robot.motion(self._vertical)
        apart, apart_rate = self._robot.apart() if effect_state.joints or self._surroundings.pushes else (0.0, 0.0)
        pose = self.pose() if self._surroundings.pushes else _START
        in_joints = 0.0  # beside what the motors make; between wheels and body, whatever the gears' play
        if effect_state.joints:
            joint = JointMotion(motion.wheel_angle, motion.wheel_rate, apart, 1.0, apart_rate)
            in_joints = effect_state.turn(torque, joint) - torque
        if self._gears.friction_changes:
            self._robot.hold()
        self._robot.swing()
        passed = self._gears.pass_on(torque, motion)
        beside = self._gears.beside_joints(torque, passed)
        self._robot.drive(passed + in_joints, self._gears.rub(motion))
        on_wheels, on_body = self._gears.turn_rotors(passed + in_joints, beside, motion)
        on_body += beside
        if on_body:
            self._robot.turn_body(on_body)
        load = self._robot.load() if self._surroundings.creeps else 0.0
        around = self._surroundings.act(motion, pose, apart, load)
        on_wheels += around.on_wheels
        if on_wheels:
            self._robot.turn_wheels(on_wheels)
        if around.at_axle:
            self._robot.push(around.at_axle)
