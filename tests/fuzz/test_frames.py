"""Whatever comes over the wire: messages, or bytes that are counted and dropped; never an error."""

from itertools import pairwise

from fuzzing import fuzzed, mutated
from hypothesis import strategies as st

from twbal.link.decoder import Decoder, to_wire
from twbal.link.frame import MAX_FRAME, wrap
from twbal.link.protocol import Arm, Clock, Command, Fault, Hello, PoseReport, Status, Stop, Telemetry, Welcome

SAID = [
    Hello(1),
    Welcome(1, 1, 20_000, 20.0, Clock.REAL_TIME, "paper"),
    Arm(2, 7),
    Command(3, -1.5),
    PoseReport(3, 1, 0.5, -0.25, 3.0, 1.5),
    Telemetry(3, 1, 20_000, Status.ARMED, *(0.1 * k for k in range(8))),
    Fault(4, "stopped: too far"),
    Stop(5),
]
STREAM = b"".join(map(to_wire, SAID))
TOO_LONG = b"\1" * 2 * MAX_FRAME + b"\0" + STREAM  # a run that no frame is as long as


def heard(data, cuts=()):
    """The messages in `data`, given to a decoder in pieces."""
    decoder, begins = Decoder(), [0, *sorted(cuts), len(data)]
    messages = []
    for begin, end in pairwise(begins):
        messages += decoder.feed(data[begin:end])
    return messages


@fuzzed(data=st.binary(max_size=600) | mutated(STREAM) | st.lists(st.binary(max_size=60).map(wrap)).map(b"".join))
def test_any_bytes_make_messages_that_can_be_said_again(path, data):
    for message in heard(data):
        wire = to_wire(message)
        (again,) = heard(wire)
        assert to_wire(again) == wire


@fuzzed(data=mutated(STREAM) | mutated(TOO_LONG), cuts=st.lists(st.integers(0, len(TOO_LONG)), max_size=6))
def test_it_does_not_matter_where_the_stream_is_cut(path, data, cuts):
    whole, pieces = heard(data), heard(data, [min(cut, len(data)) for cut in cuts])
    assert list(map(to_wire, whole)) == list(map(to_wire, pieces))


@fuzzed(noise=st.binary(max_size=300), cuts=st.lists(st.integers(0, 300), max_size=4))
def test_a_message_after_noise_is_heard(path, noise, cuts):
    assert heard(noise + b"\0" + STREAM, [min(cut, len(noise)) for cut in cuts])[-len(SAID) :] == heard(STREAM)
