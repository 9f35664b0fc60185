"""Sums of basis functions in vector loops, beside the GPs and the cosines that they stand for."""

import os
import subprocess
import sys

import numpy as np
import pytest

from twbal.models.function_samples import FunctionSamples
from twbal.models.gp import condition
from twbal.search.basis_sums import add_sums, bells, nothing, waves

ROBOTS = 5
FOLLOWED = np.array([0, 2, 4])


@pytest.fixture(scope="module")
def make_gp():
    """A function that makes GPs of d inputs in unlike units, far from 0, with 2 outputs, from n samples."""

    def make(d, n):
        rng = np.random.default_rng(d)
        spans = 10.0 ** rng.uniform(-1, 1, d)
        inputs = 30.0 * spans + spans * rng.uniform(-1, 1, (n, d))
        scales = spans * rng.uniform(0.4, 2.0, (2, d))
        return condition(inputs, rng.standard_normal((n, 2)), scales, np.array([4.0, 0.5]), np.array([0.1, 0.2]))

    return make


def inputs_of(gp, seed=0):
    """Near the GP's centres, one of them on a centre and one far away."""
    rng = np.random.default_rng(seed)
    found = gp.centres[:ROBOTS] + 0.3 * gp.length_scales[0] * rng.standard_normal((ROBOTS, gp.inputs))
    found[0], found[2] = gp.centres[0], gp.centres[0] + 500.0 * gp.length_scales[0]
    return found


def added(basis, inputs):
    """What `add_sums` adds for the robots that are followed; the others must stay as they are."""
    totals = np.full((ROBOTS, 2), 7.0)
    add_sums(basis, inputs, FOLLOWED, totals)
    left_alone = np.setdiff1d(np.arange(ROBOTS), FOLLOWED)
    np.testing.assert_array_equal(totals[left_alone], 7.0)
    return totals[FOLLOWED] - 7.0


@pytest.mark.parametrize("d", [1, 5, 6, 7, 9])
@pytest.mark.parametrize("n", [5, 32, 45])
def test_bells_with_shared_weights_are_the_posterior_mean(make_gp, d, n):
    gp = make_gp(d, n)
    inputs = inputs_of(gp)
    found = added(bells(gp, gp.weights[:, :, None]), inputs)
    np.testing.assert_allclose(found, gp.mean(inputs)[FOLLOWED], atol=1e-12)
    assert np.abs(found[0]).max() > 0.01
    np.testing.assert_array_equal(found[1], 0.0)


@pytest.mark.parametrize("d", [1, 6, 8])
@pytest.mark.parametrize("features", [1, 40])
def test_waves_and_bells_together_are_the_sampled_functions(make_gp, d, features):
    gp = make_gp(d, 45)
    samples = FunctionSamples.draw(gp, ROBOTS, features, np.random.default_rng(1))
    inputs = inputs_of(gp)
    found = added(waves(samples), inputs) + added(bells(gp, samples.corrections), inputs)
    # ω · x is some 1000 here, of which a cosine keeps 1e-13
    np.testing.assert_allclose(found, samples(inputs)[FOLLOWED], atol=3e-12)


def test_bells_and_waves_are_right_to_the_last_digits(make_gp):
    gp = make_gp(3, 64)
    samples = FunctionSamples.draw(gp, ROBOTS, 64, np.random.default_rng(1))
    inputs = inputs_of(gp)
    exact = np.longdouble
    x = inputs.astype(exact)[FOLLOWED]
    for a in range(2):
        lengths, centres = gp.length_scales[a].astype(exact), gp.centres.astype(exact)
        distances = (((x[:, None] - centres) / lengths) ** 2).sum(axis=-1)
        terms = gp.signal_variance[a].astype(exact) * np.exp(-0.5 * distances)
        found = np.zeros((ROBOTS, 2))
        add_sums(bells(gp, np.ones((2, 64, 1))), inputs, FOLLOWED, found)
        np.testing.assert_allclose(found[FOLLOWED, a], terms.sum(axis=1).astype(float), rtol=3e-14, atol=1e-290)
        angles = x @ samples.frequencies[a].T.astype(exact) + samples.phases[a]
        expected = np.einsum("nm,mn->n", np.cos(angles), samples.features[a][:, FOLLOWED].astype(exact))
        size = np.abs(samples.features[a][:, FOLLOWED]).sum(axis=0) * np.abs(angles).max(axis=1).astype(float)
        gaps = np.abs(added(waves(samples), inputs)[:, a] - expected.astype(float))
        assert (gaps <= 1e-15 * size + 1e-14).all()


def test_nothing_adds_nothing():
    np.testing.assert_array_equal(added(nothing(2, 4), np.ones((ROBOTS, 4))), 0.0)


DIGEST = """
import hashlib
import numpy as np
from twbal.models.function_samples import FunctionSamples
from twbal.models.gp import condition
rng = np.random.default_rng(0)
gp = condition(rng.standard_normal((301, 6)), rng.standard_normal((301, 3)), np.ones((3, 6)), np.ones(3), np.ones(3))
gp = type(gp)(**{**gp.to_payload(), "weights": rng.standard_normal((3, 301)), "variance_matrix":
    rng.standard_normal((3, 301, 301))})
samples = FunctionSamples.draw(gp, 30, 200, rng)
print(hashlib.sha256(samples.corrections.tobytes()).hexdigest())
"""


def test_sampled_functions_have_the_same_digits_on_any_number_of_threads():
    found = set()
    for threads in ("1", "2"):
        env = {**os.environ, **dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), threads)}
        done = subprocess.run([sys.executable, "-c", DIGEST], env=env, capture_output=True, text=True, check=True)
        found.add(done.stdout)
    assert len(found) == 1
