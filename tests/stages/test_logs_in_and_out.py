"""Logs come in from anywhere, and episodes go out to any program: import-log, export, recover and show."""

import shutil
import subprocess

import numpy as np
import pandas
import pytest
from foreign_logs import NAMES, PERIOD, columns, text

from twbal.cli import main
from twbal.logs import read_episode

ROBOT = f"robot.control_period={PERIOD}"


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
    kept = len(again) + 1
    assert kept == len(first)  # the last row has no command
    assert again.observations == pytest.approx(first.observations[:kept], abs=1e-12)
    assert again.commands == pytest.approx(first.commands[: kept - 1], abs=1e-12)


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


def test_what_is_left_of_damaged_logs_is_saved(run, episode, tmp_path):
    whole = episode.read_bytes()
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "cut.mcap").write_bytes(whole[: 2 * len(whole) // 3])
    (broken / "foreign.mcap").write_bytes(b"no log at all")
    (broken / ".killed.mcap.123.partial").write_bytes(whole[: len(whole) // 2])
    code, said, _ = run("recover", f"logs={broken}", out="saved")
    assert code == 0
    assert "lost" in said
    assert "is not an MCAP file" in said
    saved = read_episode(tmp_path / "saved" / "episodes" / "cut.mcap")
    assert 0 < len(saved) < len(read_episode(episode))
    assert saved.tilt == pytest.approx(read_episode(episode).tilt[: len(saved) + 1], abs=0)
    assert (tmp_path / "saved" / "episodes" / "killed.mcap").exists()


def test_an_episode_is_drawn_and_filmed_beside_the_simulation(run, episode, tmp_path):
    from PIL import Image

    words = (f"episode={episode}", ROBOT, "seconds=0.4", "frame_rate=10", "width=96", "height=64")
    code, _, said = run("show", *words, out="shown")
    assert code == 0, said
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
    ("import-log", "files=[a/x.csv,b/x.csv]"): "same name",
    ("export", "episodes=nowhere"): "is not there",
    ("recover", "logs=nowhere.mcap"): "nowhere.mcap",
    ("show", "episode=no.mcap"): "no.mcap",
}


@pytest.mark.parametrize("words", BAD)
def test_bad_input_is_one_clear_line(words, run):
    code, _, said = run(*words)
    assert code == 1
    assert BAD[words] in said
    assert len(said.splitlines()) == 1
