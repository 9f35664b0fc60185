"""The policy on board of a robot: whether it is the one that is to drive, and how it gets there."""

import os
import subprocess
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import NamedTuple

from omegaconf import DictConfig

from twbal import __version__
from twbal.cli.artefacts import policy_hash
from twbal.cli.console import say
from twbal.cli.link_gate import announced_by, carry_check
from twbal.cli.robot_link import commanded_from_here, robot_link
from twbal.core.channels import Channels
from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import RobotParameters
from twbal.core.streams import Stream, generator
from twbal.embedded.board_export import HEADER, export_to
from twbal.embedded.header import identity_in
from twbal.link.serial_plant import SerialPlant
from twbal.policies.policy import Policy
from twbal.policies.saved import SavedPolicy
from twbal.sheets.link_record import Announced
from twbal.virtual_robot.process import Launch

FOLDER = "on_board"
"""Of a run folder: where the header of its policy lies."""
_CHECKED = 2000  # states at which the compiled header is compared with the policy
_SAID, _TAIL = "deploy.txt", 1000  # what a command says, and how much of it a message has [characters]

OpenLink = Callable[[], AbstractContextManager[SerialPlant]]


class BoardPolicy(NamedTuple):
    """A policy that is to drive on board.

    Attributes:
        header: its `policy.h`.
        number: by which a robot announces it.
    """

    header: Path
    number: int


class OtherPolicyError(ConfigError):
    """The policy on board is not the one that is to drive."""


def prepared_link(
    cfg: DictConfig, robot: RobotParameters, channels: Channels, policy: Policy, folder: Path, launch: Launch
) -> DictConfig:
    """The link by which a policy drives, from here or on board; there it is, then.

    A policy with noise or a test signal on its command, which no board has, drives from here.

    Args:
        cfg: of a stage that drives by a policy.
        robot: its sheet.
        channels: the state.
        policy: that is to drive.
        folder: for its header.
        launch: starts the virtual robot, where `cfg` asks for one.

    Raises:
        OtherPolicyError: the robot has another one on board, and nothing that changes that.
        ConfigError: the policy cannot be exported, or the command that is to put it there fails.
        DataError: the compiled header is another policy.
    """
    from_here = commanded_from_here(cfg.link)
    if not cfg.link.get("on_board", False):
        return from_here
    if not isinstance(policy, SavedPolicy):
        say("commands come from here: noise of exploration and test signals are not on board")
        return from_here
    wanted = board_policy(cfg, robot, channels, policy, folder)
    put_on_board(wanted, partial(robot_link, from_here, launch), robot)
    return cfg.link  # type: ignore[no-any-return]


def board_policy(
    cfg: DictConfig, robot: RobotParameters, channels: Channels, policy: SavedPolicy, out: Path
) -> BoardPolicy:
    """The policy of a stage, exported to `out`.

    Raises:
        ConfigError: it cannot be exported.
        DataError: the compiled header is another policy.
    """
    origin = f"Made by twbal {__version__} for {robot.name}; policy {policy_hash(cfg.policy)[:16]}."
    rng = generator(Stream.ON_BOARD, 0)
    export_to(out, policy, channels, robot, cfg.tilt_limit, origin, rng, checked=_CHECKED)
    header = out / HEADER
    return BoardPolicy(header, identity_in(header.read_text()))


def check_policy_on_board(plant: SerialPlant, wanted: BoardPolicy) -> None:
    """Raise OtherPolicyError where a robot has another policy on board, or none."""
    if plant.policy == wanted.number:
        return
    has = f"the policy {plant.policy:08x} on board" if plant.policy else "no policy on board"
    raise OtherPolicyError(
        f"The robot {plant.robot_name!r} has {has}; the one that is to drive is {wanted.number:08x}. Build its "
        f"firmware with {wanted.header}, flash it, and give the same command again; or have that done by "
        "link.deploy=<command> (docs/firmware.md)."
    )


def put_on_board(wanted: BoardPolicy, open_link: OpenLink, robot: RobotParameters) -> None:
    """See to it that a robot has the policy on board.

    Args:
        wanted: the policy.
        open_link: opens the robot, whatever is on board.
        robot: its sheet; the last check of its link goes on to hold.

    Raises:
        OtherPolicyError: it has another one, and nothing that changes that.
        ConfigError: the command that is to change it fails, or changes nothing.
    """
    before: Announced | None = None
    deploy: str | None = None
    try:
        with open_link() as plant:
            before, deploy = announced_by(plant), plant.deploy
            check_policy_on_board(plant, wanted)
            return
    except OtherPolicyError:  # the link is closed, and a virtual robot ended: both may be built anew
        if deploy is None or before is None:
            raise
    _run(deploy, wanted.header.parent)
    with open_link() as plant:
        try:
            check_policy_on_board(plant, wanted)
        except OtherPolicyError as error:
            raise ConfigError(f"The command of link.deploy was run: {deploy}. {error}") from error
        carry_check(before, plant, robot)


def _run(command: str, folder: Path) -> None:
    """Run a command of the person's, with what it says kept in `folder`."""
    say(f"on board: {command}")
    place = folder.resolve()
    said = place / _SAID
    with said.open("w") as output:
        environment = {**os.environ, "POLICY_FOLDER": str(place)}
        code = subprocess.run(command, shell=True, env=environment, stdout=output, stderr=output).returncode
    if code:
        tail = " ".join(said.read_text(errors="replace")[-_TAIL:].split()) or "nothing"
        raise ConfigError(f"The command of link.deploy ended with exit code {code}: {command}. It said: {tail}")
