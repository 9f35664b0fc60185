"""The regulator with integral action that somebody makes who has the data sheet and nothing else."""

from dataclasses import replace
from typing import Any

from benchmarks.hidden_robots.record import trial_record
from benchmarks.hidden_robots.reference import drive
from benchmarks.hidden_robots.reference_law import Compensation, Design, Law
from benchmarks.hidden_robots.robots import Workshop

TRIALS = 10
_DESIGN = Design(torque=0.1, position=0.3, integral=10.0, friction=Compensation(0.0, 0.0, 1.0, False), disturbance=None)
"""Of the reference search's weights those that hold the moderate robots 900 and 901, which no table shows, best: gentle
ones, as a data sheet knows of no delay. Nor does it know of friction and noise."""


def regulator(shop: Workshop) -> Law:
    """That of the family's data sheet."""
    return Law(shop.ideal(), _DESIGN, shop.sheet.control_period)


def with_integral_action(shop: Workshop, seed: int) -> dict[str, Any]:
    """Trials of it on the robot `seed`, as the one iteration of a method that learns nothing."""
    law = regulator(shop)
    limit = shop.rules.default.tilt_limit
    upright = replace(shop.rules.default, settled_tilt_limit=limit, place_radii=None, command_change=None)
    with shop.robot(seed) as robot:
        episodes = [drive(robot, law, trial, upright) for trial in range(TRIALS)]
    trials = [trial_record(episode, shop.rules) for episode in episodes]
    seconds = sum(episode.duration for episode in episodes)
    return {"best": 0, "iterations": [{"index": 0, "real_seconds": 0.0, "trial_seconds": seconds, "trials": trials}]}
