"""The portable part compiles without a warning, and its own tests pass under sanitizers."""

import re
import shutil
import subprocess
from dataclasses import replace

import pytest
from building import FIRMWARE, build_folder, library, make, needs_compiler, program

from benchmarks.on_boards.kinds_of_policies import POLICIES, exported
from twbal.embedded.header import header
from twbal.link.protocol import VERSION

pytestmark = needs_compiler
PAGE = (FIRMWARE.parent / "docs" / "protocol.md").read_text()
STATES = ("strange", "off", "armed", "tripped")
EVENTS = {
    "Hello, its version": 0,
    "Hello, another version": 1,
    "Arm that it can follow": 2,
    "Arm that it cannot": 3,
    "Command (drive `TORQUE`, `VOLTAGE`)": 4,
    "Follow (drive `ON_BOARD`)": 4,
    "Command, Follow not of this drive": 5,
    "Command or Follow that is not finite": 5,
    "Stop": 6,
    "a robot's message": 7,
    "nothing: the port is closed (where the robot can tell)": 8,
}
NONE, WELCOME, FAULT, TELEMETRY, STREAM = range(5)


@pytest.mark.slow
def test_units_and_fuzz_pass_under_sanitizers():
    said = make("test")
    assert "units: all checks hold" in said
    assert re.search(r"fuzz: 100\d{3} bytes, \d+ good frames after noise, 0 lost", said)


def test_the_program_alone_says_what_starts_it():
    done = subprocess.run([program()], capture_output=True, text=True)
    assert done.returncode == 2
    assert "twbal virtual-robot firmware=firmware/build/robot_posix clock=real_time" in done.stderr


@pytest.mark.skipif(shutil.which("avr-g++") is None, reason="there is no avr-gcc")
def test_the_balboas_board_file_fits_its_processor_with_and_without_a_policy(paper, tmp_path):
    robot = replace(paper, control_period=0.01)
    policy = exported(POLICIES["searched"], robot)
    (tmp_path / "policy.h").write_text(header(policy))
    said = make("avr", f"POLICY={tmp_path}", folder=tmp_path / "build")
    found = re.findall(r"ATmega32U4, (.+): (\d+) bytes of flash, (\d+) bytes of RAM", said)
    assert [name for name, *_ in found] == ["no policy", "with the policy"]
    assert all(int(flash) < 28_672 and int(memory) < 0.6 * 2560 for _, flash, memory in found)
    assert int(found[0][1]) < int(found[1][1])


def test_without_avr_gcc_one_line_says_so(tmp_path):
    said = make("avr", "AVR_CXX=no-such-compiler", folder=tmp_path)
    assert said == "not compiled for AVR: there is no no-such-compiler\n"


def test_the_esp32s_board_file_is_compiled_by_the_compilers_that_are_here(tmp_path):
    said = make("sizes", folder=tmp_path).splitlines()
    assert len(said) == 2
    assert all(re.search("bytes of flash, .* of RAM|not compiled: .* not here", line) for line in said)


def esp32_start(version, *words):
    """How long a loop of the ESP32 may hang [ms], and the first sample of its IMU that it takes."""
    started = build_folder() / f"esp32_start_{version}"
    make(str(started))
    done = subprocess.run([started, *map(str, words)], capture_output=True, text=True, check=True)
    return tuple(map(int, done.stdout.split()))


@pytest.mark.parametrize(("version", "most_ms"), [(2, 1000), (3, 200)])
def test_an_esp32_whose_loop_hangs_is_reset_as_soon_as_arduino_can(version, most_ms):
    patience, _ = esp32_start(version)
    assert 0 < patience <= most_ms


@pytest.mark.parametrize("register", [0x6B, 0x1A, 0x1B, 0x1C])
def test_no_sample_of_an_esp32s_imu_is_taken_until_its_registers_hold_what_was_written(register):
    first = [esp32_start(3, register, lost)[1] for lost in (0, 1, 5, 10**6)]
    assert first == [1, 2, 6, 0]


def test_another_policy_or_none_builds_the_program_anew_and_the_same_one_does_not(tmp_path):
    """With a compiler that only notes how it is called."""
    compiler, built = tmp_path / "compiler", tmp_path / "build" / "robot_posix"
    compiler.write_text('#!/bin/sh\necho "$@" > "$(echo "$@" | sed "s/.*-o \\([^ ]*\\).*/\\1/")"\n')
    compiler.chmod(0o755)
    policies = [tmp_path / name for name in ("first", "second")]
    for folder in policies:
        folder.mkdir()
        (folder / "policy.h").write_text("a policy\n")

    def make_with(folder):
        words = [f"POLICY={folder}"] if folder else []
        make("all", f"CXX={compiler}", *words, folder=tmp_path / "build")
        return built.read_text(), built.stat().st_mtime_ns

    for folder in (None, *policies, None, policies[0]):
        called, when = make_with(folder)
        assert ("TWBAL_WITH_POLICY" in called) == (folder is not None)
        assert folder is None or f"-I{folder}" in called
        assert make_with(folder) == (called, when)
    (policies[0] / "policy.h").write_text("the next one\n")
    assert make_with(policies[0])[1] > when


@pytest.mark.slow
def test_ten_million_bytes_of_noise_neither_crash_nor_stop_it():
    make(str(build_folder() / "fuzz"))
    for seed in (2, 3):
        done = subprocess.run([build_folder() / "fuzz", "10000000", str(seed)], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        assert " 0 lost; " in done.stdout


def rows():
    """Of the page's table of states and messages: message, and what it does in each state."""
    table = PAGE[PAGE.index("| message | strange |") :].split("\n\n")[0].splitlines()[2:]
    return {cells[0]: cells[1:] for cells in ([cell.strip() for cell in row.strip("|").split("|")] for row in table)}


def meant(state, words):
    """Next state and reply that a cell of the table says."""
    last = words.split("; ")[-1]
    next_state = next((name for name in STATES if name in last.split(",")[0].split()), STATES[state])
    if "begins anew" in words or last.startswith("armed"):
        return "armed", TELEMETRY
    if "Fault" in words:
        return next_state, FAULT
    if "Welcome" in words:
        return next_state, WELCOME
    if "Telemetry" in words:
        return "off", TELEMETRY
    return next_state, STREAM if "sets" in words or "accepted" in words else NONE


def test_the_table_of_states_is_that_of_the_specification():
    robot, found = library(), rows()
    assert set(found) == set(EVENTS)
    for message, cells in found.items():
        for state, words in enumerate(cells):
            made = STATES[robot.transition_next(state, EVENTS[message])], robot.transition_reply(state, EVENTS[message])
            assert made == meant(state, words), (message, STATES[state])


def test_only_arming_leads_to_motors_that_are_on():
    robot = library()
    ways = {(s, e) for s in range(4) for e in range(10) if robot.transition_next(s, e) == 2 and s != 2}
    assert ways == {(1, 2), (3, 2)}


def test_the_portable_part_asks_for_no_library_of_cpp():
    """Boards with AVR have none; and nothing allocates or throws."""
    for file in (FIRMWARE / "include" / "twbal").glob("*.h"):
        text = file.read_text()
        included = set(re.findall(r"#include <(\w+(?:\.h)?)>", text))
        assert included <= {"stdint.h", "stddef.h", "math.h", "string.h"}, file.name
        assert not re.search(r"\b(new|delete|malloc|throw|std::)\b", re.sub(r"//.*|/\*.*?\*/|\"[^\"]*\"", "", text)), (
            file
        )
    assert VERSION == 2
