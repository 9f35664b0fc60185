"""Streams of one seed have nothing to do with each other."""

from itertools import combinations

import numpy as np
import pytest

from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.episode import Provenance
from twbal.core.start_pose import StartPose
from twbal.core.streams import Stream, child_seed, generator
from twbal.planar.planar_plant import PlanarPlant
from twbal.policies.exploring import ExploringPolicy
from twbal.policies.linear import LinearPolicy
from twbal.sim.bullet_plant import SimPlant

DRAWS, LAGS = 10_000, 100


def largest_correlation(left, right):
    """Largest |cross-correlation| of two series of unit variance at lags up to `LAGS`, by FFT."""
    size = 2 * len(left)
    spectrum = np.fft.rfft(left, size) * np.conj(np.fft.rfft(right, size))
    correlation = np.fft.irfft(spectrum, size) / len(left)
    return np.abs(np.concatenate([correlation[: LAGS + 1], correlation[-LAGS:]])).max()


@pytest.mark.parametrize("seed", [0, 7])
def test_no_two_streams_are_correlated_at_any_lag(seed):
    series = {f"{stream}, trial {trial}": generator(stream, seed, trial) for stream in Stream for trial in (0, 1)}
    series |= {str(stream): generator(stream, seed) for stream in Stream}
    series["start pose, next seed"] = generator(Stream.START_POSE, seed + 1, 0)
    series["start pose of the virtual robot"] = generator(Stream.START_POSE, child_seed(Stream.VIRTUAL_ROBOT, seed), 0)
    series["hidden robot"] = np.random.default_rng(seed)
    draws = {name: rng.standard_normal(DRAWS) for name, rng in series.items()}
    worst = max((largest_correlation(draws[a], draws[b]), a, b) for a, b in combinations(draws, 2))
    assert worst[0] < 0.05, worst


def test_correlated_streams_would_be_seen():
    draws = generator(Stream.START_POSE, 0).standard_normal(DRAWS + 50)
    assert largest_correlation(draws[:DRAWS], draws[50:]) > 0.9


def test_a_stream_repeats_by_its_name_seed_and_numbers():
    assert np.array_equal(generator(Stream.PARTICLES, 3, 1).random(5), generator(Stream.PARTICLES, 3, 1).random(5))
    assert child_seed(Stream.VIRTUAL_ROBOT, 3) == child_seed(Stream.VIRTUAL_ROBOT, 3)


@pytest.mark.parametrize("simulation", ["pybullet", "planar"])
def test_where_a_rollout_starts_says_nothing_of_its_exploration(paper, simulation):
    start = StartPose(tilt_mean=0.0, tilt_sd=0.02, tilt_rate_sd=0.05, speed_sd=0.02)
    channels = Channels(("tilt", "tilt_rate", "speed", "command_1", "command_2"), paper.wheel_radius)
    settings = {"robot": paper, "start": start, "physics_step": 0.001, "seed": 5}
    plant = (SimPlant if simulation == "pybullet" else PlanarPlant)(effects=[], **settings)
    silent = LinearPolicy(channels.names, np.zeros(5), 0.0, paper.torque_limit)
    policy = ExploringPolicy(silent, noise_sd=1.0, max_command=paper.torque_limit)
    starts, noises = [], []
    for trial in range(150):
        episode = rollout(plant, policy, channels, 3, 1.0, Provenance("paper", "simulation", seed=5, trial=trial))
        starts.append(episode.states[0, :3])
        noises.append(episode.commands)
    plant.close()
    correlations = np.corrcoef(np.array(starts).T, np.array(noises).T)[:3, 3:]
    assert np.abs(correlations).max() < 0.35  # four standard deviations of 150 independent pairs; it was 1.0
