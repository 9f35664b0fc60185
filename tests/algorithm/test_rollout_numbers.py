"""No two rollouts of a run have one number, as the number draws the start, the noise and the exploration."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from falling import falls_at_once

import twbal
from twbal.algorithm.in_memory import InMemory
from twbal.algorithm.iteration import PolicyFile
from twbal.algorithm.learning import Algorithm
from twbal.algorithm.steps import FittedDifference, Identified, Timed


class Numbering(InMemory):
    """Notes the numbers of rollouts, and makes nothing but names."""

    def __init__(self, setup):
        super().__init__(None, setup, lambda line: None)
        self.numbers = {}

    def drive(self, place, policy, conditions):
        self.numbers[place.as_posix()] = list(replace(self._setup.driving, **conditions.given).numbers)
        return (falls_at_once(self._setup.simulation.robot, 30),)

    def simulate(self, *_, **__):
        return ()

    def fit_simulation(self, place, rollouts):
        return Timed(place, 0.0)

    def fit_difference(self, place, bases, rollouts):
        return Timed(FittedDifference(place, 0, ()), 0.0)

    def identify(self, place, rollouts):
        return Timed(Identified("known", "simulation"), 0.0)

    def search(self, place, inputs):
        return Timed(SimpleNamespace(place=place), 0.0)

    def policy_file(self, policy):
        return PolicyFile(str(policy.place), str(policy.place))


def numbers(method):
    setup = twbal.setup("paper", [f"method={method}", "updates=2", "trials=1", "base_by_evidence=false"])
    steps = Numbering(setup)
    Algorithm(steps, setup.algorithm, setup.driving, setup.rule).run()
    return steps.numbers


@pytest.mark.parametrize("method", ["pilco", "twbal"])
def test_rollouts_of_a_run_have_numbers_of_their_own(method):
    found = [number for of_place in numbers(method).values() for number in of_place]
    assert len(found) > 8
    assert len(set(found)) == len(found)


def test_only_a_run_that_begins_at_random_counts_on_from_there():
    at_random, learned = numbers("pilco"), numbers("twbal")
    assert at_random["random/rollout"][0] == learned["iteration_0/rollout"][0] == 0
    assert at_random["iteration_0/rollout"] == [len(at_random["random/rollout"])]
