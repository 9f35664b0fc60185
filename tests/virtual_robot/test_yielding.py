"""Which robots yield to pushes, and whether they are better off so."""

from math import radians

import numpy as np
import pytest
from analytic import linear

from twbal.algorithm.robustness import trial_verdict
from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.course import Standing, standing_targets
from twbal.core.episode import Outcome, Provenance
from twbal.core.evaluation import SuccessCriterion
from twbal.core.feed_forward import FeedForward
from twbal.core.mobility import leaning_acceleration
from twbal.core.motion_limits import MotionLimits
from twbal.core.start_pose import StartPose
from twbal.core.yielding import yields_to_pushes
from twbal.policies.linear import LinearPolicy
from twbal.virtual_robot.pushed_robot import PushedRobot

PUSH, DURATION, END = 3.0, 0.1, 10.0  # s: when, for how long, and when a rollout ends


@pytest.mark.parametrize(
    ("sheet", "yields"), [("balboa", True), ("tumbller", True), ("paper", False), ("upkie", False)]
)
def test_a_robot_yields_by_default_where_a_push_carries_its_body_along(sheet, yields, conf):
    robot = conf(f"robot/{sheet}")
    assert [yields_to_pushes(asked, robot) for asked in (None, True, False)] == [yields, True, False]


def test_a_robot_that_comes_back_from_a_push_brakes_in_a_lean_of_10_degrees_at_most(conf):
    balboa, esp32 = (Standing.of_robot(conf(f"robot/{sheet}")).limits for sheet in ("balboa", "esp32"))
    assert balboa.acceleration == pytest.approx(leaning_acceleration(conf("robot/balboa"), radians(10.0)))
    assert balboa.acceleration > 1.9 * MotionLimits.of_robot(conf("robot/balboa")).acceleration
    assert esp32.acceleration <= leaning_acceleration(conf("robot/esp32"), radians(10.0)) + 1e-9


def pushed(robot, parameters, strong):
    """A robot that is pushed by so many N·s for each kg, the regulator of its truth, and that one's state."""
    channels = Channels(("tilt", "tilt_rate", "speed", "position"), parameters.wheel_radius, parameters.control_period)
    gain = linear(robot.truth).gain(parameters.control_period, parameters.torque_limit, position=True)
    policy = LinearPolicy(channels.names, np.array(gain), 0.0, parameters.torque_limit)
    return PushedRobot(robot, PUSH, DURATION, strong * parameters.body_mass), policy, channels


@pytest.mark.parametrize(("sheet", "strong"), [("balboa", 2.0), ("tumbller", 1.5)])
def test_a_robot_that_yields_by_default_survives_a_push_that_throws_it_over_if_it_resists(sheet, strong, make, conf):
    """Under the regulator of the truth, which has a gain of the place; `strong` is in N·s for each kg."""
    parameters = conf(f"robot/{sheet}")
    plant, policy, channels = pushed(make(sheet, start=StartPose(0.0, 0.0, 0.0, 0.0)), parameters, strong)

    def driven(yields):
        return rollout(
            plant=plant,
            policy=policy,
            channels=channels,
            steps=round(END / parameters.control_period),
            tilt_limit=radians(30.0),
            provenance=Provenance(sheet, "robot"),
            targets=standing_targets(yields, parameters, channels.names),
            feed_forward=FeedForward.of_robot(parameters),
        )

    episode = driven(None)
    assert episode.outcome is Outcome.COMPLETED
    assert np.abs(episode.poses[-round(1.0 / parameters.control_period) :, 0]).max() < 0.08  # back in its place
    assert driven(False).outcome is Outcome.TILT_LIMIT


def test_methods_are_compared_on_robots_that_yield_by_their_sheet(make, conf):
    parameters = conf("robot/balboa")
    plant, policy, channels = pushed(make("balboa", start=StartPose(0.0, 0.0, 0.0, 0.0)), parameters, 2.0)
    rule = SuccessCriterion.in_seconds(
        tilt_limit=radians(30.0),
        settled_tilt_limit=radians(10.0),
        duration=6.0,
        settle_time=2.0,
        place_time=5.0,
        place_radii=2.0,
        command_change=0.5,
        control_period=parameters.control_period,
        wheel_radius=parameters.wheel_radius,
        torque_limit=parameters.torque_limit,
    )
    verdict = trial_verdict(plant, policy, channels, parameters, 0, rule)
    assert verdict.upright
    assert verdict.in_place
