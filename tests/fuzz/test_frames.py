"""Whatever comes over the wire: messages, or bytes that are counted and dropped; never an error."""

from itertools import pairwise

import numpy as np
import pytest
from fuzzing import fuzzed, mutated
from hypothesis import strategies as st

from twbal.link.decoder import Decoder, to_wire
from twbal.link.frame import MAX_FRAME, unwrap, wrap
from twbal.link.protocol import (
    VERSION,
    Arm,
    Clock,
    Command,
    Drive,
    Fault,
    Follow,
    Hello,
    PoseReport,
    Status,
    Stop,
    Telemetry,
    Welcome,
)
from twbal.link.version_1 import VERSION_1, Arm1, Command1, Telemetry1, Welcome1

SAID = [
    Hello(1),
    Welcome(1, VERSION, 20_000, 20.0, Clock.REAL_TIME, 20.0, name="paper"),
    Welcome1(1, VERSION_1, 20_000, 20.0, Clock.REAL_TIME, "paper"),
    Arm(2, 7, Drive.ON_BOARD),
    Arm1(2, 7),
    Command(3, -1.5, 0.5),
    Command1(3, -1.5),
    Follow(3, 1.0, 0.5, 1.5, 0.25, 1),
    PoseReport(3, 1, 0.5, -0.25, 3.0, 1.5),
    Telemetry(3, 1, 20_000, Status.ARMED, *(0.125 * k for k in range(8))),
    Telemetry1(3, 1, 20_000, Status.ARMED, *(0.125 * k for k in range(8))),
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


SENT = frozenset(message.encode() for message in SAID)
BUDGETS = [pytest.param(2 * 10**5, id="quick"), pytest.param(10**7, id="many", marks=pytest.mark.slow)]


def collisions_expected(runs):
    """Most runs between zeros that keep a right CRC of 16 bits by chance, but for once in ten million tries."""
    return runs / 2**16 + 6 * (runs / 2**16) ** 0.5 + 8


def runs_in(stream):
    return [run for run in stream.split(b"\0") if 0 < len(run) <= MAX_FRAME]


@pytest.mark.parametrize("size", BUDGETS)
def test_of_random_bytes_nothing_is_taken_but_by_collisions_of_the_crc(size):
    """Many zeros among them, so that there are many short runs, which are the easiest to take for frames."""
    stream = np.random.default_rng(0).choice(256, size, p=[0.1, *[0.9 / 255] * 255]).astype(np.uint8).tobytes()
    runs, decoder = runs_in(stream), Decoder()
    taken = decoder.feed(stream)
    sound = [run for run in runs if unwrap(run) is not None]
    assert len(taken) <= len(sound) <= collisions_expected(len(runs))
    assert decoder.bad_frames >= len(runs) - len(taken) - 1
    assert decoder.feed(b"\0" + STREAM)[-len(SAID) :] == SAID  # back in step within one frame


@pytest.mark.parametrize("size", BUDGETS)
def test_of_mutated_messages_none_is_taken_for_another_but_by_collisions_of_the_crc(size):
    """One byte in 60 has a bit flipped, in messages without end: what is heard was said, but for chance."""
    rng = np.random.default_rng(1)
    repeats = size // len(STREAM)
    data = np.frombuffer(STREAM * repeats, np.uint8)
    flipped = np.where(rng.random(len(data)) < 1 / 60, 1 << rng.integers(0, 8, len(data)), 0)
    stream = (data ^ flipped).astype(np.uint8).tobytes()
    heard_here = Decoder().feed(stream)
    wrong = [message for message in heard_here if message.encode() not in SENT]
    damaged = repeats * len(SAID) - (len(heard_here) - len(wrong))
    assert 0.2 * repeats * len(SAID) < damaged < repeats * len(SAID)
    assert len(wrong) <= collisions_expected(2 * damaged)
