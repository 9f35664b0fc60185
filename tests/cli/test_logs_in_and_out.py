"""Logs come in from anywhere, and episodes go out to any program: import-log, export, recover and show."""

import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest
import yaml
from foreign_logs import NAMES, PERIOD, columns, text
from hydra import compose
from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.cli.artefacts import episode_files
from twbal.cli.commands import text as text_of
from twbal.cli.composition import composing
from twbal.cli.conf_folder import conf_folder
from twbal.cli.config_check import check_configuration
from twbal.cli.main import main
from twbal.core.files import write_atomically
from twbal.io.logs import read_episode
from twbal.sysid.recording import Usability, read_recordings

ROBOT = f"robot.control_period={PERIOD}"


@pytest.fixture
def drawn():
    """For tests that look at pictures."""


@pytest.fixture(autouse=True)
def drawn_if_asked_for(request, monkeypatch):
    """Other tests do without: pictures take half of the time of an import."""
    if "drawn" not in request.fixturenames:
        monkeypatch.setattr("twbal.cli.stages.import_log.save", lambda figure, path, **_: write_atomically(path, ""))


@pytest.fixture
def run(tmp_path, capsys):
    def command(stage, *words, out="out"):
        code = main([stage, *words, f"hydra.run.dir={tmp_path / out}"])
        said = capsys.readouterr()
        return code, said.out, said.err

    return command


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "ride.csv"
    path.write_text(text(columns()))
    return path


@pytest.fixture
def episode(run, log, tmp_path):
    assert run("import-log", f"files={log}", ROBOT, out="imported")[0] == 0
    return tmp_path / "imported" / "episodes" / "ride.mcap"


def test_what_is_exported_and_imported_again_is_the_same(run, episode, tmp_path):
    assert run("export", f"episodes={episode}", out="csv")[0] == 0
    assert run("import-log", f"files={tmp_path / 'csv' / 'ride.csv'}", ROBOT, out="again")[0] == 0
    first, again = read_episode(episode), read_episode(tmp_path / "again" / "episodes" / "ride.mcap")
    assert again.control_period == first.control_period
    assert again.observations == pytest.approx(first.observations, abs=1e-12)
    assert again.commands == pytest.approx(first.commands, abs=1e-12)
    assert again.states == pytest.approx(first.states, abs=1e-12)


def test_parquet_has_the_same_numbers(run, episode, tmp_path):
    pytest.importorskip("pyarrow", reason="comes with the extra [viewers]")
    assert run("export", f"episodes={episode}", "format=parquet", out="parquet")[0] == 0
    rows = pandas.read_parquet(tmp_path / "parquet" / "ride.parquet")
    assert rows["tilt"].to_numpy() == pytest.approx(read_episode(episode).tilt, abs=0)


def test_a_channel_that_was_worked_out_says_so_in_log_and_table(run, tmp_path):
    path = tmp_path / "few.csv"
    kept = [NAMES.index(name) for name in ("time", "tilt", "wheel_angle", "command")]
    path.write_text(text(columns()[:, kept], names=[NAMES[k] for k in kept]))
    gone = "import.quantities={time:{from:time},tilt:{from:tilt},wheel_angle:{from:wheel_angle},command:{from:command},"
    words = gone + "tilt_rate:null,acceleration:null,yaw_rate:null,wheel_rate:null}"
    code, said, _ = run("import-log", f"files={path}", ROBOT, words, out="imported")
    assert code == 0
    assert "worked out: tilt_rate" in said
    log = tmp_path / "imported" / "episodes" / "few.mcap"
    assert {e.channel for e in read_episode(log).estimated} == {"tilt_rate", "wheel_rate", "yaw_rate", "acceleration"}
    assert run("export", f"episodes={log}", out="csv")[0] == 0
    assert "tilt_rate_estimated" in pandas.read_csv(tmp_path / "csv" / "few.csv").columns


@pytest.mark.parametrize(
    ("own", "out"),
    [(False, "guess"), (True, "guess"), (True, "Anna's guess ü")],
    ids=["packaged sheet", "own sheet", "own sheet and a folder with all sorts of letters"],
)
def test_the_next_command_of_a_guess_works(own, out, run, tmp_path, capsys):
    path = tmp_path / "theirs.csv"
    path.write_text(text(columns()))
    (tmp_path / "mine" / "robot").mkdir(parents=True)
    sheet = (conf_folder() / "robot" / "paper.yaml").read_text().replace("name: paper", "name: mine")
    (tmp_path / "mine" / "robot" / "mine.yaml").write_text(sheet)
    words = (f"--config-dir={tmp_path / 'mine'}", "robot=mine") if own else ()
    code = main(["import-log", "guess=true", f"files={path}", *words, f"hydra.run.dir={text_of(str(tmp_path / out))}"])
    said = capsys.readouterr().out
    assert code == 0
    stage, *printed = shlex.split(said.splitlines()[-1].split("twbal ")[1])
    assert run(stage, *printed, ROBOT, out="imported")[0] == 0
    assert (tmp_path / "imported" / "episodes" / "theirs.mcap").exists()


def test_a_mapping_of_ones_own_without_a_target_is_one_clear_error(run, log, tmp_path):
    (tmp_path / "mine" / "import").mkdir(parents=True)
    (tmp_path / "mine" / "import" / "bad.yaml").write_text("quantities:\n  tilt: {from: pitch, unit: deg}\n")
    code, _, said = run("import-log", f"--config-dir={tmp_path / 'mine'}", "import=bad", f"files={log}")
    assert code == 1
    assert "The mapping lacks its first entry. Add `_target_: twbal.io.importers.mapping.mapping`" in said
    assert len(said.splitlines()) == 1


def test_a_guess_is_a_mapping_that_works(run, tmp_path):
    path = tmp_path / "theirs.csv"
    rows = columns()
    theirs = np.column_stack([1e3 * rows[:, 0], np.degrees(rows[:, 1]), rows[:, 5], rows[:, 5], rows[:, 7]])
    path.write_text(text(theirs, names=("t_ms", "pitch [deg]", "wheel_angle_left", "wheel_angle_right", "torque")))
    code, said, _ = run("import-log", "guess=true", f"files={path}", out="guess")
    assert code == 0
    assert "unit: deg" in said
    words = (f"--config-dir={tmp_path / 'guess'}", "import=my_log", f"files={path}", ROBOT)
    assert run("import-log", *words, out="imported")[0] == 0
    episode = read_episode(tmp_path / "imported" / "episodes" / "theirs.mcap")
    assert episode.tilt == pytest.approx(rows[:, 1], abs=1e-6)


@pytest.mark.parametrize(("words", "is_said"), [((), True), (("robot=paper",), False)])
def test_a_robot_that_nobody_chose_is_said(words, is_said, run, log):
    code, said, _ = run("import-log", f"files={log}", ROBOT, *words, out="imported")
    assert code == 0 and ("taken for those of robot paper, as no robot=... is given" in said) == is_said


def test_a_duty_cycle_is_imported_by_the_torque_limit_as_the_comments_of_its_guess_say(run, tmp_path):
    """The block `motor` may be gone, too."""
    path, rows = tmp_path / "theirs.csv", columns()
    pwm = np.round(255 * rows[:, 7])
    theirs = np.column_stack([rows[:, 0], rows[:, 1], rows[:, 5], pwm])
    path.write_text(text(theirs, names=("t [s]", "pitch [rad]", "wheel_angle [rad]", "pwm")))
    code, said, _ = run("import-log", "guess=true", f"files={path}", "robot=balboa", out="guess")
    assert code == 0 and "without the data of a motor: take the command from the torque_limit" in said
    mapping = tmp_path / "guess" / "import" / "my_log.yaml"
    lines = [line for line in mapping.read_text().splitlines() if not line.startswith(("  command:", "  voltage:"))]
    first = next(k for k, line in enumerate(lines) if line.startswith("motor:"))
    del lines[first : first + 6]
    lines = ["  " + line[4:] if line.startswith("#   ") else line for line in lines]
    mapping.write_text("\n".join(lines))
    words = (f"--config-dir={tmp_path / 'guess'}", "import=my_log", f"files={path}", "robot=balboa", ROBOT)
    assert run("import-log", *words, out="imported")[0] == 0
    episode = read_episode(tmp_path / "imported" / "episodes" / "theirs.mcap")
    assert episode.commands == pytest.approx(1.99 / 255 * pwm[:-1], rel=1e-4)


@pytest.mark.parametrize("volts", ["volts", "pwm [%]"])
def test_what_the_mapping_of_a_robot_knows_is_taken_into_a_guess(volts, run, tmp_path):
    """The motor is the robot's; how rows were written is that of logs with the same columns."""
    path, rows = tmp_path / "theirs.csv", columns()
    theirs = np.column_stack([rows[:, 0], rows[:, 1], rows[:, 5], rows[:, 7]])
    path.write_text(text(theirs, names=("t [s]", "tilt [rad]", "wheel_angle [rad]", volts)))
    for folder in ("import", "robot"):
        (tmp_path / "mine" / folder).mkdir(parents=True)
    sheet = (conf_folder() / "robot" / "paper.yaml").read_text().replace("name: paper", "name: mine")
    (tmp_path / "mine" / "robot" / "mine.yaml").write_text(sheet)
    (tmp_path / "mine" / "import" / "mine.yaml").write_text(
        "defaults: [columns, _self_]\n"
        "quantities:\n"
        "  time: {from: 't [s]', unit: s}\n  tilt: {from: 'tilt [rad]', unit: rad}\n"
        "  wheel_angle: {from: 'wheel_angle [rad]', unit: rad}\n  voltage: {from: volts, unit: V}\n"
        "  tilt_rate: null\n  acceleration: null\n  yaw_rate: null\n  wheel_rate: null\n  command: null\n"
        "motor: {_target_: twbal.core.motor.Motor, resistance: 2.5, torque_constant: 0.5, gear: 1.0, supply: 7.0}\n"
        "command_is_sample: true\n"
    )
    words = (f"--config-dir={tmp_path / 'mine'}", "robot=mine", f"files={path}")
    code, said, _ = run("import-log", "guess=true", *words, out="guess")
    assert code == 0 and "fill in (???)" not in said
    mapping = yaml.safe_load((tmp_path / "guess" / "import" / "my_log.yaml").read_text())
    motor = {"resistance": 2.5, "torque_constant": 0.5, "gear": 1.0, "supply": 7.0}
    assert mapping["motor"] == {"_target_": "twbal.core.motor.Motor", **motor}
    assert mapping["command_is_sample"] is (volts == "volts")
    words = (f"--config-dir={tmp_path / 'guess'}", "import=my_log", f"files={path}", ROBOT)
    assert run("import-log", *words, out="imported")[0] == 0


@pytest.mark.parametrize("format", ["csv", "parquet"])
@pytest.mark.parametrize("robot", [pytest.param("paper", marks=pytest.mark.slow), "regbot"])
def test_a_guess_of_an_exported_table_brings_the_same_numbers_back(format, robot, run, log, tmp_path):
    if format == "parquet":
        pytest.importorskip("pyarrow", reason="comes with the extra [viewers]")
    told = (f"robot={robot}", ROBOT)
    measured = ("++import.quantities.tilt_rate=null", "++import.quantities.wheel_rate=null") * (robot == "regbot")
    assert run("import-log", f"files={log}", *told, *measured, out="first")[0] == 0
    first = tmp_path / "first" / "episodes" / "ride.mcap"
    assert run("export", f"episodes={first}", f"format={format}", out="table")[0] == 0
    table = tmp_path / "table" / f"ride.{format}"
    code, said, _ = run("import-log", "guess=true", f"files={table}", *told, out="guess")
    assert code == 0
    assert "fill in (???)" not in said
    words = (f"--config-dir={tmp_path / 'guess'}", "import=my_log", f"files={table}")
    assert run("import-log", *words, *told, out="again")[0] == 0
    was, now = read_episode(first), read_episode(tmp_path / "again" / "episodes" / "ride.mcap")
    assert now.commands == pytest.approx(was.commands, abs=0)
    assert now.observations == pytest.approx(was.observations, abs=1e-12)
    assert now.states == pytest.approx(was.states, abs=1e-12)
    assert [e.channel for e in now.estimated] == [e.channel for e in was.estimated]


def test_what_a_guess_leaves_open_is_asked_for_and_never_taken_from_elsewhere(run, log, tmp_path):
    rows = columns()
    rows = np.column_stack([rows[:, :3], rows[:, 5], rows[:, 7], rows[:, 7]])
    log.write_text(text(rows, names=("time", "pitch", "roll", "wheel_angle", "command", "torque_left")))
    code, said, _ = run("import-log", "guess=true", f"files={log}", out="guess")
    assert code == 0
    assert "fill in (???): tilt (pitch or roll?)" in said
    words = (f"--config-dir={tmp_path / 'guess'}", "import=my_log", f"files={log}", ROBOT)
    code, _, said = run("import-log", *words, out="imported")
    assert code == 1
    assert "import.quantities.tilt.from" in said
    assert len(said.splitlines()) == 1


def test_a_bad_file_leaves_the_others_and_is_listed(run, log, tmp_path):
    bad = tmp_path / "short.csv"
    bad.write_text(text(columns(28)))
    files = f"files=[{log},{bad}]"
    code, told, said = run("import-log", files, ROBOT, out="imported")
    assert code == 1
    assert "1 of 2 files were not imported" in said
    assert len(said.splitlines()) == 1
    assert told.count("not imported: ") == 1
    out = tmp_path / "imported"
    assert [path.name for path in (out / "episodes").iterdir()] == ["ride.mcap"]
    (why,) = (out / "not_imported.txt").read_text().splitlines()
    assert why.startswith(f"{bad} has no recording of 50 samples without a gap: 1 part without a gap of at most 28")
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["complete"]
    assert "not_imported.txt" in [made["path"] for made in manifest["outputs"]]


def test_whatever_is_wrong_with_some_files_the_others_are_imported(run, log, tmp_path):
    (tmp_path / "folder.csv").mkdir()
    for name, content in {"theirs.mcap": b"\x89MCAP", "binary.csv": bytes(200), "empty.csv": b""}.items():
        (tmp_path / name).write_bytes(content)
    bad = ["missing.csv", "folder.csv", "theirs.mcap", "binary.csv", "empty.csv"]
    files = ",".join(str(path) for path in [*(tmp_path / name for name in bad), log])
    code, told, said = run("import-log", f"files=[{files}]", ROBOT, out="imported")
    assert code == 1
    assert "5 of 6 files were not imported" in said
    lines = [line for line in told.splitlines() if "not imported: " in line]
    assert [name for name in bad if sum(name in line for line in lines) == 1] == bad
    assert len(lines) == len(bad)
    assert (tmp_path / "imported" / "episodes" / "ride.mcap").exists()
    assert "next  twbal diagnose" in told


def test_files_of_one_name_are_told_apart_by_their_folders(run, tmp_path):
    for k, folder in enumerate(("monday", "friday")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "ride.csv").write_text(text(columns(300) + 1e-3 * k))
    files = f"files=[{tmp_path}/monday/ride.csv,{tmp_path}/friday/ride.csv]"
    assert run("import-log", files, ROBOT, out="imported")[0] == 0
    made = {path.name for path in (tmp_path / "imported" / "episodes").iterdir()}
    assert made == {"monday_ride.mcap", "friday_ride.mcap"}


def test_a_part_of_one_file_and_another_file_of_its_name_are_both_kept(run, tmp_path):
    rows = columns()
    (tmp_path / "ride.csv").write_text(text(np.delete(rows, np.arange(150, 200), axis=0)))
    (tmp_path / "ride_1.csv").write_text(text(rows + np.where(np.array(NAMES) == "tilt", 1e-3, 0.0)))
    files = f"files=[{tmp_path / 'ride.csv'},{tmp_path / 'ride_1.csv'}]"
    code, _, _ = run("import-log", files, ROBOT)
    assert code == 0
    found = sorted(path.name for path in (tmp_path / "out" / "episodes").glob("*.mcap"))
    assert found == ["ride_0.mcap", "ride_1.mcap", "ride_1_2.mcap"]
    assert len(read_episode(tmp_path / "out" / "episodes" / "ride_1_2.mcap")) == len(rows) - 1
    said = [read_episode(tmp_path / "out" / "episodes" / name).provenance.config for name in found]
    assert [text.splitlines()[-1] for text in said] == ['imported_from: "ride"'] * 2 + ['imported_from: "ride_1"']
    logs = ",".join(str(tmp_path / folder / "ride.mcap") for folder in ("a", "b"))
    for folder, name in (("a", "ride"), ("b", "ride"), ("c", "ride_0")):
        (tmp_path / folder).mkdir()
        shutil.copy(tmp_path / "out" / "episodes" / "ride_0.mcap", tmp_path / folder / f"{name}.mcap")
    code, _, _ = run("export", f"episodes=[{logs},{tmp_path / 'c' / 'ride_0.mcap'}]", out="tables")
    assert code == 0 and len(list((tmp_path / "tables").glob("*.csv"))) == 3


@pytest.mark.parametrize("name", ["früh", "ride 🤖", 'a "b" \\u0041'])
def test_the_name_of_a_log_is_read_as_it_was_written(name, run, tmp_path):
    (tmp_path / f"{name}.csv").write_text(text(columns()))
    quoted = str(tmp_path / f"{name}.csv").replace("'", "\\'")
    assert run("import-log", f"files='{quoted}'", ROBOT)[0] == 0
    episode = read_episode(tmp_path / "out" / "episodes" / f"{name}.mcap")
    assert OmegaConf.create(episode.provenance.config).imported_from == name


def test_a_file_that_is_imported_again_with_another_mapping_alone_is_no_warning(run, log):
    words = [(), ("++import.quantities.tilt.scale=1.01",), ("import.skip=0.01",), ("import.skip=0.01",)]
    told = [run("import-log", f"files={log}", ROBOT, *more, out=f"im_{k}")[1] for k, more in enumerate(words)]
    lines = [[line for line in said.splitlines() if "imported before" in line] for said in told]
    assert [["WARNING" in line for line in found] for found in lines] == [[], [False], [False], [True]]


def test_what_an_earlier_call_imported_is_said(run, log, tmp_path):
    code, first, _ = run("import-log", f"files={log}", ROBOT, out="first")
    assert code == 0
    assert "before" not in first
    renamed, cut = tmp_path / "same.csv", tmp_path / "cut.csv"
    renamed.write_text(log.read_text())
    cut.write_text(text(columns()[50:350]))
    _, again, _ = run("import-log", f"files={renamed}", ROBOT, "import.skip=0.01", out="again")
    assert f"{renamed} has been imported before, into " in again
    assert "first" in again.split("imported before, into ")[1].splitlines()[0]
    assert "WARNING: " in next(line for line in again.splitlines() if "imported before" in line)
    _, third, _ = run("import-log", f"files={log}", ROBOT, out="third")
    assert third.count("has been imported before") == 1
    assert "again and 1 other folder: give later stages one of them" in third
    assert "WARNING: " in next(line for line in third.splitlines() if "imported before" in line)
    _, part, _ = run("import-log", f"files={cut}", ROBOT, out="part")
    assert "cut has 300 of its 300 rows in common with " in part
    other = tmp_path / "other.csv"
    other.write_text(text(columns() * 1.1 + 1e-3))
    _, new, _ = run("import-log", f"files={other}", ROBOT, out="new")
    assert "before, into" not in new
    assert "in common" not in new


def test_a_doubt_comes_with_a_picture(run, tmp_path, drawn):
    from PIL import Image

    rows = columns()
    rows[:, NAMES.index("tilt_rate")] *= -1
    path = tmp_path / "ride.csv"
    path.write_text(text(rows))
    code, said, _ = run("import-log", f"files={path}", ROBOT, out="imported")
    assert code == 0
    assert "tilt_rate runs against tilt" in said
    pictures = list((tmp_path / "imported" / "doubts").glob("ride_*.png"))
    assert pictures
    with Image.open(pictures[0]) as picture:
        assert np.asarray(picture.convert("L")).std() > 5  # something is drawn


def test_what_was_not_measured_is_said_with_how_well_it_is_known(run, log):
    left_out = [f"import.quantities.{name}=null" for name in ("wheel_angle", "yaw_rate", "tilt_rate")]
    code, said, error = run("import-log", f"files={log}", ROBOT, *left_out)
    assert code == 0, error
    assert "tilt_rate (to ±" in said and "wheel_angle (the sum of its rate)" in said and "yaw_rate (taken as 0)" in said
    assert "inf" not in said


def test_an_acceleration_from_measured_rates_is_known_no_better_than_their_noise(run, tmp_path):
    rows = columns(600)
    noisy = rows[:, 6] + 0.1 * np.random.default_rng(0).standard_normal(len(rows))
    path = tmp_path / "noisy.csv"
    path.write_text(
        text(np.column_stack([rows[:, :3], rows[:, 4:6], noisy, rows[:, 7]]), names=[*NAMES[:3], *NAMES[4:]])
    )
    code, _, error = run("import-log", f"files={path}", ROBOT, "import.quantities.acceleration=null")
    assert code == 0, error
    (known,) = read_episode(tmp_path / "out" / "episodes" / "noisy.mcap").estimated
    assert known.channel == "acceleration"
    assert known.sd == pytest.approx(0.15 * 0.1 * np.sqrt(2.0) / PERIOD, rel=0.2)  # of wheels of 0.15 m


def test_logs_beside_a_manifest_of_another_version_are_pointed_to(run, episode, tmp_path):
    manifest = tmp_path / "imported" / "manifest.json"
    manifest.write_text(json.dumps({**json.loads(manifest.read_text()), "later": 1}))
    code, _, said = run("export", f"episodes={tmp_path / 'imported'}")
    assert code == 1
    assert "is no manifest of this version of twbal (manifest has the unknown field 'later'" in said
    assert f"Give {episode.parent} to use the logs as they are." in said
    assert run("export", f"episodes={episode.parent}")[0] == 0


def test_where_no_file_can_be_imported_nothing_is_made(run, tmp_path):
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text(text(columns(28)))
    code, _, said = run("import-log", f"files=[{tmp_path}/a.csv,{tmp_path}/b.csv]", out="imported")
    assert code == 1
    assert "None of 2 files can be imported" in said
    assert not (tmp_path / "imported" / "episodes").exists()


def test_an_import_that_was_ended_in_its_midst_is_not_taken(run, episode, tmp_path):
    manifest = tmp_path / "imported" / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"complete": true', '"complete": false'))
    code, _, said = run("export", f"episodes={tmp_path / 'imported'}", out="csv")
    assert code == 1
    assert "is not complete" in said


@pytest.mark.parametrize("rate", [100, 70])
def test_the_next_command_diagnoses_at_the_period_of_the_log(rate, run, tmp_path):
    path = tmp_path / "ride.csv"
    rows = columns()
    rows[:, 0] = np.arange(len(rows)) / rate
    path.write_text(text(rows))
    code, said, _ = run("import-log", f"files={path}", "robot=regbot", out="imported")
    assert code == 0
    words = shlex.split(said.split("next  twbal ")[1])
    assert words[0] == "diagnose"
    told = f"the logs have a control period of {1 / rate:.6g} s; the sheet of robot regbot says 0.015 s"
    assert told in said
    with composing():
        cfg = compose("diagnose", words[1:])
    assert cfg.robot.control_period == 1 / rate
    check_configuration(cfg, "diagnose")
    assert list(cfg.sim.effects) == ["viscous_friction", "rotor_inertia"]
    assert "diagnosis=real_logs" in words
    (recorded,) = [read_episode(file) for file in episode_files(cfg.episodes)]
    limits = Usability(cfg.min_length, cfg.min_samples, cfg.max_yaw_rate, cfg.max_tilt)
    assert len(read_recordings([recorded], ["ride"], instantiate(cfg.robot), limits)) == 1


def test_the_next_command_has_the_period_of_the_log_in_the_place_of_another_one_that_was_given(run, tmp_path):
    rows = columns()
    rows[:, 0] = np.arange(len(rows)) / 60.0
    (tmp_path / "ride.csv").write_text(text(rows))
    code, said, _ = run("import-log", f"files={tmp_path / 'ride.csv'}", "robot.control_period=0.02", out="imported")
    assert code == 0 and "the logs have a control period of 0.0166667 s; the sheet of robot" in said
    words = shlex.split(said.split("next  twbal ")[1])
    (period,) = [word.partition("=")[2] for word in words if "control_period" in word]
    assert float(period) == pytest.approx(1 / 60)


@pytest.mark.parametrize("guess", [(), ("guess=true",)])
def test_a_folder_or_a_pattern_is_answered_by_its_files(guess, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("logs").mkdir()
    Path("logs/notes.md").write_text("by hand")
    for given, said in (("logs", "it has no logs in it"), ("logs/*.csv", "nothing matches it")):
        code, _, error = run("import-log", f"files={given}", ROBOT, *guess)
        assert code == 1 and f"as in 'files=[a.csv,b.csv]' ({said})." in error and len(error.splitlines()) == 1
    for name in ("b.csv", "a.csv", "c.txt"):
        Path("logs", name).write_text(text(columns()))
    for given, what in (("logs", "a folder"), ("logs/*.csv", "a pattern")):
        code, _, error = run("import-log", f"files={given}", ROBOT, *guess)
        assert code == 1
        assert (
            f"{given} is {what}; expected are files. Give each by its path: 'files=[logs/a.csv,logs/b.csv]'." in error
        )
    (words,) = re.findall(r"path: (.*)\.$", error)
    assert run("import-log", *shlex.split(words), ROBOT, *guess, out="imported")[0] == 0


def test_of_many_files_in_a_folder_the_shell_makes_the_list(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("logs").mkdir()
    for k in range(6):
        Path("logs", f"{k}.csv").write_text(text(columns(60)))
    _, _, error = run("import-log", "files=logs", ROBOT)
    (word,) = re.findall(r"bash lists these 6 by (.*)\.$", error)
    listed = subprocess.run(["bash", "-c", f"echo {word}"], capture_output=True, text=True, check=True).stdout.strip()
    assert listed == "files=[" + ",".join(f"logs/{k}.csv" for k in range(6)) + "]"


def test_a_file_whose_name_looks_like_a_pattern_is_a_file(run, tmp_path):
    path = tmp_path / "ride_*.csv"
    path.write_text(text(columns()))
    assert run("import-log", f"files={path}", ROBOT, out="imported")[0] == 0


def test_logs_of_different_periods_are_said_not_to_go_together(run, log, tmp_path):
    other = tmp_path / "slow.csv"
    rows = columns()
    rows[:, 0] *= 3
    other.write_text(text(rows))
    _, said, _ = run("import-log", f"files=[{log},{other}]", out="imported")
    assert "control periods differ (ride 0.01 s, slow 0.03 s)" in said


def test_what_is_left_of_damaged_logs_is_saved(run, episode, tmp_path):
    whole = episode.read_bytes()
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "cut.mcap").write_bytes(whole[: 2 * len(whole) // 3])
    (broken / "foreign.mcap").write_bytes(b"no log at all")
    (broken / ".killed.mcap.123.partial").write_bytes(whole[: len(whole) // 2])
    for is_again in (False, True):
        code, said, error = run("repair", f"logs={broken}", out="saved")
        assert code == 1
        assert "Nothing could be saved of 1 logs; " in error and "not_saved.txt says why." in error
        assert is_again or ("lost" in said and "is not an MCAP file" in said)
    assert "foreign.mcap is not an MCAP file" in (tmp_path / "saved" / "not_saved.txt").read_text()
    saved = read_episode(tmp_path / "saved" / "episodes" / "cut.mcap")
    assert 0 < len(saved) < len(read_episode(episode))
    assert saved.tilt == pytest.approx(read_episode(episode).tilt[: len(saved) + 1], abs=0)
    assert (tmp_path / "saved" / "episodes" / "killed.mcap").exists()


def test_an_episode_is_drawn_and_filmed_beside_the_simulation(run, episode, tmp_path):
    from PIL import Image

    words = (f"episode={episode}", ROBOT, "seconds=0.4", "frame_rate=10", "width=96", "height=64")
    code, told, said = run("plot", *words, out="shown")
    assert code == 0, said
    assert "4 of 4 frames of the film are drawn" in told
    with Image.open(tmp_path / "shown" / "film.gif") as film:
        assert film.n_frames == 4
        assert film.size == (96, 64)
        pictures = []
        for number in (0, 3):
            film.seek(number)
            pictures.append(np.asarray(film.convert("RGB"), dtype=int))
    assert (np.abs(pictures[0] - pictures[1]).sum(axis=2) > 60).mean() > 0.001  # something moved
    drawn = (tmp_path / "shown" / "figures" / "courses.svg").read_text()
    assert "simulated" in drawn
    assert "measured" in drawn


def test_an_episode_is_drawn_with_the_robot_of_its_log_where_none_is_said(run, episode, tmp_path):
    code, told, said = run("plot", f"episode={episode}", "film=false", out="shown")
    assert code == 0, said
    assert "the robot is the one that the log was recorded with, 'paper'" in told
    assert "simulated" in (tmp_path / "shown" / "figures" / "courses.svg").read_text()
    code, told, said = run("plot", f"episode={episode}", "robot=paper", "film=false", out="other")
    assert code == 1
    assert "Choose the robot by robot=..." in said


def test_an_episode_becomes_a_recording_of_the_robot_in_space(run, episode, tmp_path):
    pytest.importorskip("rerun", reason="comes with the extra [viewers]")
    program = str(Path(sys.executable).with_name("rerun"))
    code, _, said = run("plot", f"episode={episode}", ROBOT, "film=false", "simulate=false", "rrd=true", out="shown")
    assert code == 0, said
    recorded = str(tmp_path / "shown" / "episode.rrd")
    command = [program, "rrd", "print", "-vvv", "--entity", "/plots/tilt/robot", recorded]
    shown = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    tilts = np.array(re.findall(r"┆ PT?[\d.]+[SD] +┆ \[([-\d.e]+)\]", shown), dtype=float)
    assert tilts == pytest.approx(np.degrees(read_episode(episode).tilt), abs=1e-9)


def test_a_viewer_sees_typed_fields_of_every_topic(episode, tmp_path):
    rerun = shutil.which("rerun")
    if rerun is None:
        pytest.skip("rerun comes with the extra [viewers]")
    out = tmp_path / "ride.rrd"
    subprocess.run([rerun, "mcap", "convert", str(episode), "-o", str(out)], check=True, capture_output=True)
    listed = subprocess.run(
        [rerun, "rrd", "print", "-vvv", str(out)], check=True, capture_output=True, text=True
    ).stdout
    for topic, fields in {
        "/imu": ("tilt", "tilt_rate", "acceleration", "yaw_rate"),
        "/wheels": ("angle", "rate"),
        "/command": ("torque",),
        "/state": ("tilt", "speed"),
    }.items():
        assert topic in listed
        for field in fields:
            assert field in listed


BAD = {
    ("import-log", "files=no.csv"): "no.csv",
    ("import-log", "files=a.mcap"): "need no import",
    ("import-log", "files=[a/x.csv,b/x.csv]"): "None of 2 files can be imported",
    ("export", "episodes=nowhere"): "is not there",
    ("repair", "logs=nowhere.mcap"): "nowhere.mcap",
    ("plot", "episode=no.mcap"): "no.mcap",
}


@pytest.mark.parametrize("words", BAD)
def test_bad_input_is_one_clear_line(words, run):
    code, _, said = run(*words)
    assert code == 1
    assert BAD[words] in said
    assert len(said.splitlines()) == 1


def test_a_folder_without_logs_names_folders_below_it_that_have_some(run, episode, tmp_path):
    for k in (2, 10, 1, 0):
        place = tmp_path / "it" / f"iteration_{k}" / "rollout" / "episodes"
        place.mkdir(parents=True)
        shutil.copy(episode, place)
    code, _, said = run("export", f"episodes={tmp_path / 'it'}", out="csv")
    named = ", ".join(str(tmp_path / "it" / f"iteration_{k}" / "rollout") for k in (0, 1, 10))
    assert code == 1
    assert f"Folders below it have: {named} and others. Give those that are meant." in said
    assert run("export", f"episodes={tmp_path / 'it' / 'iteration_0' / 'rollout'}", out="csv")[0] == 0


def test_logs_beside_an_empty_folder_of_episodes_are_taken(run, episode, tmp_path):
    (tmp_path / "mine" / "episodes").mkdir(parents=True)
    code, _, said = run("export", f"episodes={tmp_path / 'mine'}", out="csv")
    assert code == 1
    assert (
        "has no episode logs (*.mcap), neither in itself nor in a folder episodes/ in it. Give the run folder" in said
    )
    shutil.copy(episode, tmp_path / "mine")
    assert run("export", f"episodes={tmp_path / 'mine'}", out="csv")[0] == 0
