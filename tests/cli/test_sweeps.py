"""Sweeps in one process: where jobs lie, what a second go does, and what is said of those that fail."""

import json
import os
import pickle
import re
import subprocess
import sys

import pytest
from held_robot import DeafToStop, HeldRobot
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.plugins import Plugins
from served import served

from twbal.cli.main import main
from twbal.cli.manifest import read_manifest
from twbal.cli.sweep_results import job_lines
from twbal.cli.sweeps import FailedJobError, Job, job_folder, with_job_folders
from twbal.core.files import file_hash
from twbal.link.protocol import Clock
from twbal.virtual_robot.firmware import Firmware, Identity

QUICK = ("rollouts=1", "steps=4", "workers=1")


pytestmark = pytest.mark.usefixtures("as_from_a_shell")


def command(*words):
    return ["sim-collect", *QUICK, "-m", "hydra.sweep.dir=sweep", *words]


@pytest.fixture
def place(tmp_path):
    """Folder of the job with a seed."""
    return lambda seed: tmp_path / "sweep" / job_folder([*QUICK, f"seed={seed}"], ["seed"])


def block(folder):
    """Let the job of a folder fail."""
    folder.mkdir(parents=True)
    (folder / "episodes").write_text("a file where a folder should be")


def episodes(folder):
    """Hash and time of each log below a folder."""
    return {path: (file_hash(path), path.stat().st_mtime_ns) for path in folder.rglob("*.mcap")}


def error(capsys):
    """The one line that says what went wrong."""
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("twbal: error: ")]
    return line


def test_a_sweep_that_grows_finds_what_it_has(tmp_path, place):
    assert main(command("seed=1,2")) == 0
    before = episodes(tmp_path)
    assert len(before) == 2
    assert main(command("seed=0,1,2,3")) == 0
    after = episodes(tmp_path)
    assert {path: after[path] for path in before} == before
    assert {path.parents[1] for path in after} == {place(seed) for seed in range(4)}


def test_jobs_of_a_sweep_make_what_single_runs_make(tmp_path, place):
    assert main(command("seed=1,2")) == 0
    for seed in (1, 2):
        assert main(["sim-collect", *QUICK, f"seed={seed}", f"hydra.run.dir=single_{seed}"]) == 0
        single, job = read_manifest(tmp_path / f"single_{seed}"), read_manifest(place(seed))
        assert (job.fingerprint, job.outputs) == (single.fingerprint, single.outputs)


def test_a_sweep_finds_the_folders_of_jobs_that_it_named_by_all_they_were_told(tmp_path, place):
    """As twbal did before it left out what is not swept."""
    assert main(command("seed=1,2")) == 0
    before = episodes(tmp_path)
    for seed in (1, 2):
        place(seed).rename(tmp_path / "sweep" / job_folder([*QUICK, f"seed={seed}"]))
    assert main(command("seed=1,2")) == 0
    assert list(episodes(tmp_path).values()) == list(before.values())


def test_a_sweep_that_sweeps_another_key_besides_finds_what_it_has(tmp_path):
    assert main(command("seed=1,2")) == 0
    before = episodes(tmp_path)
    assert main(command("seed=1,2", "start.tilt_mean=0,0.01")) == 0
    assert len(episodes(tmp_path)) == 6
    (tmp_path / "sweep").rename(tmp_path / "other")
    quick = [*QUICK[:1], *QUICK[2:]]
    assert main(["sim-collect", *quick, "-m", "hydra.sweep.dir=other", "seed=1", "steps=4,5"]) == 0
    after = episodes(tmp_path)
    assert len(after) == 7 and set(before.values()) < set(after.values())


def test_the_end_of_a_sweep_has_one_line_a_job(place, capsys):
    assert main(command("seed=1,2")) == 0
    said = capsys.readouterr().out.splitlines()
    at = said.index("sweep sweep")
    assert said[at + 1 : at + 3] == [f"  {place(1).name}  done", f"  {place(2).name}  done"]
    block(place(3))
    assert main(command("seed=1,3")) == 1
    told = capsys.readouterr().out
    assert f"{place(3).name}  failed: " in told
    assert f"{place(1).name}  done" in told


def test_jobs_without_hidden_files_are_listed(tmp_path, place):
    block(place(2))
    assert main(command("seed=1,2", "hydra.output_subdir=null")) == 1
    first, second = job_lines(tmp_path / "sweep")
    assert first == f"  {place(1).name}  done"
    assert second.startswith(f"  {place(2).name}  failed: ")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["seed=1,-2"], r"sim-collect cannot have seed=-2; expected a whole number from 0 to"),
        (["seed=1,2", "start.tilt_mean=0.1,2.0"], r"cannot have start\.tilt_mean=2\.0; expected a number from -1\.5"),
        (["steps=range(0,3)"], r"cannot have steps=0; expected"),
        (["seed=1,x"], r"cannot have seed=x; expected a whole number"),
    ],
)
def test_a_value_out_of_its_range_is_refused_before_the_first_job(words, said, tmp_path, capsys):
    assert main(command(*words)) == 1
    assert re.search(said, error(capsys))
    assert not list(tmp_path.rglob("*.mcap"))


def test_runs_of_iterate_are_told_by_their_best_policy(tmp_path):
    from test_compare import summary

    for name, successes in (("b", [0, 4]), ("a", [3, 10])):
        (tmp_path / name / ".hydra").mkdir(parents=True)
        (tmp_path / name / "summary.json").write_text(json.dumps(summary(successes, 3.0, 1)))
        (tmp_path / name / "iteration_0" / ".hydra").mkdir(parents=True)
    (tmp_path / "c" / ".hydra").mkdir(parents=True)
    first, second, third = job_lines(tmp_path)
    assert first == "  a  10 of 10 trials succeed; the best policy is that of iteration 1; 3 s driven to learn"
    assert second.startswith("  b  4 of 10 trials succeed")
    assert third == "  c  not finished"


def test_an_unfinished_job_is_finished_by_the_next_go(tmp_path, place):
    assert main(command("seed=1,2")) == 0
    before = episodes(tmp_path)
    lost = place(2) / "episodes" / "trial_000.mcap"
    lost.unlink()
    assert main(command("seed=1,2")) == 0
    after = episodes(tmp_path)
    assert {path: after[path][0] for path in before} == {path: before[path][0] for path in before}
    assert {path for path in before if after[path] != before[path]} == {lost}


def test_a_job_that_fails_is_named_and_the_others_are_done(tmp_path, place, capsys):
    block(place(2))
    block(place(4))
    assert main(command("seed=1,2,3,4")) == 1
    said = error(capsys)
    assert "2 jobs of the sweep failed: " in said
    assert "seed=2 workers=1" not in said  # in the order in which they were given
    assert all(f"workers=1 seed={seed} (" in said for seed in (2, 4))
    assert "seed=1 (" not in said
    assert {path.parents[1] for path in episodes(tmp_path)} == {place(1), place(3)}
    assert "Traceback" in (place(2) / "failure.log").read_text()


def test_the_command_that_is_named_does_what_is_missing(tmp_path, place, capsys):
    block(place(2))
    assert main(command("seed=1,2")) == 1
    named = error(capsys).partition("what is missing: ")[2]
    assert named == "twbal sim-collect rollouts=1 steps=4 workers=1 -m seed=1,2 hydra.sweep.dir=sweep"
    assert (place(2) / "failure.log").is_file()
    before = episodes(tmp_path)
    (place(2) / "episodes").unlink()
    assert main(named.split()[1:]) == 0
    after = episodes(tmp_path)
    assert {path: after[path] for path in before} == before
    assert len(after) == 2
    assert not (place(2) / "failure.log").exists()


def test_failures_of_an_earlier_go_are_not_told_again(place, capsys):
    block(place(3))
    assert main(command("seed=3,1")) == 1
    capsys.readouterr()
    block(place(2))
    assert main(command("seed=2,1")) == 1
    assert "seed=3" not in error(capsys).partition("what is missing")[0]


class Counted(HeldRobot):
    """A held robot that counts how often it was armed."""

    armed = -1  # as it is reset once when it is made

    def reset(self, trial):
        self.armed += 1
        return super().reset(trial)


def driven_in_a_sweep(firmware, robot, *words):
    """`real-rollout` in a sweep of three jobs on one robot behind a port."""
    quick = ("policy=random", "robot=upkie", "robot.control_period=0.02", "trials=1", "steps=3", "seed=0,1,2")
    with served(firmware(robot, Identity("held", 4.0, 1.0, 0.1, Clock.LOCKSTEP))) as port:
        link = ("link=serial", f"link.port={port}", "link.confirm_placed=null", "link.timeout=0.3")
        return main(["real-rollout", "-m", *quick, *link, "hydra.sweep.dir=sweep", *words])


def test_a_robot_that_does_not_confirm_its_stop_ends_the_sweep_and_is_not_armed_again(tmp_path, capsys):
    robot = Counted()
    assert driven_in_a_sweep(DeafToStop, robot) == 1
    assert robot.armed == 1
    said = error(capsys)
    assert said.startswith("twbal: error: The robot held does not confirm that its motors are off, and THEY MAY STILL")
    assert "So the sweep ended, and its next jobs were not begun" in said
    assert said.endswith("hydra.sweep.dir=sweep") and "-m policy=random" in said
    assert len(list((tmp_path / "sweep").glob("*/failure.log"))) == 1
    assert driven_in_a_sweep(Firmware, Counted()) == 0  # the same words go on there
    assert len(episodes(tmp_path)) == 4  # the interrupted one is kept


def test_a_robot_that_is_gone_ends_the_sweep(capsys):
    words = ("policy=random", "link=serial", "link.port=/dev/null", "seed=0,1", "hydra.sweep.dir=sweep")
    assert main(["real-rollout", "-m", *words]) == 1
    said = error(capsys)
    assert said.startswith("twbal: error: /dev/null is no serial port.") and "So the sweep ended" in said


def test_a_job_elsewhere_says_at_once_what_a_robot_failed_it_by():
    """Its launcher begins the next ones, and hands on the error when all have ended."""
    words = [sys.executable, "-c", ELSEWHERE, "policy=random", "link=serial", "link.port=/dev/null", "seed=0,1"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([*words, "hydra.sweep.dir=sweep"], env=environment, capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr.count("twbal: error: /dev/null is no serial port.") == 2
    assert "2 jobs of the sweep failed" in done.stderr.splitlines()[-1]


ELSEWHERE = """
import pickle, sys
from twbal.cli import launch
from twbal.cli.main import main
launch.Job = lambda stage: pickle.loads(pickle.dumps(Job(stage)))  # as a launcher hands it on
from twbal.cli.sweeps import Job
sys.exit(main(["real-rollout", "-m", *sys.argv[1:]]))
"""


def test_an_unknown_key_is_one_clear_error_and_nothing_is_run(tmp_path, capsys):
    assert main(command("sead=1,2")) == 1
    said = capsys.readouterr().err
    assert said.count("twbal: error: ") == 1
    assert "sim-collect has no setting 'sead' (did you mean 'seed'?)" in said
    assert not episodes(tmp_path)


def test_a_launcher_that_is_not_there_is_one_clear_error(capsys):
    assert main(command("seed=1,2", "hydra/launcher=jobblib")) == 1
    said = error(capsys)
    assert "hydra/launcher has no choice 'jobblib'" in said
    assert "ray_cluster" in said
    assert "pip install -e '.[sweeps]'" in said


def test_what_a_launcher_hands_on_is_of_modules_that_another_process_finds():
    code = "import pickle, sys; print(len(pickle.load(sys.stdin.buffer)))"
    state = pickle.dumps(Plugins.instance().class_name_to_class)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", code], input=state, env=environment, capture_output=True, check=True)
    assert int(done.stdout) >= 1
    assert "hydra_plugins.twbal_ray_cluster.RayClusterLauncher" in Plugins.instance().class_name_to_class


def test_without_ray_its_launcher_says_so(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "ray", None)
    assert main(command("seed=1,2", "hydra/launcher=ray_cluster")) == 1
    assert "hydra/launcher=ray_cluster needs Ray: pip install -e '.[sweeps]'" in error(capsys)


@pytest.mark.slow
def test_two_sweeps_in_one_folder_at_once_end_at_the_same_files(tmp_path, place):
    words = [sys.executable, "-m", "twbal", *command("seed=1,2,3")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    both = [subprocess.Popen(words, env=environment, stdout=subprocess.DEVNULL) for _ in range(2)]
    assert [process.wait() for process in both] == [0, 0]
    for seed in (1, 2, 3):
        manifest = read_manifest(place(seed))
        assert manifest.complete
        assert [made.sha256 for made in manifest.outputs] == [file_hash(place(seed) / m.path) for m in manifest.outputs]
    assert main(command("seed=1", "hydra.sweep.dir=alone")) == 0
    (alone,) = episodes(tmp_path / "alone").values()
    (job,) = episodes(place(1)).values()
    assert alone[0] == job[0]


@pytest.mark.parametrize(
    ("overrides", "name"),
    [
        (["link.seed=1", "updates=2"], "link.seed-1__updates-2"),
        (["updates=2", "link.seed=1"], "link.seed-1__updates-2"),
        (["seed=-1"], "seed--1"),
        ([], "default"),
    ],
)
def test_a_job_folder_is_named_by_the_overrides_in_any_order(overrides, name):
    assert job_folder(overrides) == name


def test_a_job_folder_is_named_by_the_swept_keys_and_told_apart_by_the_others():
    rest = [f"robot.value_{k}=0.123456" for k in range(9)]
    names = [job_folder([*rest, f"link.seed={seed}"], ["link.seed"]) for seed in (1, 2)]
    assert [name[:12] for name in names] == ["link.seed-1_", "link.seed-2_"]
    assert all(len(name) < 30 for name in names)
    assert job_folder([*rest[1:], "link.seed=1"], ["link.seed"]) != names[0]
    assert job_folder(["link.seed=1", *rest[::-1]], ["link.seed"]) == names[0]
    assert job_folder(["+effect@sim.effects.delay=delay", "seed=1"], ["effect@sim.effects.delay", "seed"]).endswith(
        job_folder(["+effect@sim.effects.delay=delay", "seed=1"])
    )


@pytest.mark.parametrize(
    ("words", "swept"),
    [
        (["-m", "seed=1,2", "steps=3"], "['seed']"),
        (["-m", "link.seed=range(3)", "state=choice(a,b)"], "['link.seed','state']"),
        (["seed=1,2"], None),
        (["-m", "seed=1", "'a b"], None),
        (["-m", "seed=1", "steps=[3"], None),
        (["-m", "seed=1,2", "hydra.sweep.subdir=mine"], None),
    ],
)
def test_a_sweep_names_its_folders_by_what_it_sweeps(words, swept):
    added = with_job_folders(words)[len(words) :]
    assert with_job_folders(words)[: len(words)] == words
    assert [swept in word for word in added] == ([True] if swept else [])


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (["policy.path=a/b.pt"], ["policy.path=a_b.pt"]),
        (["search.linearisation_amplitudes=[0.3]"], ["search.linearisation_amplitudes=[0.3,]"]),
        (
            [f"{key}=1" for key in "abcdefghijklmnopqrstuvwxyz" * 3],
            [f"{key}=1" for key in "abcdefghijklmnopqrstuvwxy" * 3],
        ),
        (["name=ä"], ["name=ö"]),
        (["a=../../b"], ["a=../../c"]),
    ],
)
def test_job_folders_are_told_apart_and_fit_into_overrides(one, other):
    names = {job_folder(one), job_folder(other)}
    assert len(names) == 2
    for name in names:
        assert len(name.encode()) < 255
        assert "/" not in name
        assert OverridesParser.create().parse_override(f"episodes={name}").value() == name


def test_a_failure_comes_through_a_pipe():
    error = pickle.loads(pickle.dumps(FailedJobError("too few samples", "outputs/sweep")))
    assert str(error) == "too few samples"
    assert str(error.sweep) == "outputs/sweep"


def test_a_job_elsewhere_has_the_threads_of_the_command_before_anything_numeric_is_loaded(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    job = pickle.dumps(Job("sim-collect"))
    code = (
        "import os, pickle, sys; pickle.load(sys.stdin.buffer); "
        "print(os.environ['OMP_NUM_THREADS'], {'numpy', 'torch'} & set(sys.modules))"
    )
    environment = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    environment["PYTHONPATH"] = os.pathsep.join(sys.path)
    done = subprocess.run([sys.executable, "-c", code], input=job, env=environment, capture_output=True, check=True)
    assert done.stdout.decode().strip() == "3 set()"
