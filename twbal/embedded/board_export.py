"""A policy on its way to a board: header, test vectors and self-test, what they take, and whether they are right."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from twbal.core.channels import Channels
from twbal.core.errors import DataError
from twbal.core.feed_forward import FeedForward
from twbal.core.files import write_atomically
from twbal.core.gaussian import Array
from twbal.core.robot_parameters import RobotParameters
from twbal.embedded.agreement import MAX_GAIN_ERROR, Agreement, agreement
from twbal.embedded.boards import BOARDS, Need, need_on
from twbal.embedded.compiler import CompiledPolicy, c_compiler
from twbal.embedded.distil import DistillationCost, cost_of, distilled
from twbal.embedded.header import Exported, header
from twbal.embedded.self_test import PROGRAM, vectors
from twbal.embedded.working_range import half_widths, sampled_states
from twbal.policies.rbf import RbfPolicy
from twbal.policies.saved import SavedPolicy

HEADER, VECTORS, SELF_TEST = "policy.h", "policy_vectors.h", "policy_selftest.c"
_FITTED, _JUDGED = 6000, 6000  # states that a smaller policy is fitted and judged at


@dataclass(frozen=True)
class OnBoard:
    """What is known of an exported policy.

    Attributes:
        channels: that it reads.
        control_period: at which it must be called [s].
        needs: what it takes on each board, estimated.
        agreement: of the compiled header with the policy; None where it was not compiled here.
        distillation: what fewer basis functions cost; None where all are there.
    """

    channels: tuple[str, ...]
    control_period: float
    needs: tuple[Need, ...]
    agreement: Agreement | None
    distillation: DistillationCost | None


class Export(NamedTuple):
    """An exported policy.

    Attributes:
        policy: that was written; the smaller one where it was distilled.
        on_board: what is known of it.
        files: header, test vectors and self-test.
        seconds_per_call: on this machine; infinite where it was not compiled [s].
    """

    policy: SavedPolicy
    on_board: OnBoard
    files: tuple[Path, ...]
    seconds_per_call: float


def export_to(
    folder: Path,
    policy: SavedPolicy,
    channels: Channels,
    robot: RobotParameters,
    tilt_limit: float,
    origin: str,
    rng: np.random.Generator,
    basis: int | None = None,
    checked: int = 0,
) -> Export:
    """Write header, test vectors and self-test, and check the header where this machine has a C compiler.

    Args:
        folder: for the files.
        policy: to write.
        channels: that it reads.
        robot: that it is for.
        tilt_limit: of its working range [rad].
        origin: what the header says of where the policy comes from.
        rng: that test vectors and states are drawn from.
        basis: functions that are to be left, where there are more; None: all.
        checked: states at which the compiled header is compared; 0: it is not compiled.

    Raises:
        ConfigError: the policy cannot be exported, or not be made smaller so.
        DataError: the compiled header is not the policy; no file is written then.
    """
    widths = half_widths(channels.names, channels.max_position_integral, robot, tilt_limit)
    cost = None
    if basis is not None and not _has_no_more(policy, basis):
        policy, cost = _smaller(policy, basis, widths, rng)
    feed_forward = FeedForward.of_robot(robot)
    exported = Exported(policy, channels, robot.control_period, robot.name, origin, feed_forward)
    text = header(exported)
    texts = {HEADER: text, VECTORS: vectors(exported, widths, rng), SELF_TEST: PROGRAM}
    equal, seconds = _checked(text, policy, widths, checked, rng)
    if equal is not None:
        _check_agreement(equal)
    for name, content in texts.items():
        write_atomically(folder / name, content)
    needs = tuple(need_on(board, policy, len(channels.lags), robot.control_period) for board in BOARDS)
    on_board = OnBoard(channels.names, robot.control_period, needs, equal, cost)
    return Export(policy, on_board, tuple(folder / name for name in texts), seconds)


def _check_agreement(found: Agreement) -> None:
    """Raise DataError where a compiled header is not the policy."""
    if not found.is_equal:
        raise DataError(
            f"The compiled header is not the policy: its command is off by up to {found.max_error:.3g} N·m, "
            f"{found.max_of_bound:.2g} times what single precision explains, and its gain by "
            f"{100 * found.max_gain_error:.2g} % of the largest (expected at most 1 and {100 * MAX_GAIN_ERROR:g} %). "
            "Try another compiler by CC=..., and report the policy that shows it."
        )


def _has_no_more(policy: SavedPolicy, basis: int) -> bool:
    """Whether there is nothing to leave out: those without a weight are left out in any case."""
    return isinstance(policy, RbfPolicy) and int(np.count_nonzero(policy.weights)) <= basis


def _smaller(
    policy: SavedPolicy, basis: int, widths: Array, rng: np.random.Generator
) -> tuple[SavedPolicy, DistillationCost]:
    made = distilled(policy, basis, sampled_states(widths, _FITTED, rng))
    assert isinstance(policy, RbfPolicy)
    return made, cost_of(policy, made, sampled_states(widths, _JUDGED, rng), widths)


def _checked(
    text: str, policy: SavedPolicy, widths: Array, count: int, rng: np.random.Generator
) -> tuple[Agreement | None, float]:
    compiler = c_compiler()
    if not count or compiler is None:
        return None, float("inf")
    with CompiledPolicy(text, compiler) as compiled:
        return agreement(compiled, policy, widths, count, rng), compiled.seconds_per_call
