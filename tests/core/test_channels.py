import numpy as np
import pytest

from twbal.core.channels import Channels, StateTracker
from twbal.core.errors import ConfigError
from twbal.core.plant import Observation

SEEN = Observation(0.4, 0.1, -0.2, 3.0, 5.0, 2.0, 0.7)


def test_channels_come_in_the_order_of_their_names():
    channels = Channels(("yaw_rate", "acceleration", "tilt_rate", "tilt"), 0.15)
    assert StateTracker(channels).state(SEEN, []).tolist() == [0.7, 3.0, -0.2, 0.1]
    assert channels.units == ("rad/s", "m/s²", "rad/s", "rad")


def test_speed_is_that_of_the_axle_over_ground():
    rolling_with_the_body = SEEN._replace(
        wheel_rate=0.0, tilt_rate=2.0
    )  # encoders stand, the wheel turns with the body
    assert StateTracker(Channels(("speed",), 0.15)).state(rolling_with_the_body, []) == pytest.approx([0.3])
    assert StateTracker(Channels(("speed",), 0.15)).state(SEEN, []) == pytest.approx([0.15 * 1.8])


def test_past_commands_look_back_from_the_latest_and_begin_at_zero():
    channels = Channels(("command_2", "tilt", "command_1", "command_3"), 0.15)
    assert StateTracker(channels).state(SEEN, []).tolist() == [0.0, 0.1, 0.0, 0.0]
    assert StateTracker(channels).state(SEEN, [7.0]).tolist() == [0.0, 0.1, 7.0, 0.0]
    assert StateTracker(channels).state(SEEN, [1.0, 2.0, 3.0, 4.0]).tolist() == [3.0, 0.1, 4.0, 2.0]
    assert channels.measured == (1,)
    assert channels.lags == {"command_2": 2, "command_1": 1, "command_3": 3}
    assert channels.units[0] == "N·m"


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (("tilt", "tillt"), "Unknown state channel 'tillt'; the channels are: tilt, tilt_rate"),
        (("command_0",), "Unknown state channel 'command_0'"),
        ((), "at least one"),
        (("tilt", "tilt"), "distinct"),
        (("tilt", "command_2"), "without a gap"),
        (("tilt", "command_1", "command_3"), "without a gap"),
        (("tilt", "position"), "The state channel position follows from speed; found"),
        (("speed", "position_integral"), "The state channel position_integral follows from position; found"),
        (("speed", "position"), "The state channel position needs the control period; found 0.0 s"),
    ],
)
def test_a_choice_that_cannot_be_is_refused(names, message):
    with pytest.raises(ConfigError, match=message):
        Channels(names, 0.15)


def test_a_list_of_names_serves_as_well_as_a_tuple():
    assert Channels(["tilt", "speed"], 0.15) == Channels(("tilt", "speed"), 0.15)
    assert isinstance(StateTracker(Channels(["tilt"], 0.15)).state(SEEN, []), np.ndarray)


DRIVING = Channels(("position_integral", "command_1", "tilt", "position", "speed"), 0.15, 0.02)


def rolled(seed=0, steps=40, scale=1.0):
    """Observations (T + 1, 7) of wheels that turn at random, and commands (T,)."""
    rng = np.random.default_rng(seed)
    seen = scale * rng.standard_normal((steps + 1, len(Observation._fields)))
    seen[:, 0] = 3.0 + np.cumsum(rng.uniform(0.01, 0.03, steps + 1))
    return seen, rng.standard_normal(steps)


def tracked(channels, seen, commands):
    tracker = StateTracker(channels)
    return np.array([tracker.state(Observation(*row), commands[:t].tolist()) for t, row in enumerate(seen)])


@pytest.mark.parametrize("scale", [1.0, 1e3])
def test_states_as_they_come_are_those_of_the_whole_rollout(scale):
    seen, commands = rolled(scale=scale)
    np.testing.assert_array_equal(tracked(DRIVING, seen, commands), DRIVING.states(seen, commands))


def test_the_position_is_what_the_wheels_have_rolled_over_ground():
    seen, commands = rolled()
    position = DRIVING.states(seen, commands)[:, 3]
    turned = seen[:, 4] + seen[:, 1]  # wheel angle, seen from the body, and tilt
    assert position[0] == 0.0
    np.testing.assert_allclose(np.diff(position), 0.15 * np.diff(turned), atol=1e-12)


def test_each_rollout_begins_at_its_own_place():
    seen, commands = rolled()
    elsewhere = seen.copy()
    elsewhere[:, 4] += 100.0
    elsewhere[:, 0] += 50.0
    np.testing.assert_allclose(DRIVING.states(elsewhere, commands), DRIVING.states(seen, commands), atol=1e-9)


def test_the_integral_holds_each_position_until_the_next_is_seen():
    seen = np.zeros((4, 7))
    seen[:, 0], seen[:, 4] = [1.0, 1.5, 1.7, 2.0], [2.0, 4.0, 0.0, 9.0]  # positions 0, 0.3, -0.3, 1.05 m
    integral = DRIVING.states(seen, np.zeros(3))[:, 0]
    np.testing.assert_allclose(integral, [0.0, 0.0, 0.2 * 0.3, 0.06 - 0.3 * 0.3], atol=1e-12)


def test_a_robot_that_is_held_does_not_wind_the_integral_up():
    seen = np.zeros((2001, 7))
    seen[:, 0], seen[1:1001, 4], seen[1001:, 4] = 0.02 * np.arange(2001), 10.0, -10.0  # 20 s at 1.5 m, then at -1.5 m
    integral = DRIVING.states(seen, np.zeros(2000))[:, 0]
    bound = 10.0 * 0.15
    assert integral.max() == bound == DRIVING.max_position_integral
    there = int(np.argmax(integral[1001:] < 0.0))
    assert there * 0.02 == pytest.approx(1.0, abs=0.05)  # back from the bound at once, by 1.5 m from then on
    assert integral.min() == -bound


def test_kinematic_channels_are_neither_learned_nor_an_input_of_what_is_learned():
    assert DRIVING.kinematic == (0, 3)
    assert DRIVING.measured == (2, 4)
    assert DRIVING.inputs == (1, 2, 4, 5)  # the command comes last
    assert DRIVING.units == ("m·s", "N·m", "rad", "m", "m/s")
    assert Channels(("tilt", "command_1"), 0.15).inputs == (0, 1, 2)
