import math
import re
import struct
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from twbal.link.decoder import Decoder, to_wire
from twbal.link.frame import MAX_FRAME, Splitter, wrap
from twbal.link.message import MAX_TEXT
from twbal.link.protocol import (
    NEEDED,
    OWN,
    SHARED,
    VERSION,
    Arm,
    Clock,
    Command,
    Drive,
    Fault,
    Follow,
    Hello,
    PoseReport,
    Sensors,
    Status,
    Stop,
    Telemetry,
    Welcome,
)
from twbal.link.version_1 import OWN_1, VERSION_1, Arm1, Command1, Telemetry1, Welcome1, downgraded, upgraded

ROOT = Path(__file__).resolve().parents[2]

MEASURED = -0.5, 1.25, -9.75, 0.0, 1e6, -2.0, 2.5, 0.125
REST = {"heading": 0.5, "battery": 7.5, "applied": 3.0, "applied_difference": -0.25, "command_us": 9, "late": 8}
TELEMETRY = Telemetry(7, 65535, 2**32 - 1, Status.TILT_STOPPED, *MEASURED, **REST, dropped=7)
TELEMETRY_1 = Telemetry1(7, 65535, 2**32 - 1, Status.TILT_STOPPED, *MEASURED)
SENSORS = NEEDED | Sensors.BATTERY
MESSAGES = [
    Hello(0),
    Hello(65535, 3),
    Welcome(1, VERSION, 20_000, 20.0, Clock.REAL_TIME, 5.0, 7.5, SENSORS, 2**32 - 1, 2, "paper"),
    Welcome(1, VERSION, 15_000, 0.5, Clock.LOCKSTEP, 0.0, 12.0, NEEDED, 0, 0, ""),
    Welcome1(1, VERSION_1, 20_000, 20.0, Clock.REAL_TIME, "paper"),
    Arm(256, 2**32 - 1, Drive.ON_BOARD),
    Arm1(256, 2**32 - 1),
    Command(3, -1.5, 0.25),
    Command(0, 0.0),
    Command1(3, -1.5),
    Follow(4, 1.5, -0.25, 3.125, 0.5),
    Follow(4, 1.5, -0.25, 3.125, 0.5, 1),
    Stop(0),
    TELEMETRY,
    TELEMETRY_1,
    Fault(9, "zu weit geneigt: 75°"),
    PoseReport(7, 65535, -12.5, 0.25, -3.140625, 1.5),
]


def crc_by_definition(data: bytes) -> int:
    """CRC-16 with polynomial 0x1021 and initial value 0xFFFF, bit by bit."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ (0x1021 if crc & 0x8000 else 0)) & 0xFFFF
    return crc


@pytest.mark.parametrize("message", MESSAGES, ids=lambda m: type(m).__name__)
def test_decoding_an_encoded_message_gives_it_back(message):
    assert Decoder().feed(to_wire(message)) == [message]


def test_every_kind_of_message_is_among_the_round_trips():
    assert {type(m) for m in MESSAGES} == {*SHARED, *OWN, *OWN_1, Welcome1}


def test_a_frame_is_what_the_specification_says():
    payload = bytes([0x04, 0x01, 0x00])  # Stop, number 1
    plain = payload + struct.pack("<H", crc_by_definition(payload))
    assert crc_by_definition(b"123456789") == 0x29B1  # check value of CRC-16/IBM-3740
    assert plain.count(0) == 1
    expected = (
        b"\x00" + b"\x03" + plain[:2] + b"\x03" + plain[3:] + b"\x00"
    )  # COBS: distance to each zero instead of it
    assert to_wire(Stop(1)) == expected == bytes.fromhex("00 03 04 01 03 6D 23 00")  # the example in docs/protocol.md


def test_telemetry_travels_as_float32():
    seen = Decoder().feed(to_wire(Telemetry(1, 2, 3, Status.ARMED, *[0.1] * 2)))[0]
    assert seen.tilt == float(np.float32(0.1)) != 0.1
    assert math.isnan(seen.yaw_rate)


def test_messages_are_laid_out_as_the_specification_lists_them():
    page = (ROOT / "docs" / "protocol.md").read_text()
    codes = {"uint8_t": "B", "uint16_t": "H", "uint32_t": "I", "float": "f"}
    for message in (m for m in MESSAGES if type(m) in (*SHARED, *OWN)):
        listed = page.partition(f"### {type(message).__name__}\n")[2].partition("\n###")[0]
        rows = re.findall(r"^\| (\d+) \| `(\w+)` \| (\S+) \|", listed, flags=re.MULTILINE)
        payload = message.encode()
        assert [name for _, name, _ in rows] == ["type", *vars(message)]
        for at, name, kind in rows[1:]:
            value = getattr(message, name)
            if kind == "UTF-8":
                assert payload[int(at) :] == value.encode()
            else:
                assert struct.unpack_from("<" + codes[kind], payload, int(at)) == (value,)


def test_a_pose_is_laid_out_as_the_specification_says():
    payload = struct.pack("<BHHffff", 0x84, 7, 65535, -12.5, 0.25, -3.140625, 1.5)  # docs/protocol.md
    assert Decoder().feed(wrap(payload)) == [MESSAGES[-1]]


def test_messages_do_not_depend_on_how_the_stream_is_cut():
    stream = b"".join(map(to_wire, MESSAGES))
    rng = np.random.default_rng(0)
    for _ in range(200):
        cuts = sorted(rng.integers(0, len(stream), 12))
        decoder = Decoder()
        pieces = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
        assert [m for piece in pieces for m in decoder.feed(piece)] == MESSAGES
        assert decoder.bad_frames == 0


def test_noise_between_frames_costs_no_message():
    rng = np.random.default_rng(1)
    stream = b"".join(rng.bytes(int(rng.integers(1, 60))) + to_wire(m) for m in MESSAGES * 20)
    decoder = Decoder()
    assert decoder.feed(stream) == MESSAGES * 20
    assert decoder.bad_frames > 100


def test_no_flipped_bit_makes_another_message():
    decoder, frame, after = Decoder(), to_wire(TELEMETRY), Stop(1)
    for bit in range(8 * len(frame)):
        flipped = (int.from_bytes(frame, "big") ^ 1 << bit).to_bytes(len(frame), "big")
        got = decoder.feed(flipped + to_wire(after))
        assert got == [after]
    assert decoder.bad_frames >= 8 * len(frame)


def test_cut_frames_are_dropped_and_the_next_one_is_read():
    frame = to_wire(TELEMETRY)
    for length in range(1, len(frame) - 1):
        assert Decoder().feed(frame[:length] + to_wire(Stop(1))) == [Stop(1)]


def test_random_bytes_are_no_messages_and_no_errors():
    rng = np.random.default_rng(2)
    decoder = Decoder()
    for _ in range(300):
        assert decoder.feed(rng.bytes(2000)) == []
    assert decoder.bad_frames > 1000


def test_a_flood_without_a_border_is_one_bad_frame_and_is_not_kept():
    decoder = Decoder()
    for _ in range(1000):
        assert decoder.feed(b"\x01" * 1000) == []
    assert decoder.bad_frames == 1
    assert decoder.feed(to_wire(Stop(1))) == [Stop(1)]


unhurried = settings(deadline=None, derandomize=True, database=None)
RUNS = st.lists(st.integers(1, 255), max_size=3 * MAX_FRAME).map(bytes)


@unhurried
@given(st.lists(RUNS, max_size=6), st.lists(st.integers(0, 20 * MAX_FRAME), max_size=8))
@example([b"x" * (MAX_FRAME + 1), b"y" * MAX_FRAME], [])  # all at once
@example([b"x" * (MAX_FRAME + 1), b"y" * MAX_FRAME], [MAX_FRAME, MAX_FRAME + 1, MAX_FRAME + 2])
def test_runs_up_to_the_limit_pass_and_longer_ones_do_not_however_the_stream_is_cut(runs, cuts):
    stream = b"".join(run + b"\0" for run in runs)
    borders = [0, *sorted(cut for cut in cuts if cut < len(stream)), len(stream)]
    splitter = Splitter()
    got = [run for a, b in pairwise(borders) for run in splitter.feed(stream[a:b])]
    assert got == [run for run in runs if 0 < len(run) <= MAX_FRAME]
    assert splitter.overlong == sum(len(run) > MAX_FRAME for run in runs)


@unhurried
@given(st.binary(max_size=400))
def test_no_bytes_between_two_zeros_are_an_error(noise):
    decoder = Decoder()
    decoder.feed(wrap(noise) + noise)
    assert decoder.feed(to_wire(Stop(1)))[-1:] == [Stop(1)]


@pytest.mark.parametrize("character", ["\x1b", "\r", "\n", "\x07", "\x9b", "\u202e", "\x00"])
def test_control_characters_of_a_robot_do_not_reach_a_terminal(character):
    text = f"low{character}[2Jbattery"
    for message in (Fault(1, text), Welcome(1, VERSION, name=text)):
        (seen,) = Decoder().feed(to_wire(message))
        assert (seen.text if isinstance(seen, Fault) else seen.name) == "low\N{REPLACEMENT CHARACTER}[2Jbattery"


@pytest.mark.parametrize(
    ("payload", "complaint"),
    [
        (b"\x7f\x01\x00", "unknown type 0x7f"),
        (b"\x82\x01\x00", "a Telemetry1 of 3 bytes .*requires a buffer of 42 bytes"),
        (b"\x85\x01\x00", "a Telemetry of 3 bytes .*requires a buffer of 66 bytes"),
        (b"\x81\x01\x00", "a Welcome of 3 bytes .*at least 5 bytes"),
        (struct.pack("<BHHIfB", 0x81, 1, VERSION_1, 20_000, 20.0, 7), "a Welcome of 14 bytes .*7 is not a valid Clock"),
        (struct.pack("<BHHIfB", 0x81, 1, VERSION_1, 20_000, 20.0, 1) + b"\xff", "a Welcome of 15 bytes .*utf-8"),
        (struct.pack("<BHIB", 0x05, 1, 0, 3), "an? Arm of 8 bytes .*3 is not a valid Drive"),
    ],
)
def test_a_sound_frame_that_is_no_message_leaves_a_complaint_that_says_why(payload, complaint):
    decoder = Decoder()
    decoder.feed(wrap(payload))
    assert re.search(complaint, decoder.unreadable)
    assert Decoder().unreadable == ""


@pytest.mark.parametrize(
    "payload", [b"", b"\x04", b"\x04\x01", b"\x04\x01\x00\x00", b"\x7f\x01\x00", b"\x83\x01\x00\xff"]
)
def test_a_sound_frame_with_a_wrong_body_is_dropped(payload):
    decoder = Decoder()
    assert decoder.feed(wrap(payload)) == []
    assert decoder.bad_frames == 1


def test_a_welcome_of_another_version_is_read_as_far_as_its_version():
    (welcome,) = Decoder().feed(wrap(struct.pack("<BHH", 0x81, 5, VERSION + 1) + b"whatever came later"))
    assert (welcome.seq, welcome.version, welcome.name) == (5, VERSION + 1, "")


def test_long_texts_are_cut_between_characters_and_fit_into_a_frame():
    wire = to_wire(Fault(1, "x" + "°" * 500))
    assert len(wire) <= MAX_FRAME
    assert Decoder().feed(wire) == [Fault(1, "x" + "°" * ((MAX_TEXT - 1) // 2))]


# Version 1


@pytest.mark.parametrize("message", [m for m in MESSAGES if isinstance(m, Arm1 | Command1 | Welcome1)])
def test_a_message_of_version_1_is_the_same_after_being_one_of_version_2(message):
    assert downgraded(upgraded(message)) == message


def test_telemetry_of_version_1_is_that_of_both_wheels_in_version_2():
    seen = upgraded(TELEMETRY_1)
    assert (seen.wheel_angle, seen.wheel_difference) == (5e5, 1e6)
    assert (seen.wheel_rate, seen.difference_rate) == (0.25, 4.5)
    assert (seen.seq, seen.period, seen.time_us, seen.status, seen.tilt) == (7, 65535, 2**32 - 1, 2, -0.5)
    assert math.isnan(seen.heading) and math.isnan(seen.battery) and math.isnan(seen.applied)


def test_version_1_keeps_every_bit_of_the_wheels_mean():
    angle = float(np.float32(0.1))
    mean = replace(TELEMETRY, wheel_angle=angle, wheel_rate=-angle)
    seen = upgraded(downgraded(mean))
    assert (seen.wheel_angle, seen.wheel_rate) == (angle, -angle)


@pytest.mark.parametrize("version", [VERSION_1, VERSION])
def test_a_robot_of_one_version_does_not_take_the_others_messages(version):
    own, others = ([Arm1(2, 0), Command1(3, 1.0)], [Arm(2, 0), Command(3, 1.0), Follow(4, *[0.0] * 4)])
    if version == VERSION:
        own, others = others, own
    decoder = Decoder(version)
    assert decoder.feed(b"".join(map(to_wire, own))) == own
    assert decoder.feed(b"".join(map(to_wire, others))) == []
    assert decoder.bad_frames == len(others)
