"""Logs of planar robots whose simulation is known, for evaluations."""

import numpy as np
from synthetic_recordings import synthetic_recording

from twbal.core.episode import Episode, Outcome, Provenance
from twbal.diagnosis.evaluation_inputs import EvaluationSettings, GivenLog, GivenSimulation

TRUE = {"coulomb_friction": {"torque": 0.3}, "actuation_delay": {"delay": 0.02}}
WRONG = {"viscous_friction": {"coefficient": 0.5}, "com_offset": {"angle": 0.1}}


def settings(**more):
    known = {
        "horizons": [0.02, 0.1, 0.2],
        "spacing": 0.1,
        "starts": 1000,
        "settling": 0.5,
        "model_error": 0.3,
        "tilt_offset": 0.0,
        "substeps": 10,
        "blocks": 10,
        "min_block": 1.0,
        "max_yaw_rate": 1.5,
        "max_tilt": 0.7,
        "seed": 0,
    }
    return EvaluationSettings(**{**known, **more})


def given(name, effects, found_on=()):
    return GivenSimulation(name, f"{name}.yaml", effects, {sha256: sha256 for sha256 in found_on})


def log(robot, effects, seed, periods=1000, name="", still=False):
    """A log of a robot that is as its sheet says, with effects."""
    recording = synthetic_recording(robot, effects, seed=seed, periods=periods, tolerance=0.0, still=still)
    count = len(recording) + 1
    seen = np.zeros((count, 7))
    seen[:, 0] = robot.control_period * np.arange(count)
    seen[:, [1, 2, 4, 5]] = recording.measured
    states, source = seen[:, 1:2], Provenance(robot.name, "robot")
    episode = Episode(("tilt",), robot.control_period, seen, states, recording.commands, Outcome.COMPLETED, source)
    return GivenLog(name or f"log {seed}", f"{seed}.mcap", f"sha of {seed}", episode)
