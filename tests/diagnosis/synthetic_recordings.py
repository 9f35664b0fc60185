"""Recordings of the planar model, driven by a regulator with excitation on top, at finer steps than the estimator's."""

import numpy as np
from scipy.linalg import solve_continuous_are

from twbal.core.start_pose import StartPose
from twbal.effects.library import effects_from
from twbal.planar.linearised import linearise
from twbal.planar.planar_plant import PlanarPlant
from twbal.sysid.recording import Recording

NOISE = {"tilt": 0.0035, "tilt_rate": 0.02, "wheel_angle": 0.001, "wheel_rate": 0.05}
UNSEEN = {"acceleration": 0.0, "yaw_rate": 0.0}
SHEET = {"body_mass": "factor", "body_inertia": "factor", "com_height": "factor", "wheel_radius": "factor"}
COLUMNS = [1, 2, 4, 5]


def regulator(robot):
    A, B = linearise(robot)
    effort = 10 / robot.torque_limit**2
    return B @ solve_continuous_are(A, B[:, None], np.diag([1, 0.1, 0.3]), np.array([[effort]])) / effort


def excitation(robot, periods, rng):
    """Multisine and pseudo-random binary torque [N·m], and the speed that is passing for [m/s]; (T,) each."""
    t, unit = robot.control_period * np.arange(periods), robot.torque_limit / 20
    waves = sum(
        np.sin(2 * np.pi * f * t + p) for f, p in zip(rng.uniform(0.2, 5, 8), rng.uniform(0, 6.3, 8), strict=True)
    )
    binary = np.repeat(rng.choice([-1.0, 0.0, 1.0], periods // 5 + 1), 5)[:periods]
    swing = np.sin(2 * np.pi * t / 9)
    return unit * (0.4 * waves + 1.5 * binary), 0.6 * np.sign(swing) * (np.abs(swing) > 0.3)


def synthetic_recording(robot, effects, seed, periods=2000, still=False, tolerance=0.03, torque_noise=0.0):
    """A recording of the robot with effects, its data sheet off by up to the tolerance; torques have noise [N·m]."""
    rng = np.random.default_rng(seed)
    true = {name: {key: 1 + tolerance * rng.uniform(-1, 1)} for name, key in SHEET.items()}
    plant = PlanarPlant(
        robot=robot,
        effects=effects_from({**true, **effects, "sensor_noise": {**NOISE, **UNSEEN}}),
        start=StartPose(0.0, 0.02, 0.1, 0.05),
        physics_step=robot.control_period / 80,
        seed=seed,
    )
    gain, (extra, speeds) = regulator(robot), excitation(robot, periods, rng)
    if still:
        extra, speeds = 0 * extra, 0 * speeds
    rows, commands = [plant.reset(0)], []
    for torque, wanted in zip(extra, speeds, strict=True):
        seen = rows[-1]
        speed = robot.wheel_radius * (seen.wheel_rate + seen.tilt_rate)
        command = torque - gain @ [seen.tilt, seen.tilt_rate, speed - wanted]
        commands.append(float(np.clip(command, -robot.torque_limit, robot.torque_limit)))
        rows.append(plant.step(commands[-1] + torque_noise * rng.normal()))
    seen = np.array(rows)
    still_going = np.ones(len(seen), bool)
    return Recording(
        f"ride {seed}",
        robot.control_period,
        np.array(commands),
        seen[:, COLUMNS],
        0 * seen[:, 6],
        still_going,
        np.ones(4, bool),
    )
