"""A robot about its balance as a GP model: its linear equations of motion, learned from samples without noise."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from twbal.core.channels import Channels
from twbal.core.cost import SaturatingCost
from twbal.core.evaluation import SuccessCriterion
from twbal.core.gaussian import Gaussian
from twbal.models.dynamics import DynamicsModel
from twbal.models.gp import condition
from twbal.planar.linearised import linearise
from twbal.search.task import SearchSettings, Task
from twbal.search.validation import Validation

TORQUE_LIMIT = 20.0
SPANS = {"tilt": 0.4, "tilt_rate": 2.0, "speed": 1.5, "command_1": 20.0, "command_2": 20.0}
SHARES = {0: (1.0,), 1: (0.4, 0.6), 2: (0.3, 0.5, 0.2)}  # of the torque: present command, the one before, ...


def discrete(robot, lags):
    """x' = A x + B u over (tilt, tilt rate, speed, past commands)."""
    A, B = linearise(robot)
    joint = scipy.linalg.expm(robot.control_period * np.block([[A, B[:, None]], [np.zeros((1, 4))]]))
    A_full, B_full = np.zeros((3 + lags, 3 + lags)), np.zeros(3 + lags)
    A_full[:3, :3] = joint[:3, :3]
    B_full[:3] = SHARES[lags][0] * joint[:3, 3]
    for k, share in enumerate(SHARES[lags][1:]):
        A_full[:3, 3 + k] = share * joint[:3, 3]
    if lags:
        B_full[3] = 1.0
    if lags == 2:
        A_full[4, 3] = 1.0
    return A_full, B_full


def with_place(A, B, dt):
    """The same with position, by the trapezoid rule of the speed, and its integral, by Euler's."""
    D = len(B)
    A_full, B_full = np.zeros((D + 2, D + 2)), np.zeros(D + 2)
    A_full[:D, :D], B_full[:D] = A, B
    A_full[D, :D], B_full[D] = dt / 2 * A[2], dt / 2 * B[2]
    A_full[D, 2] += dt / 2
    A_full[D, D] = A_full[D + 1, D + 1] = 1.0
    A_full[D + 1, D] = dt
    return A_full, B_full


@pytest.fixture(scope="session")
def make_system(paper):
    """A function that makes a model, and A and B of what it has learned.

    Args of it:
        lags: how many past commands act and are in the state.
        g: scale of a random difference model with variance; None for none.
        samples: of f.
        place: position and its integral are in the state, too.
    """

    def make(lags=0, g=None, samples=150, process=1e-6, sensors=1e-6, place=False):
        rng = np.random.default_rng(lags)
        names = ("tilt", "tilt_rate", "speed", "command_1", "command_2")[: 3 + lags]
        spans = np.array([*(SPANS[n] for n in names), TORQUE_LIMIT])
        A, B = discrete(paper, lags)
        inputs = rng.uniform(-1, 1, (samples, len(spans))) * spans
        targets = inputs @ np.column_stack([A, B]).T[:, :3] - inputs[:, :3]
        sd = targets.std(axis=0)
        f = condition(inputs, targets, np.tile(4.0 * spans, (3, 1)), (10.0 * sd) ** 2, (1e-3 * sd) ** 2)
        difference = None
        if g is not None:
            inputs = rng.uniform(-0.7, 0.7, (12, len(spans))) * spans
            targets = g * sd * np.sin(3.0 * (inputs / spans) @ rng.standard_normal((len(spans), 3)))
            difference = condition(inputs, targets, np.tile(spans, (3, 1)), (g * sd) ** 2, (0.1 * g * sd) ** 2)
        noises = [level * np.array([1.0, 30.0, 10.0]) for level in (process, sensors)]
        if place:
            names, (A, B) = (*names, "position", "position_integral"), with_place(A, B, paper.control_period)
        channels = Channels(names, 0.15, paper.control_period)
        return DynamicsModel(channels, f, difference, False, *noises), A, B

    return make


SETTINGS = SearchSettings(
    horizon=40,
    short_horizon=15,
    iterations=12,
    short_iterations=8,
    restarts=2,
    long_horizon=80,
    long_iterations=4,
    min_success_rate=0.0,
    linearisation_amplitudes=(0.3,),
    lqr_command_widths=(1.0, 0.3),
    gain_scales=(1.0, 0.5),
    weight_penalty=1e-4,
    particles=0,
    tolerance=1e-5,
    degrees=(2, 4),
)
VALIDATION = Validation(
    robots=20,
    features=60,
    success=SuccessCriterion(tilt_limit=0.5236, settled_tilt_limit=0.1745, settle_step=60, steps=150),
)
WIDTHS = np.array([0.25, 2.5, 1.0, 20.0])
START_SD = np.array([0.02, 0.05, 0.02, 0.0])


@pytest.fixture(scope="session")
def make_task():
    """A function that makes a short task of models; settings that it is told are other than usual."""

    def make(*models, seed=0, **told):
        D = len(models[0].channels.names)
        start = Gaussian(np.array([-0.17, 0.0, 0.0, 0.0])[:D], np.diag(START_SD[:D]) ** 2)
        free = np.full(max(D - len(WIDTHS), 0), np.inf)
        cost = SaturatingCost(np.zeros(D), np.append(WIDTHS[:D], free))
        return Task(models, start, cost, replace(SETTINGS, **told), VALIDATION, seed)

    return make
