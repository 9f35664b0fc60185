"""Steps of the plant beside those of a bare PyBullet loop: `python -m benchmarks.running.plant '<settings>'`.

The bare loop loads the same robot with the same settings, drives it with the same law, sets torques and steps 20 times
in a control period, and reads pose, velocities and joints once. It has no effects, no noise, no delay and no checks.
"""

import json
import sys
import time
from math import asin
from pathlib import Path
from statistics import median
from typing import Any

from hydra import compose
from hydra.utils import instantiate

from twbal.cli.composition import composing
from twbal.core.start_pose import StartPose
from twbal.sim.bullet import pybullet
from twbal.sim.bullet_plant import SimPlant
from twbal.sim.urdf import urdf_text

PHYSICS_STEP, SUBSTEPS = 0.001, 20
START = StartPose(0.0, 0.0, 0.0, 0.0)
NEAR = 1.0  # tilt [rad] inside which both must have stayed: a robot that lies has other contacts


def law(tilt: float, tilt_rate: float, wheel_rate: float) -> float:
    """Torque [N·m] that keeps the default robot upright."""
    return 60.0 * tilt + 12.0 * tilt_rate + 0.4 * wheel_rate


def ours(plant: SimPlant, periods: int) -> float:
    """CPU seconds of so many control periods."""
    seen = plant.reset(0)
    began = time.process_time()
    for _ in range(periods):
        seen = plant.step(law(seen.tilt, seen.tilt_rate, seen.wheel_rate))
    spent = time.process_time() - began
    if abs(seen.tilt) > NEAR:
        raise SystemExit("The robot of the plant fell.")
    return spent


class Bare:
    """The loop that a person would write."""

    def __init__(self, text: str, height: float) -> None:
        """Load the robot with its axle at `height` [m]."""
        self._client = pybullet.connect(pybullet.DIRECT)
        self._height = height
        self._file = Path("outputs") / "bare.urdf"
        self._file.parent.mkdir(exist_ok=True)
        self._file.write_text(text)

    def run(self, periods: int) -> float:
        """CPU seconds of so many control periods."""
        p, c = pybullet, self._client
        p.resetSimulation(physicsClientId=c)
        p.setPhysicsEngineParameter(
            fixedTimeStep=PHYSICS_STEP,
            deterministicOverlappingPairs=1,
            contactSlop=0,
            solverResidualThreshold=1e-12,
            physicsClientId=c,
        )
        p.setGravity(0, 0, -9.81, physicsClientId=c)
        ground = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE, physicsClientId=c), physicsClientId=c)
        p.changeDynamics(ground, -1, lateralFriction=1, physicsClientId=c)
        file, flags = str(self._file), p.URDF_USE_INERTIA_FROM_FILE
        robot = p.loadURDF(file, [0, 0, self._height], flags=flags, physicsClientId=c)
        for link in (-1, 0, 1):
            p.changeDynamics(
                robot, link, linearDamping=0, angularDamping=0, jointDamping=0, lateralFriction=1, physicsClientId=c
            )
        p.setJointMotorControlArray(robot, [0, 1], p.VELOCITY_CONTROL, forces=[0, 0], physicsClientId=c)
        tilt = rate = wheel_rate = 0.0
        began = time.process_time()
        for _ in range(periods):
            forces = [0.5 * max(-20.0, min(20.0, law(tilt, rate, wheel_rate)))] * 2
            for _ in range(SUBSTEPS):
                p.setJointMotorControlArray(robot, [0, 1], p.TORQUE_CONTROL, forces=forces, physicsClientId=c)
                p.stepSimulation(physicsClientId=c)
            _, orientation = p.getBasePositionAndOrientation(robot, physicsClientId=c)
            _, spin = p.getBaseVelocity(robot, physicsClientId=c)
            wheels = p.getJointStates(robot, [0, 1], physicsClientId=c)
            tilt, rate, wheel_rate = 2.0 * asin(orientation[1]), spin[1], wheels[0][1]
        spent = time.process_time() - began
        if abs(tilt) > NEAR:
            raise SystemExit("The robot of the bare loop fell.")
        return spent


def run(periods: int, repeats: int) -> dict[str, Any]:
    """Both, turn by turn; medians."""
    with composing():
        robot = instantiate(compose("sim_collect").robot)
    bare, spent = Bare(urdf_text(robot), robot.wheel_radius), []
    with SimPlant(robot=robot, effects=[], start=START, physics_step=PHYSICS_STEP, seed=0) as plant:
        for _ in range(repeats + 1):  # the first warms up
            spent.append((ours(plant, periods), bare.run(periods)))
    plant_s, bare_s = (median(each[i] for each in spent[1:]) for i in (0, 1))
    ratio = median(b / a for a, b in spent[1:])
    return {"periods_per_s": periods / plant_s, "bare_periods_per_s": periods / bare_s, "share_of_bare": ratio}


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
