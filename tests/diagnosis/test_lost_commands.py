"""Whether commands were lost, told from single control periods of robots in MuJoCo."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from twbal.cli.main import main
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.diagnosis import commands_that_acted
from twbal.diagnosis.held_commands import HeldScores, acting, held_scores, sent_commands, with_several_lost
from twbal.diagnosis.lost_commands import LostFound, Mixture, lost_by, lost_commands
from twbal.diagnosis.lost_commands import _found as found_among
from twbal.diagnosis.name import QUIETEST, first_noise, largest_noise, with_fitted_noise
from twbal.diagnosis.side_findings import CommandLoss
from twbal.effects.library import library
from twbal.effects.lost_commands import LostCommands
from twbal.io.logs.writer import write_episode
from twbal.planar.parameters import planar_parameters
from twbal.sysid.held_out import Split
from twbal.sysid.model import Data, Model, Offsets
from twbal.sysid.recording import Usability, read_recordings
from twbal.virtual_robot.ground_truth import Noise

sys.path.insert(0, str(Path(__file__).parents[1] / "virtual_robot"))
from conftest import conf, make  # noqa: F401 - fixtures

NOISE = Noise(1e-3, 0.01, 0.1, 1e-3, 0.03, 0.01)
USABILITY = Usability(min_length=100, min_samples=200, max_yaw_rate=3.0, max_tilt=0.6)


def driven(robot, sheet, share, periods=800, seed=7, kicks=0.0):
    """An episode of a robot that a regulator shakes, with the commands as sent, and which of these it did not get.

    `kicks` is the standard deviation of torques [N·m] that act now and then, beside the commands.
    """
    rng, limit = np.random.default_rng(seed), sheet.torque_limit
    pushes = np.repeat(rng.normal(0.0, 0.1 * limit, periods // 5), 5)
    lost = rng.uniform(size=periods) < share
    lost[0] = False
    kick = np.where(rng.uniform(size=periods) < 0.1, rng.normal(0.0, kicks, periods), 0.0) if kicks else 0.0 * pushes
    seen, commands, acts = [robot.reset(seed)], [], 0.0
    for push, is_lost, more in zip(pushes, lost, kick, strict=True):
        now = seen[-1]
        speed = sheet.wheel_radius * (now.wheel_rate + now.tilt_rate)
        command = 80 * now.tilt + 14 * now.tilt_rate + 6 * speed + push
        commands.append(float(np.clip(command, -limit, limit)))
        acts = acts if is_lost else commands[-1]
        seen.append(robot.step(acts + more))
    observations = np.array(seen)
    source = Provenance(sheet.name, "robot")
    return Episode(
        ("tilt",),
        sheet.control_period,
        observations,
        observations[:, 1:2],
        np.array(commands),
        Outcome.COMPLETED,
        source,
    ), lost


def asked(episodes, sheet):
    """The data, and the model of the data sheet with its noise fitted."""
    recordings = read_recordings(episodes, [f"log {i}" for i, _ in enumerate(episodes)], sheet, USABILITY)
    data = Data(recordings, 2, largest_noise(sheet), QUIETEST)
    return data, with_fitted_noise(
        data, Model(planar_parameters(sheet, {}), 0.0, first_noise(sheet, data.sensed), (Offsets(),) * len(recordings))
    )


@pytest.mark.parametrize("share", [0.02, pytest.param(0.15, marks=pytest.mark.slow)])
def test_lost_commands_of_a_robot_in_mujoco_are_found_one_by_one(share, make, conf):  # noqa: F811
    sheet = conf("robot/paper")
    logs, lost = zip(*(driven(make("paper", start=0.02), sheet, share, seed=seed) for seed in (1, 2)), strict=True)
    found = lost_commands(*asked(logs, sheet))
    assert found.record.low95 < np.mean(np.concatenate(lost)) < found.record.high95
    assert found.record.high95 - found.record.low95 < 0.06
    told, lost = np.concatenate(found.lost), np.concatenate(lost)
    assert np.sum(told & ~lost) <= 0.01 * np.sum(lost)
    assert np.mean(told[lost]) > 0.6  # by the noise that lost commands make, too: a diagnosis asks again, see below


@pytest.mark.parametrize("faults", ["none", "moderate"])
def test_none_is_found_of_a_robot_that_gets_all(faults, make, conf):  # noqa: F811
    sheet = conf("robot/paper")
    assert lost_commands(*asked([driven(make("paper", faults, seed=3, start=0.02), sheet, 0.0)[0]], sheet)) is None


def test_large_errors_of_another_kind_are_not_taken_for_lost_commands(make, conf):  # noqa: F811
    sheet = conf("robot/paper")
    log, _ = driven(make("paper", start=0.02), sheet, 0.0, kicks=2.0)
    assert lost_commands(*asked([log], sheet)) is None


def test_too_few_commands_tell_nothing(make, conf):  # noqa: F811
    sheet = conf("robot/paper")
    data, model = asked([driven(make("paper", start=0.02), sheet, 0.2, periods=400)[0]], sheet)
    short = replace(data, recordings=[data.recordings[0].part(0, 150)])
    assert lost_commands(short, model) is None


def test_what_acts_is_the_last_command_that_came_through():
    rng = np.random.default_rng(5)
    sent, lost = rng.normal(size=300), rng.uniform(size=300) < 0.4
    expected = [sent[0]]
    for command, is_lost in zip(sent[1:], lost[1:], strict=True):
        expected.append(expected[-1] if is_lost else command)
    lost[0] = True  # nothing came before
    np.testing.assert_array_equal(acting(sent, lost), expected)


def test_a_score_is_what_the_prediction_errors_change_by(make, conf):  # noqa: F811
    """By one command changed alone, where others are changed with it in between, `_SPACING` apart."""
    sheet = conf("robot/paper")
    log, lost = driven(make("paper", start=0.02, sensors={"noise": NOISE}), sheet, 0.1, periods=400)
    (sent,) = sent_commands(*asked([log], sheet))
    found, at, errors = held_scores(sent, lost), 77, []
    for is_lost in (False, True):
        these = lost.copy()
        these[at] = is_lost
        errors.append(sent.errors(these)[at + 1 : at + 16].ravel())
    change = errors[0] - errors[1]
    assert found.sizes[at] == pytest.approx(np.linalg.norm(change), rel=0.02)
    assert found.scores[at] == pytest.approx(errors[0] @ change / np.linalg.norm(change), abs=0.1)


@pytest.mark.slow
def test_noise_alone_has_no_lost_commands():
    for seed in range(15):
        rng = np.random.default_rng(seed)
        scores = HeldScores(rng.lognormal(1.0, 1.0, 500), rng.normal(size=500))
        assert found_among(scores) is None


def test_several_lost_neighbours_are_found_where_no_single_change_helps(make, conf):  # noqa: F811
    sheet = conf("robot/paper")
    log, lost = driven(make("paper", start=0.02, sensors={"noise": NOISE}), sheet, 0.3, periods=400)
    _, model = asked([replace(log, commands=acting(log.commands, lost))], sheet)
    (sent,) = sent_commands(asked([log], sheet)[0], model)
    begun = lost.copy()
    begun[100:104] = ~lost[100:104]
    found = with_several_lost(sent, begun, np.ones(len(lost), dtype=bool), -1.0)
    shown = np.abs(np.diff(log.commands, prepend=0.0)) > 0.3
    assert np.sum((begun != lost) & shown) >= 2
    assert np.sum((found != lost)[95:110] & shown[95:110]) == 0
    kept = with_several_lost(sent, begun, np.zeros(len(lost), dtype=bool), -1.0)
    np.testing.assert_array_equal(kept, begun)


def test_what_another_model_takes_for_lost_is_taken_back(make, conf):  # noqa: F811
    """As where the model that is found with the commands that acted explains the data without lost ones."""
    sheet = conf("robot/paper")
    log, _ = driven(make("paper", start=0.02, sensors={"noise": NOISE}), sheet, 0.0)
    data, model = asked([log], sheet)
    assert lost_commands(data, model, [np.zeros(len(log.commands), dtype=bool)]) is None


def findings_of(data, model, *names):
    """What a search found, as far as lost commands ask of it."""
    chosen = SimpleNamespace(names=names, fit=SimpleNamespace(model=model))
    return SimpleNamespace(comparison=SimpleNamespace(data=data, chosen=chosen))


def told_in_turn(monkeypatch, recording, *shares):
    """Losses that are told one after the other, each other commands; None where there are none."""
    told = []
    for number, share in enumerate(shares):
        lost = np.arange(len(recording)) % 20 == number
        record = share and CommandLoss(share, 0.9 * share, 1.1 * share, 20, 400)
        told.append(record and LostFound(record, (lost,), Mixture(0.05, 0.0, 1.0, 5.0)))
    following = iter(told)
    monkeypatch.setattr(commands_that_acted, "lost_commands", lambda *given: next(following))


def test_the_first_findings_stand_where_a_later_model_shows_no_losses(make, conf, monkeypatch):  # noqa: F811
    sheet = conf("robot/paper")
    data, model = asked([driven(make("paper", start=0.02), sheet, 0.0, periods=400)[0]], sheet)
    split = Split(tuple(data.recordings), tuple(data.recordings), ("log",), are_ends=False)
    first, second = (findings_of(data, model, name) for name in ("a", "b"))
    told_in_turn(monkeypatch, data.recordings[0], 0.05, None)
    searched = []
    found = commands_that_acted.without_lost_commands(first, split, lambda r: searched.append(r) or second, print)
    assert found.findings is first
    assert found.split is split
    assert found.loss is None
    assert not np.array_equal(searched[0][0].commands, data.recordings[0].commands)


@pytest.mark.parametrize(
    ("sets", "searches"), [(["a", "a", "a", "a"], 1), (["a", "b", "b", "b"], 2), (["a", "b", "a", "b"], 3)]
)
def test_effects_are_searched_until_the_same_are_found(sets, searches, make, conf, monkeypatch):  # noqa: F811
    sheet = conf("robot/paper")
    data, model = asked([driven(make("paper", start=0.02), sheet, 0.0, periods=400)[0]], sheet)
    split = Split(tuple(data.recordings), tuple(data.recordings), ("log",), are_ends=False)
    first, *following = (findings_of(data, model, name) for name in sets)
    told_in_turn(monkeypatch, data.recordings[0], *np.linspace(0.05, 0.08, 4).tolist())
    searched = []

    def search(recordings):
        searched.append(recordings)
        return following[len(searched) - 1]

    found = commands_that_acted.without_lost_commands(first, split, search, print)
    assert len(searched) == searches
    assert found.findings is following[searches - 1]
    assert found.loss.share == pytest.approx(0.05 + 0.01 * (searches - 1))
    np.testing.assert_array_equal(found.split.fitted[0].commands, searched[-1][0].commands)


@pytest.mark.parametrize("good", [0, 1])
def test_a_search_that_fails_loses_nothing_that_was_found_before(good, make, conf, monkeypatch):  # noqa: F811
    sheet = conf("robot/paper")
    data, model = asked([driven(make("paper", start=0.02), sheet, 0.0, periods=400)[0]], sheet)
    split = Split(tuple(data.recordings), tuple(data.recordings), ("log",), are_ends=False)
    first, *following = (findings_of(data, model, name) for name in ("a", *"bc"[:good]))
    told_in_turn(monkeypatch, data.recordings[0], *np.linspace(0.05, 0.08, 4).tolist())
    later, said = iter(following), []

    def search(recordings):
        if (found := next(later, None)) is None:
            raise ValueError("array must not contain infs or NaNs")
        return found

    found = commands_that_acted.without_lost_commands(first, split, search, said.append)
    assert found.findings is first
    assert found.split is split
    assert found.loss is None
    assert "array must not contain infs" in said[-1]


def test_of_held_out_data_only_what_is_not_known_is_asked(make, conf):  # noqa: F811
    sheet = conf("robot/paper")
    log, lost = driven(make("paper", start=0.02, sensors={"noise": NOISE}), sheet, 0.1)
    data, model = asked([log], sheet)
    found = lost_commands(data, model)
    begun, free = np.zeros(len(lost), dtype=bool), np.arange(len(lost)) >= 600
    begun[:600] = lost[:600]
    (told,) = lost_by(found.mixture, data, model, [begun], [free])
    np.testing.assert_array_equal(told[:600], lost[:600])
    assert np.mean(told[600:][lost[600:]]) > 0.6
    assert np.sum(told[600:] & ~lost[600:]) <= 2


def link(conf, share, steps=3, seed=2):  # noqa: F811
    """The link to a robot whose control period has so many physics steps."""
    robot = conf("robot/paper")
    return LostCommands(share).on(robot).start(robot.control_period / steps, np.random.default_rng(seed))


def test_the_effect_holds_a_share_of_the_commands(conf):  # noqa: F811
    through, sent = link(conf, 0.3), np.arange(1.0, 4001.0)
    acts = np.array([[through(command) for _ in range(3)] for command in sent])
    assert np.all(acts == acts[:, :1])
    came = acts[:, 0] == sent
    assert np.mean(came) == pytest.approx(0.7, abs=4 * np.sqrt(0.21 / 4000))
    np.testing.assert_array_equal(acts[~came, 0], np.concatenate([[0.0], acts[:-1, 0]])[~came])
    assert abs(np.corrcoef(came[1:], came[:-1])[0, 1]) < 4 / np.sqrt(4000)  # each is drawn for itself
    through = link(conf, 0.0)
    assert [through(command) for command in sent for _ in range(3)] == np.repeat(sent, 3).tolist()


def test_a_command_that_stays_comes_through_at_last(conf):  # noqa: F811
    for seed in range(50):
        through = link(conf, 0.5, steps=4, seed=seed)
        for _ in range(30 * 4):
            last = through(1.0)
        assert last == 1.0


def test_the_planar_model_does_without_it(conf):  # noqa: F811
    sheet = conf("robot/paper")
    assert "lost_commands" not in library()
    assert planar_parameters(sheet, {"lost_commands": {"share": 0.1}}) == planar_parameters(sheet, {})


def test_the_sentence_says_how_many():
    text = CommandLoss(0.0512, 0.043, 0.061, 52, 980).text
    assert "did not get 5.1 % of its commands in time (4.3 to 6.1 %)" in text
    assert "52 of 980" in text


@pytest.mark.slow
def test_a_diagnosis_finds_the_rest_by_the_commands_that_acted(make, conf, tmp_path):  # noqa: F811
    sheet, share = conf("robot/paper"), 0.1
    files, lost = [tmp_path / f"{seed}.mcap" for seed in (1, 2)], []
    for seed, file in enumerate(files, start=1):
        robot = make("paper", start=0.02, drive={"delay": 0.012}, sensors={"noise": NOISE})
        log, those = driven(robot, sheet, share, periods=1000, seed=seed)
        write_episode(file, log)
        lost.append(those)
    out = tmp_path / "out"
    listed = f"episodes=[{','.join(map(str, files))}]"
    assert main(["diagnose", listed, f"hydra.run.dir={out}"]) == 0
    record = json.loads((out / "diagnosis.json").read_text())
    loss = record["lost_commands"]
    assert loss["low95"] < np.mean(lost) < loss["high95"]
    (delay,) = (effect for effect in record["effects"] if effect["is_named"])
    assert delay["name"] == "actuation_delay"
    found = delay["parameters"]["delay"]
    assert found["low95"] < 0.012 < found["high95"]
    assert "did not get" in (out / "report.html").read_text()
    again = tmp_path / "again"
    assert main(["diagnose", listed, f"sim={out / 'augmented.yaml'}", f"hydra.run.dir={again}"]) == 0
    second = json.loads((again / "diagnosis.json").read_text())
    assert second["lost_commands"]["low95"] < np.mean(lost) < second["lost_commands"]["high95"]
    assert second["verdict"] == "none"
    made = f"hydra.run.dir={tmp_path / 'sim'}"
    assert main(["sim-collect", f"sim={out / 'augmented.yaml'}", "rollouts=1", made]) == 0
