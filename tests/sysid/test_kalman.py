"""The Kalman filter of the linear model, beside the joint normal distribution of all measurements of a short record."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from twbal.planar.parameters import planar_parameters
from twbal.sysid.kalman import covariances, linearise_period, riccati
from twbal.sysid.noise import LASTING, NoiseModel
from twbal.sysid.noise_fit import refilter

SENSORS, TORQUES = np.array([0.003, 0.02, 0.001, 0.05]), np.array([0.1, 0.05])
LASTS = np.array([0.02, 0.03, 0.002, 0.01, 0.001, 0.0015])
INSTANTS = 12


def joint_covariance(linear, of):
    """Of the measurements of all instants but the first, (4 n, 4 n), by the powers of F."""
    states = [of.first]
    for _ in range(INSTANTS):
        states.append(linear.F @ states[-1] @ linear.F.T + of.process)
    found = np.zeros((INSTANTS, 4, INSTANTS, 4))
    for i in range(INSTANTS):
        for j in range(i, INSTANTS):
            later = np.linalg.matrix_power(linear.F, j - i)
            found[i, :, j] = linear.C @ states[i + 1] @ later.T @ linear.C.T + (i == j) * of.sensors
            found[j, :, i] = found[i, :, j].T
    return found.reshape(4 * INSTANTS, 4 * INSTANTS)


@pytest.mark.parametrize("lasts", [np.zeros(LASTING), LASTS], ids=["white", "with a model discrepancy"])
def test_prediction_errors_have_the_density_of_all_measurements_together(paper, lasts):
    linear = linearise_period(planar_parameters(paper, {"imu_delay": {"delay": 0.013}}), paper.control_period)
    if lasts.any():
        linear = linear.with_discrepancy(paper.control_period, 3.0, 0.5)
    of = covariances(linear, NoiseModel(SENSORS, TORQUES, lasts))
    gains, whiteners, determinants, *_ = riccati(
        linear.F, linear.C, of.process, of.sensors, of.first, INSTANTS + 1, 0.0
    )
    together = joint_covariance(linear, of)
    measured = np.random.default_rng(0).multivariate_normal(np.zeros(4 * INSTANTS), together)
    nothing = np.zeros_like(gains)  # a model that predicts 0 throughout errs by the measurements
    errors = refilter(linear.F, linear.C, nothing, gains, np.vstack([np.zeros(4), measured.reshape(-1, 4)]))
    white = np.einsum("nij,nj->ni", whiteners, errors)[1:]
    found = np.sum(white**2) + np.sum(determinants[1:]) + 4 * INSTANTS * np.log(2.0 * np.pi)
    expected = -2.0 * multivariate_normal(np.zeros(4 * INSTANTS), together).logpdf(measured)
    assert found == pytest.approx(expected, abs=1e-6)
