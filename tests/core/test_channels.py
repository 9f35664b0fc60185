import numpy as np
import pytest

from twbal.core.channels import Channels
from twbal.core.errors import ConfigError
from twbal.core.plant import Observation

SEEN = Observation(0.4, 0.1, -0.2, 3.0, 5.0, 2.0, 0.7)


def test_channels_come_in_the_order_of_their_names():
    channels = Channels(("yaw_rate", "acceleration", "tilt_rate", "tilt"), 0.15)
    assert channels.state(SEEN, []).tolist() == [0.7, 3.0, -0.2, 0.1]
    assert channels.units == ("rad/s", "m/s²", "rad/s", "rad")


def test_speed_is_that_of_the_axle_over_ground():
    rolling_with_the_body = SEEN._replace(
        wheel_rate=0.0, tilt_rate=2.0
    )  # encoders stand, the wheel turns with the body
    assert Channels(("speed",), 0.15).state(rolling_with_the_body, []) == pytest.approx([0.3])
    assert Channels(("speed",), 0.15).state(SEEN, []) == pytest.approx([0.15 * 1.8])


def test_past_commands_look_back_from_the_latest_and_begin_at_zero():
    channels = Channels(("command_2", "tilt", "command_1", "command_3"), 0.15)
    assert channels.state(SEEN, []).tolist() == [0.0, 0.1, 0.0, 0.0]
    assert channels.state(SEEN, [7.0]).tolist() == [0.0, 0.1, 7.0, 0.0]
    assert channels.state(SEEN, [1.0, 2.0, 3.0, 4.0]).tolist() == [3.0, 0.1, 4.0, 2.0]
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
    ],
)
def test_a_choice_that_cannot_be_is_refused(names, message):
    with pytest.raises(ConfigError, match=message):
        Channels(names, 0.15)


def test_a_list_of_names_serves_as_well_as_a_tuple():
    assert Channels(["tilt", "speed"], 0.15) == Channels(("tilt", "speed"), 0.15)
    assert isinstance(Channels(["tilt"], 0.15).state(SEEN, []), np.ndarray)
