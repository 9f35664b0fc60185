"""The policy on board: told by its number, put there by a command of the person's, and refused where it is another."""

import os
import re
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hydra import compose
from omegaconf import OmegaConf

from twbal.cli.composition import composing
from twbal.cli.link_gate import announced_by, carry_check
from twbal.cli.main import main
from twbal.cli.policy_on_board import BoardPolicy, OtherPolicyError, prepared_link, put_on_board
from twbal.cli.stages.real_rollout import check_robot_is_there
from twbal.core.channels import Channels
from twbal.core.errors import ConfigError
from twbal.core.robot_parameters import parameter_hash
from twbal.embedded.header import Exported, header, identity_in
from twbal.link.decoder import Decoder, to_wire
from twbal.link.protocol import Welcome
from twbal.link.serial_plant import SerialPlant
from twbal.link.transport import Transport
from twbal.policies.exploring import ExploringPolicy
from twbal.policies.saved import load_policy
from twbal.sheets.link_record import LinkRecord, keep_record, last_record, records_folder
from twbal.virtual_robot.process import VirtualRobotProcess, virtual_robot_command

POLICY = Path(__file__).resolve().parents[2] / "data" / "regression" / "policy.pt"
FLASH = r"sed -n 's/^#define TWBAL_POLICY_ID 0x\([0-9a-f]*\)u.*/\1/p' $POLICY_FOLDER/policy.h > flash; echo done"


class Board(Transport):
    """A robot that says who it is: its policy is what stands in the file `flash`, and each flash is a new build."""

    name = "memory"

    def __init__(self, flash):
        self._flash, self._decoder, self._waiting = flash, Decoder(2), b""

    def read(self):
        data, self._waiting = self._waiting, b""
        return data

    def write(self, data):
        policy = int(self._flash.read_text(), 16)
        for hello in self._decoder.feed(data):
            build = policy % 1000
            said = Welcome(hello.seq, 2, 20_000, 20.0, policy=policy, firmware=build, name="board")
            self._waiting += to_wire(said)

    def close(self):
        pass


@pytest.fixture
def flash(tmp_path, monkeypatch):
    """What is on board; commands run beside it."""
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "flash"
    file.write_text("deadbeef")
    return file


@pytest.fixture
def wanted(tmp_path, paper):
    policy = load_policy(POLICY)
    folder = tmp_path / "on_board"
    folder.mkdir()
    text = header(Exported(policy, Channels(policy.channels, paper.wheel_radius, 0.02), 0.02, "paper", "Of a test."))
    (folder / "policy.h").write_text(text)
    return BoardPolicy(folder / "policy.h", identity_in(text))


def opens(flash, deploy):
    return partial(SerialPlant, Board(flash), 1.0, 1.0, 1.0, deploy=deploy)


def test_a_policy_is_told_by_its_law_and_its_state_and_not_by_where_it_comes_from(paper):
    policy = load_policy(POLICY)
    exported = Exported(policy, Channels(policy.channels, paper.wheel_radius, 0.02), 0.02, "paper", "Of today.")
    same = exported._replace(origin="Of another day.")
    others = (
        exported._replace(policy=replace(policy, gain=1.0001 * np.asarray(policy.gain))),
        exported._replace(channels=replace(exported.channels, wheel_radius=0.2)),
        exported._replace(control_period=0.01),
    )
    numbers = [identity_in(header(each)) for each in (exported, same, *others)]
    assert header(exported) != header(same)
    assert numbers[0] == numbers[1]
    assert len(set(numbers)) == 4


def test_a_robot_that_has_the_policy_is_left_alone(flash, wanted, paper):
    flash.write_text(f"{wanted.number:08x}")
    put_on_board(wanted, opens(flash, "exit 3"), paper)


def test_a_robot_with_another_policy_gets_this_one_by_the_command(flash, wanted, paper, capsys):
    put_on_board(wanted, opens(flash, FLASH), paper)
    assert int(flash.read_text(), 16) == wanted.number
    assert "on board: sed" in capsys.readouterr().out
    assert (wanted.header.parent / "deploy.txt").read_text() == "done\n"


@pytest.mark.parametrize(
    ("deploy", "said"),
    [
        (
            None,
            r"'board' has the policy deadbeef on board; the one .* Build its firmware with .*policy\.h, flash it, and ",
        ),
        ("echo no board >&2; exit 3", r"link\.deploy ended with exit code 3: echo .*\. It said: no board$"),
        ("false", r"exit code 1: false\. It said: nothing$"),
        ("true", r"link\.deploy was run: true\. The robot 'board' has the policy deadbeef on board"),
    ],
)
def test_a_robot_that_keeps_another_policy_is_refused_in_one_line(deploy, said, flash, wanted, paper):
    with pytest.raises(ConfigError, match=said) as refused:
        put_on_board(wanted, opens(flash, deploy), paper)
    assert "\n" not in str(refused.value)
    assert isinstance(refused.value, OtherPolicyError) == (deploy is None)


@pytest.mark.parametrize("problems", [(), ("stop",)])
def test_the_last_check_goes_on_to_hold_where_only_the_policy_was_changed(problems, flash, wanted, paper):
    with opens(flash, FLASH)() as plant:
        announced = announced_by(plant)
    keep_record(LinkRecord("paper", parameter_hash(paper), announced, "2026-01-01", problems, ()), records_folder())
    put_on_board(wanted, opens(flash, FLASH), paper)
    found = last_record(records_folder(), "paper", "board").announced
    build = announced.firmware if problems else wanted.number % 1000
    assert found == announced._replace(firmware=build)
    assert build != announced.firmware or problems


def test_a_check_is_not_carried_to_a_robot_that_changed_in_more_than_its_build(flash, wanted, paper):
    with opens(flash, None)() as plant:
        announced = announced_by(plant)
        before = announced._replace(torque_limit=10.0)
        keep_record(LinkRecord("paper", parameter_hash(paper), before, "2026-01-01", (), ()), records_folder())
        carry_check(before, plant, paper)
    assert last_record(records_folder(), "paper", "board").announced == before


def test_noise_is_not_on_board_so_that_an_exploring_policy_commands_from_here(paper, tmp_path, capsys):
    cfg = OmegaConf.create({"link": {"on_board": True, "port": "none"}})
    policy = ExploringPolicy(load_policy(POLICY), 1.0, 20.0)
    channels = Channels(("tilt",), 0.15, 0.02)
    link = prepared_link(cfg, paper, channels, policy, tmp_path / "on_board", launch=None)
    assert link == {"on_board": False, "port": "none"}
    assert "commands come from here" in capsys.readouterr().out
    assert not (tmp_path / "on_board").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("as_from_a_shell")
def test_a_rollout_of_a_policy_that_is_not_on_board_stops_with_its_header_and_goes_on_once_it_is(capfd):
    """As with a board that a person flashes by hand: the header is there, and the same command goes on."""
    firmware = Path(__file__).resolve().parents[2] / "firmware"
    build = f"make -s -C {firmware} BUILD={os.getcwd()}/build"
    assert os.system(build) == 0
    command = ["real-rollout", f"policy.path={POLICY}", "state=rolling", "link=firmware", "hydra.run.dir=run"]
    command += ["link.program=build/robot_posix", "link.on_board=true", "link.deploy=null", "steps=20"]
    assert main(command) == 1
    said = re.search(
        r"has no policy on board; .* Build its firmware with (run/on_board/policy.h),", capfd.readouterr().err
    )
    assert os.system(f"{build} POLICY={Path(said.group(1)).resolve().parent}") == 0
    assert main(command) == 0
    assert len(list(Path("run/episodes").iterdir())) == 1


@pytest.mark.slow
@pytest.mark.usefixtures("as_from_a_shell")
def test_a_robot_on_a_port_without_a_policy_is_learned_for_until_one_is_to_drive_on_board(capfd):
    """Its check before the learning asks for no policy; the first rollout of one does."""
    with closing(VirtualRobotProcess.ready(virtual_robot_command([]), 200.0)) as robot:
        words = ["link=serial", f"link.port={robot.port}", "link.on_board=true", "link.confirm_placed=null"]
        with composing():
            check_robot_is_there(compose("iterate", words))
        assert main(["real-rollout", f"policy.path={POLICY}", "state=rolling", "hydra.run.dir=run", *words]) == 1
    assert "has no policy on board; " in capfd.readouterr().err
    assert Path("run/on_board/policy.h").exists()
    assert not Path("run/episodes").exists()
