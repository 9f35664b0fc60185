"""Robots of a parameter distribution, and the rule and the state that tests drive them with."""

from dataclasses import replace

import numpy as np

from twbal.core.channels import Channels
from twbal.core.cost import cost_over
from twbal.core.evaluation import SuccessCriterion
from twbal.core.start_pose import StartPose
from twbal.planar.robot_distribution import prior_of
from twbal.search.margin import Margin
from twbal.search.robust import RobustSettings, SampledRobots
from twbal.search.start_state import start_state

NAMES = ("tilt", "tilt_rate", "speed", "command_1", "command_2", "position", "position_integral")
WIDTHS = {"tilt": 0.25, "tilt_rate": 2.5, "speed": 1.0, "position": 0.5, "position_integral": 0.5}
START = StartPose(-0.17453, 0.02, 0.05, 0.02)
SETTINGS = RobustSettings(
    robots=30,
    designs=2,
    screening=8,
    finalists=4,
    width_scales={"speed": 4.0, "position_integral": 4.0},
    position_scales=(1.0, 0.5),
    change_scales=(1.0, 0.25),
    command_widths=(1.0, 0.3),
    compensations=(0.0, 0.5, 1.0),
    compensation_tilt=0.015,
    improved=0,
    evaluations=60,
    improving=10,
    enough=0.0,
    doubt=1.0,
    margin=Margin(doubt=0.5, delay=1.0, noise=2.0, push=1.0, push_duration=0.1),
)


def rule_for(robot):
    return SuccessCriterion.in_seconds(
        tilt_limit=0.5236,
        settled_tilt_limit=0.17453,
        duration=8.0,
        settle_time=2.0,
        place_time=5.0,
        place_radii=1.0,
        command_change=0.1,
        control_period=robot.control_period,
        wheel_radius=robot.wheel_radius,
        torque_limit=robot.torque_limit,
    )


def sampled_robots(robot, known=None, names=NAMES, with_margin=False, **told):
    channels = Channels(names, robot.wheel_radius, robot.control_period)
    return SampledRobots(
        known or prior_of(robot),
        channels,
        cost_over(names, WIDTHS, 1.0, robot.torque_limit, 0.3),
        rule_for(robot),
        start_state(START, names),
        replace(SETTINGS, **told),
        0,
        with_margin=with_margin,
    )


def known_to_be(robot, spread=0.1, **means):
    """The distribution after rollouts that told much: its standard deviations are a tenth of the prior's."""
    prior = prior_of(robot)
    mean = np.array(prior.mean)
    for field, value in means.items():
        mean[prior.fields.index(field)] = value
    return replace(prior, mean=mean, covariance=spread**2 * prior.covariance)
