"""Random streams by name: one seed gives an independent generator for each purpose and each trial.

NumPy seeds from lists of numbers collide: `default_rng(7)`, `default_rng([7])` and `default_rng([7, 0])` give the same
numbers. Here the name of a stream is part of the spawn key of a `SeedSequence`, which is hashed apart from the seed.
"""

import hashlib
from enum import StrEnum

import numpy as np


class Stream(StrEnum):
    """What random numbers are drawn for. A name decides the numbers: a stream that is renamed draws others."""

    START_POSE = "start pose"
    SENSOR_NOISE = "sensor noise"
    TORQUE_NOISE = "torque noise"
    DOMAIN_RANDOMISATION = "domain randomisation"
    EXPLORATION = "exploration"
    FIT_RESTARTS = "fit restarts"
    FIT_SUBSET = "fit subset"
    SEARCH_STARTS = "search starts"
    PARTICLES = "particles"
    VALIDATION = "validation"
    SAMPLED_ROBOTS = "sampled robots"
    BOOTSTRAP = "bootstrap"
    VIRTUAL_ROBOT = "virtual robot"
    GROUND_TRUTH = "ground truth"
    PERTURBATION = "perturbation"
    ON_BOARD = "policy on board"


def generator(stream: Stream, seed: int, *numbers: int) -> np.random.Generator:
    """The generator of one stream.

    Args:
        stream: what is drawn.
        seed: of the run; not negative.
        numbers: which of the stream's generators, such as the number of a trial; none negative.
    """
    return np.random.default_rng(_sequence(stream, seed, *numbers))


def child_seed(stream: Stream, seed: int) -> int:
    """A seed of 64 bits for a part that draws streams of its own, independent of those of `seed`."""
    return int(_sequence(stream, seed).generate_state(1, np.uint64)[0])


def _sequence(stream: Stream, seed: int, *numbers: int) -> np.random.SeedSequence:
    name = int.from_bytes(hashlib.sha256(stream.encode()).digest()[:8], "little")
    return np.random.SeedSequence(seed, spawn_key=(name, *numbers))
