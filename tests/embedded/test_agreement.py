"""The compiled header is the policy, in value and in gain; and where it is not, that is seen."""

import ctypes
import re
import subprocess

import numpy as np
import pytest
from scipy.special import erf
from some_policies import COMPILER, POLICIES, compiled, exported, needs_compiler, widths_of

from twbal.core.channels import StateTracker
from twbal.core.errors import ConfigError
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation
from twbal.embedded.agreement import MAX_GAIN_ERROR, agreement
from twbal.embedded.compiler import CompiledPolicy
from twbal.embedded.header import header
from twbal.embedded.laws import rounding_of
from twbal.embedded.working_range import sampled_states

pytestmark = needs_compiler


@pytest.fixture
def rng():
    return np.random.default_rng(11)


def check(policy, robot, count, rng):
    with compiled(policy, robot) as header_:
        found = agreement(header_, policy, widths_of(policy, robot), count, rng)
        assert found.is_equal, found
        assert max(found.gain_by_channel.values()) < MAX_GAIN_ERROR  # each by its own largest gain, too
        assert header_.seconds_per_call < 100e-6


@pytest.mark.parametrize("name", POLICIES)
def test_each_kind_of_policy_is_equal_in_value_and_gain(name, paper, rng):
    check(POLICIES[name], paper, 2000, rng)


@pytest.mark.slow
@pytest.mark.parametrize("name", POLICIES)
def test_a_million_states_are_equal_in_value_and_gain(name, paper, rng):
    check(POLICIES[name], paper, 1_000_000, rng)


@pytest.mark.parametrize(("name", "share"), [("searched", 1e-5), ("friction", 1e-5), ("linear", 1e-5), ("tanh", 2e-5)])
def test_what_single_precision_may_explain_is_little(name, share, paper, rng):
    policy = POLICIES[name]
    bound = rounding_of(policy, sampled_states(widths_of(policy, paper), 2000, rng)).bound
    assert 0 < np.median(bound) < share * policy.max_command


@pytest.mark.parametrize(("name", "array"), [("searched", "gain"), ("friction", "weights"), ("tanh", "weights_1")])
def test_a_constant_that_is_a_thousandth_off_is_seen(name, array, paper, rng):
    policy = POLICIES[name]
    text = header(exported(policy, paper))
    place = re.search(rf"twbal_policy_{array}\[\] TWBAL_FLASH = {{\n    ([-0-9.e+]+)f", text)
    spoilt = text[: place.start(1)] + f"{float(place[1]) * 1.001:.9g}" + text[place.end(1) :]
    with CompiledPolicy(spoilt, COMPILER) as header_:
        assert not agreement(header_, policy, widths_of(policy, paper), 2000, rng).is_equal


def test_a_header_that_computes_no_number_is_not_equal(paper, rng):
    class Broken:
        def commands(self, states):
            return np.where(np.arange(len(states)) % 100 == 7, np.nan, policy.command(states))

    policy = POLICIES["linear"]
    found = agreement(Broken(), policy, widths_of(policy, paper), 2000, rng)
    assert not found.is_equal and found.max_error == np.inf


@pytest.mark.parametrize("array", ["gain", "centres", "weights", "inverse_lengths"])
def test_an_array_of_the_wrong_size_does_not_compile(array, paper):
    text = header(exported(POLICIES["place"], paper))
    shorter = re.sub(rf"(twbal_policy_{array}\[\] TWBAL_FLASH = {{\n    )[^,]+, ", r"\1", text)
    assert shorter != text
    with pytest.raises(ConfigError, match="has_the_right_size"):
        CompiledPolicy(shorter, COMPILER)


@pytest.mark.parametrize("name", POLICIES)
def test_a_command_is_a_number_within_its_limit_for_any_number(name, paper, rng):
    policy = POLICIES[name]
    size = rng.choice([0.0, 1e-38, 1.0, 1e6, 1e20, 3e38, np.inf], size=(500, len(policy.channels)))
    with compiled(policy, paper) as header_:
        commands = header_.commands(size * rng.choice([-1.0, 1.0], size=size.shape))
        assert np.isfinite(commands).all()
        assert np.abs(commands).max() <= policy.max_command * (1 + 1e-6)


@pytest.mark.parametrize("name", POLICIES)
def test_the_command_for_what_is_no_number_is_none_by_which_a_board_switches_off(name, paper):
    policy = POLICIES[name]
    broken = np.zeros((len(policy.channels), len(policy.channels)))
    np.fill_diagonal(broken, np.nan)
    with compiled(policy, paper) as header_:
        assert np.isnan(header_.commands(broken)).all()


@pytest.mark.parametrize("name", ["place", "searched", "paper"])
def test_the_states_of_a_rollout_are_those_of_twbal(name, paper, rng):
    policy, period = POLICIES[name], paper.control_period
    observations = np.cumsum(rng.normal(size=(400, 7)), axis=0) * [0, 0.02, 0.1, 0.3, 0.3, 0.3, 0.1]
    observations[:, 0] = period * np.arange(400)
    with compiled(policy, paper) as header_:
        found = header_.rollout(observations)
    expected = exported(policy, paper).channels.states(observations, found.commands)
    np.testing.assert_allclose(found.states, expected, rtol=1e-5, atol=2e-5)
    np.testing.assert_allclose(found.commands, policy.command(expected), atol=0.02)


class Asked:
    """A reference that says what it is told to, as `core.reference.Reference` would."""

    def __init__(self, rows):
        self._rows, self._next, self.gives_way = rows, 0, False
        self.motion = Motion()

    def follow(self, time, position, speed):
        asked, self._next = self._rows[self._next], self._next + 1
        self.gives_way, self.motion = bool(asked[2]), Motion(asked[0], asked[1], 0.0)
        return self.motion


def test_a_reference_that_gives_way_holds_the_integral_as_in_twbal(paper, rng):
    policy, count = POLICIES["place"], 300
    observations = np.cumsum(rng.normal(size=(count, 7)), axis=0) * [0, 0.01, 0.1, 0, 0.5, 0.3, 0]
    observations[:, 0] = paper.control_period * np.arange(count)
    asked = np.cumsum(rng.normal(size=(count, 3)), axis=0) * [0.05, 0.005, 0.0]
    asked[:, 2] = np.arange(count) // 25 % 2
    asked[120:180, 1] = 0.0  # at rest, where the integral grows more slowly
    with compiled(policy, paper) as header_:
        found = header_.rollout(observations, asked)
        standing = header_.rollout(observations)
    made = exported(policy, paper)
    tracker = StateTracker(made.channels, Asked(asked), made.feed_forward)
    expected = []
    for n, row in enumerate(observations):
        tracker.state(Observation(*row), list(found.commands[:n]))
        expected.append(tracker.for_policy)
    np.testing.assert_allclose(found.states, expected, rtol=1e-5, atol=2e-5)
    assert np.abs(standing.states[:, -1] - found.states[:, -1]).max() > 0.01


@pytest.mark.parametrize("moves", [True, False])
def test_a_robot_that_is_off_its_place_has_the_integral_of_twbal(moves, paper):
    """On board a reference that never moved is none: by two wheel radii the integral grows at one rate or the other."""
    policy, count, place = POLICIES["place"], 150, 2.0 * paper.wheel_radius
    observations = np.zeros((count, 7))
    observations[:, 0] = paper.control_period * np.arange(count)
    observations[1:, 4] = place / paper.wheel_radius  # wheel angle
    asked = np.zeros((count, 3))
    asked[1:3, 1] = 0.1 * moves
    with compiled(policy, paper) as header_:
        found = header_.rollout(observations, asked)
    made = exported(policy, paper)
    tracker = StateTracker(made.channels, Asked(asked) if moves else None, made.feed_forward if moves else None)
    seen = [Observation(*row) for row in observations]
    expected = [tracker.state(row, list(found.commands[:n]))[-1] for n, row in enumerate(seen)]
    np.testing.assert_allclose(found.states[:, -1], expected, rtol=1e-4, atol=1e-4)
    grown = (found.states[-1, -1] - found.states[-101, -1]) / (100 * paper.control_period * place)
    assert grown == pytest.approx(1.5 if moves else 1.0, rel=1e-3)


def test_its_error_function_is_one_of_single_precision(paper, tmp_path):
    (tmp_path / "policy.h").write_text(header(exported(POLICIES["friction"], paper)))
    (tmp_path / "erf.c").write_text('#include "policy.h"\nfloat found(float x) { return twbal_policy_erf(x); }\n')
    subprocess.run(
        [COMPILER, "-shared", "-fPIC", "-o", tmp_path / "erf.so", tmp_path / "erf.c", "-lm"], check=True, cwd=tmp_path
    )
    function = ctypes.CDLL(str(tmp_path / "erf.so")).found
    function.restype, function.argtypes = ctypes.c_float, [ctypes.c_float]
    x = np.linspace(-5, 5, 20001).astype(np.float32)
    assert np.abs([function(value) for value in x] - erf(x.astype(float))).max() < 1.2e-7
