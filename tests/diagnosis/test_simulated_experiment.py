"""An experiment on the planar model is what the planar robot does under its commands."""

from dataclasses import replace

import numpy as np
import pytest

from twbal.core.start_pose import StartPose
from twbal.diagnosis.experiments import Experiment, simulate
from twbal.effects.imu_delay import ImuDelay
from twbal.effects.library import values_of
from twbal.planar.parameters import planar_parameters
from twbal.planar.planar_plant import PlanarPlant
from twbal.sysid.model import Data, Model
from twbal.sysid.noise import LASTING, NoiseModel
from twbal.sysid.recording import Recording


@pytest.mark.parametrize("late", [0.0, 0.5, 5.3])
def test_a_late_imu_shows_what_it_has_seen_that_long_ago(paper, late):
    robot, substeps = replace(paper, control_period=0.002), 5
    effects, none = [ImuDelay(late * robot.control_period)], np.zeros(0)
    planar = planar_parameters(robot, values_of(effects))
    sensed = np.ones(4, bool)
    empty = Recording("r", robot.control_period, none, np.zeros((1, 4)), np.zeros(1), np.ones(1, bool), sensed)
    data = Data([empty], substeps)
    model = Model(planar, data.lead, NoiseModel(np.zeros(4), np.zeros(2), np.zeros(LASTING)))
    recording = simulate(Experiment(0.1, 0.03, 0.06, 0.2), robot, model, data, 0).recording
    start = StartPose(0.05, 0.0, 0.0, 0.0)
    step = robot.control_period / substeps
    with PlanarPlant(robot=robot, effects=effects, start=start, physics_step=step, seed=0) as plant:
        seen = np.array([plant.reset(0), *(plant.step(u) for u in recording.commands[:400])])[:, [1, 2, 4, 5]]
    assert recording.measured[:401] == pytest.approx(seen, abs=1e-6)
    assert np.ptp(seen[:, 1]) > 0.1
