import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from hydra._internal.hydra import Hydra

from twbal import __version__
from twbal.cli.conf_folder import conf_folder
from twbal.cli.main import STAGES, main, usage
from twbal.core.errors import ConfigError, LinkError

pytestmark = pytest.mark.usefixtures("as_from_a_shell")


@pytest.fixture
def stage(monkeypatch):
    """Stands in for the stage sim-collect: calls the function that the test puts in."""
    module = type(sys)("twbal.cli.stages.sim_collect")
    monkeypatch.setitem(sys.modules, "twbal.cli.stages.sim_collect", module)
    return module


def only_error(capsys) -> str:
    """The one line on stderr, without its prefix."""
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1, lines
    assert lines[0].startswith("twbal: error: ")
    return lines[0].removeprefix("twbal: error: ")


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-"])
def test_what_is_opened_does_not_take_the_place_of_a_closed_stream(closed, tmp_path):
    program = (
        "import sys; from twbal.cli.main import main; code = main(['--version']);"
        f"port = open({str(tmp_path / 'port')!r}, 'wb'); sys.exit(code or port.fileno() < 3)"
    )
    done = subprocess.run(["sh", "-c", f'exec "$0" -c "$1" {closed}', sys.executable, program], capture_output=True)
    assert (done.returncode, done.stderr) == (0, b"")


def test_help_lists_every_stage(capsys):
    assert main(["--help"]) == 0
    said = capsys.readouterr().out
    assert said == usage()
    assert all(re.search(rf"^  {name} +\w", said, re.MULTILINE) for name in STAGES)


def test_no_stage_at_all_is_misuse(capsys):
    assert main([]) == 2
    assert capsys.readouterr().err == usage()


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"twbal {__version__}\n"


def test_help_imports_nothing_heavy():
    code = "import sys, twbal.cli.main; twbal.cli.main.main(['--help']); print(*sys.modules)"
    out = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment()
    ).stdout
    loaded = set(out.splitlines()[-1].split())
    assert not loaded & {"hydra", "omegaconf", "numpy", "torch", "pybullet", "scipy", "matplotlib"}


@pytest.mark.parametrize(("flags", "said"), [(["--help"], "rollouts=20"), (["--cfg", "job"], "rollouts: 20")])
def test_help_of_a_stage_does_not_import_the_stage(stage, flags, said, capsys):
    assert main(["sim-collect", *flags]) == 0  # the stand-in has no main that could be called
    assert said in capsys.readouterr().out


def test_an_unknown_stage_suggests_the_near_one_and_lists_all(capsys):
    assert main(["sim_colect"]) == 2
    said = only_error(capsys)
    assert "did you mean 'sim-collect'" in said
    assert all(name in said for name in STAGES)


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("rolouts=3", "no setting 'rolouts' (did you mean 'rollouts'?)"),
        ("robt=paper", "no setting 'robt' (did you mean 'robot'?)"),
        ("robot.body_mas=3", "no setting 'robot.body_mas' (did you mean 'robot.body_mass'?)"),
        ("body_mass=3", "no setting 'body_mass' (did you mean 'robot.body_mass'?)"),
        ("~rolouts", "no setting 'rolouts' (did you mean 'rollouts'?)"),
        (
            "robot=papr",
            "robot has no choice 'papr' (did you mean 'paper'?). The choices are: balboa, esp32, lego",
        ),
        ("rollouts", "'rollouts' is not an override; expected key=value"),
        ("=3", "A word that begins with = is not an override; expected key=value"),
        ("robot=null", "robot is a group, of which a choice is taken by its name; found is robot=null."),
        ("state=[rolling,tilt]", "state has no choice 'tilt'. The choices are: default, paper, rolling."),
        (
            "+rolouts=3",
            "has no setting 'rolouts', and none of its settings refers to it as ${rolouts}. Is rollouts meant",
        ),
        ("seed='3'", "sim-collect cannot have seed='3'; expected a whole number"),
        ("seed=${sede}", "seed refers to ${sede}, which the configuration does not have."),
        ("~seed", "sim-collect reads seed, which the configuration does not have. Was it taken away by ~seed"),
        ("robot.name=[a=b]", "its value cannot be read. Put text with any of = , : ( ) [ ] { } in quotes"),
        ("hydra.run.dir=Läufe", "with any of = , : ( ) [ ] { }, or with letters such as ä, in quotes"),
        ("policy=~/runs", "~ stands for your home folder only where a word begins. Write $HOME in its place"),
        ("hydra.run.dir=~", "hydra.run.dir=~ is in a folder that is called ~, and not in your home folder."),
        ("hydra.run.dir='~/a'", "hydra.run.dir='~/a' is in a folder that is called ~, and not in your home folder."),
        (
            "policy.path=outputs/.../policy.pt",
            "policy.path=outputs/.../policy.pt has ... where the name of a folder or",
        ),
        ("start.tilt_sd=...", "start.tilt_sd=... has ... where the name of a folder or a value belongs."),
        ("start.tilt_sdd=1", "sim-collect has no setting 'start.tilt_sdd' (did you mean 'start.tilt_sd'?)"),
        ("policy.path=out", "sim-collect has the setting policy.path only with policy=saved: add that."),
        (f"policy={Path(__file__).parent}", f"or run folder {Path(__file__).parent} meant? Give policy=saved policy."),
        ("hydra.run.dir=", "hydra.run.dir= names no folder. Is a variable of the shell empty?"),
    ],
)
def test_a_misspelt_override_is_one_clear_error(word, expected, capsys):
    assert main(["sim-collect", word]) == 1
    assert expected in only_error(capsys)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--config-dir=a", "-cd", "b"], "Hydra takes a single --config-dir. Give one, and the other folder by "),
        (
            ["-m", "seed=1,2", "hydra.run.dir=a"],
            "hydra.run.dir has no effect here: a sweep, by -m, has its folder by ",
        ),
        (["hydra.sweep.dir=a"], "hydra.sweep.dir has no effect here: a single run, without -m, has its folder by "),
    ],
)
def test_a_word_without_effect_is_refused(words, expected, capsys):
    assert main(["sim-collect", *words]) == 1
    assert expected in only_error(capsys)


def test_a_choice_in_a_folder_that_was_not_named_is_pointed_to(tmp_path, monkeypatch, capsys):
    (tmp_path / "my_conf" / "robot").mkdir(parents=True)
    (tmp_path / "my_conf" / "robot" / "mine.yaml").write_text("name: mine\n")
    monkeypatch.chdir(tmp_path)
    assert main(["sim-collect", "robot=mine"]) == 1
    assert "There is one in the folder my_conf: add --config-dir=my_conf." in only_error(capsys)


@pytest.mark.parametrize(
    ("word", "flags", "expected"),
    [
        ("import=my_conf/import/mine.yaml", [], "For that file give --config-dir=my_conf import=mine."),
        ("import=my_conf/import/mine.yaml", ["--config-dir=my_conf"], "For that file give import=mine."),
        ("import=mine.yaml", [], "There is one in the folder my_conf: give --config-dir=my_conf import=mine."),
        ("import=loose.yaml", [], "Move it to my_conf/import/loose.yaml, and give --config-dir=my_conf import=loose."),
        ("import=my_conf/import/none.yaml", [], "The choices are: columns, regbot."),
    ],
)
def test_a_choice_by_the_path_of_its_file_is_told_how_it_is_chosen(word, flags, expected, tmp_path, capsys):
    (tmp_path / "my_conf" / "import").mkdir(parents=True)
    for path in ("my_conf/import/mine.yaml", "loose.yaml"):
        (tmp_path / path).write_text("names: []\n")
    assert main(["import-log", "files=ride.csv", word, *flags]) == 1
    assert (said := only_error(capsys)).startswith(f"import has no choice '{word.removeprefix('import=')}'")
    assert said.endswith(expected)


def test_an_advised_folder_with_a_blank_is_quoted_for_the_shell(tmp_path, capsys):
    (tmp_path / "my conf" / "import").mkdir(parents=True)
    (tmp_path / "my conf" / "import" / "mine.yaml").write_text("names: []\n")
    assert main(["import-log", "files=ride.csv", "import=mine"]) == 1
    assert only_error(capsys).endswith("There is one in the folder my conf: add '--config-dir=my conf'.")


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        (b"", "is empty; expected are lines such as `body_mass: 1.09`"),
        (b"# nothing\n", "is empty"),
        (b"[1, 2]\n", "holds no values by name; expected are lines"),
        (b"robot\n", "lacks its first entry. Add `_target_: "),
        ("name: mine\n".encode("utf-16"), "is no text in UTF-8"),
    ],
)
@pytest.mark.parametrize("sweep", [[], ["-m", "seed=1,2"]])
def test_a_file_that_is_no_robot_sheet_is_named(written, expected, sweep, tmp_path, capsys):
    sheet = tmp_path / "mine" / "robot" / "mine.yaml"
    sheet.parent.mkdir(parents=True)
    sheet.write_bytes(written)
    assert main(["sim-collect", f"--config-dir={tmp_path / 'mine'}", "robot=mine", *sweep]) == 1
    said = capsys.readouterr().err.splitlines()[-1]
    assert f"{sheet} {expected}" in said


def test_a_sheet_that_is_a_list_has_no_value_to_set(tmp_path, capsys):
    (tmp_path / "mine" / "robot").mkdir(parents=True)
    (tmp_path / "mine" / "robot" / "mine.yaml").write_text("- 1\n")
    assert main(["lqr", f"--config-dir={tmp_path / 'mine'}", "robot=mine", "robot.body_mass=3"]) == 1
    assert "robot.body_mass=3 sets a value by its name, and robot is a list." in only_error(capsys)


def test_an_experiment_without_a_robot_is_refused(tmp_path, capsys):
    (tmp_path / "experiment").mkdir()
    (tmp_path / "experiment" / "mine.yaml").write_text("# @package _global_\nrobot: null\n")
    assert main(["iterate", f"--config-dir={tmp_path}", "experiment=mine"]) == 1
    assert only_error(capsys) == "iterate cannot have robot=null; expected is a robot, chosen by robot=<name>."


@pytest.mark.parametrize(
    ("group", "choice"), [("robot", "lego"), ("robot", "mine"), ("state", "paper"), ("sim", "nominal")]
)
def test_a_choice_that_an_experiment_takes_for_a_value_is_told_how_it_is_chosen(group, choice, tmp_path, capsys):
    (tmp_path / "experiment").mkdir()
    (tmp_path / "experiment" / "mine.yaml").write_text(f"# @package _global_\n{group}: {choice}\n")
    assert main(["iterate", f"--config-dir={tmp_path}", "experiment=mine", f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    assert f"`defaults: [{{override /{group}: {choice}}}]` above the settings." in only_error(capsys)


@pytest.mark.parametrize(
    ("stage", "body", "expected"),
    [
        ("real-rollout", "link: {sed: 3}", "real-rollout has no setting 'link.sed' (did you mean 'link.seed'?)"),
        ("iterate", "real_rollout: {yield_to_push: true}", "(did you mean 'real_rollout.yield_to_pushes'?)"),
        ("iterate", "sim_collect: {rolouts: 5}", "(did you mean 'sim_collect.rollouts'?)"),
        ("iterate", "search: {horizn: 3}", "(did you mean 'search.horizon'?). Those of search are: horizon,"),
        ("real-rollout", "state: {nmes: [tilt]}", "(did you mean 'state.names'?)"),
    ],
)
def test_a_misspelt_setting_in_an_experiment_is_refused_before_anything_runs(stage, body, expected, tmp_path, capsys):
    (tmp_path / "experiment").mkdir()
    (tmp_path / "experiment" / "mine.yaml").write_text(f"# @package _global_\n{body}\n")
    words = ["experiment=mine", "policy.path=policy.pt"] if stage == "real-rollout" else ["experiment=mine"]
    assert main([stage, f"--config-dir={tmp_path}", *words, f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    assert expected in only_error(capsys)


def test_a_stage_without_a_simulation_is_not_told_to_add_effects(capsys):
    assert main(["fit-sim-gp", "episodes=e", "sim.effects.dead_zone.width=1"]) == 1
    assert "fit-sim-gp has no setting 'sim.effects.dead_zone.width'" in only_error(capsys)


@pytest.mark.parametrize(
    ("stage", "word", "expected"),
    [
        ("sim-collect", "start={foo: 1}", "no setting 'start.foo'. Those of start are: tilt_mean, tilt_sd"),
        ("sim-collect", "start={tilt_sdd: 1}", "no setting 'start.tilt_sdd' (did you mean 'start.tilt_sd'?)"),
        ("check-link", "link={port: /dev/x}", "has the setting link.port only with link=serial: add that."),
        ("iterate", "agent.options={foo: 1}", "no such entries. New ones are added by +agent.options.foo=..."),
        ("iterate", "ensemble={late: {dead_zone: {}}}", "Add it by +effect@ensemble.late.dead_zone=dead_zone."),
    ],
)
def test_a_node_that_is_given_another_entry_is_told_what_it_has_or_how_one_is_added(stage, word, expected, capsys):
    assert main([stage, word]) == 1
    assert expected in only_error(capsys)


@pytest.mark.parametrize(
    "word", ["+effect@sim.effects.dead_zone=dead_zone", "+effect@ensemble.late.dead_zone=dead_zone"]
)
def test_an_effect_is_added_as_the_errors_say(word, capsys):
    assert main(["iterate", word, "--cfg", "job"]) == 0
    assert "_target_: twbal.effects.dead_zone.DeadZone" in capsys.readouterr().out


@pytest.mark.parametrize("word", ["+link.port=/dev/ttyUSB0", "++link.port=/dev/ttyUSB0", "+experiment@_global_=mine"])
def test_a_setting_of_another_link_is_refused_before_anything_runs(word, tmp_path, capsys):
    (tmp_path / "conf" / "experiment").mkdir(parents=True)
    (tmp_path / "conf" / "experiment" / "mine.yaml").write_text("# @package _global_\nlink: {port: /dev/ttyUSB0}\n")
    assert main(["check-link", word, f"--config-dir={tmp_path / 'conf'}", "hydra.run.dir=out"]) == 1
    assert only_error(capsys) == "check-link has the setting link.port only with link=serial: add that."
    assert not (tmp_path / "out").exists()


def test_a_setting_of_the_link_that_was_not_chosen_is_refused(capsys):
    assert main(["check-link", "link=serial", "link.port=/dev/none", "+link.seed=3"]) == 1
    assert "check-link has the setting link.seed, but not with what was chosen here" in only_error(capsys)


@pytest.mark.parametrize(
    ("stage", "word", "given"),
    [
        ("real-rollout", "faults=none", "faults=none"),
        ("real-rollout", "+faults=none", "faults=none"),
        ("iterate", "faults=none", "faults=none"),
        ("iterate", "faults.drag=[0,0]", "faults.drag=[0,0]"),
        ("check-link", "physics_step=0.001", "physics_step=0.001"),
    ],
)
def test_a_setting_of_the_virtual_robot_is_told_where_it_belongs(stage, word, given, capsys):
    policy = ["policy=random"] if stage == "real-rollout" else []
    assert main([stage, *policy, word]) == 1
    assert f"for the virtual robot on the link give 'link.overrides=[\"{given}\"]'." in only_error(capsys)


def test_a_setting_that_ends_like_one_of_the_virtual_robot_is_still_guessed(capsys):
    assert main(["check-link", "seed=3"]) == 1
    assert "(did you mean 'link.seed'?)" in only_error(capsys)


def test_a_group_that_a_stage_does_not_read_cannot_be_added(capsys):
    assert main(["lqr", "+course=none"]) == 1
    assert "lqr has no setting 'course'" in only_error(capsys)


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ("+robot=lego", "There is a robot already. Choose another one without +: robot=lego."),
        ("+robot=paper", "There is a robot already. Choose another one without +: robot=paper."),
        ("++robot=lego", "robot is a group, of which a choice is taken without ++: give robot=lego."),
    ],
)
def test_a_choice_beside_the_one_that_there_is_is_said_to_be_chosen_without_plus(word, expected, capsys):
    assert main(["lqr", word]) == 1
    assert only_error(capsys) == expected


def test_a_whole_number_in_another_notation_is_told_how_it_is_written(capsys):
    assert main(["real-rollout", "policy.path=policy.pt", "first_trial=1e9"]) == 1
    assert "expected a whole number from 0 to 1e9" in (said := only_error(capsys))
    assert "Write first_trial=1000000000." in said
    assert main(["real-rollout", "policy.path=policy.pt", "first_trial=1e10"]) == 1
    assert "Write" not in only_error(capsys)


@pytest.mark.parametrize("words", [[], ["-m", "seed=1,2"]])
def test_a_stage_does_not_change_into_its_run_folder(words, tmp_path, capsys):
    assert main(["sim-collect", "hydra.job.chdir=true", *words]) == 1
    assert only_error(capsys).startswith("hydra.job.chdir=true cannot be: ")
    assert not list(tmp_path.iterdir())


def test_a_setting_that_an_experiment_replaced_is_said_to_be_replaced(capsys):
    assert main(["real-rollout", "experiment=excite", "policy.path=policy.pt"]) == 1
    assert "real-rollout has the setting policy.path, but not with what was chosen here" in only_error(capsys)


@pytest.mark.parametrize(
    "words",
    [
        ["rollouts=3", "-m", "seed=1,2", "steps=4"],
        ["-m", "rollouts=3", "steps=4", "seed=1,2"],
        ["seed=1,2", "steps=4", "rollouts=3", "--multirun"],
    ],
)
def test_overrides_may_stand_on_either_side_of_a_flag(stage, words):
    seen = []
    stage.main = lambda cfg: seen.append((cfg.rollouts, cfg.seed, cfg.steps))
    assert main(["sim-collect", *words]) == 0
    assert seen == [(3, 1, 4), (3, 2, 4)]


def test_an_own_setting_may_be_added_for_others_to_refer_to(stage):
    seen = []
    stage.main = lambda cfg: seen.append(cfg.rollouts + cfg.steps)
    assert main(["sim-collect", "+both=7", "rollouts=${both}", "steps=${both}"]) == 0
    assert seen == [14]


def test_settings_are_shown_with_their_references_resolved(capsys):
    assert main(["optimise-policy", "--cfg", "job", "--resolve", "--package", "state"]) == 0
    assert "- position_integral" in capsys.readouterr().out


def test_two_flags_that_exclude_each_other_are_named(capsys):
    assert main(["sim-collect", "-m", "seed=1,2", "--cfg", "job"]) == 1
    assert only_error(capsys).startswith("Only one of -m (--multirun), --run, --cfg, --info and --shell-completion can")


def test_the_value_of_a_flag_stays_with_it(capsys):
    assert main(["sim-collect", "--cfg", "job", "seed=4", "--package", "robot", "steps=3"]) == 0
    said = capsys.readouterr().out
    assert "body_mass: 10.0" in said
    assert "seed" not in said


def test_an_unknown_flag_is_misuse(capsys):
    assert main(["sim-collect", "--fast"]) == 2
    assert "unrecognized arguments: --fast" in capsys.readouterr().err


def test_an_error_of_ours_is_one_line_and_exit_code_1(stage, capsys):
    def fail(cfg):
        raise LinkError("no robot on that port")

    stage.main = fail
    assert main(["sim-collect"]) == 1
    assert only_error(capsys) == "no robot on that port"


def test_a_working_directory_that_is_gone_is_named(tmp_path):
    program = f"import os, sys; os.rmdir({str(tmp_path)!r}); from twbal.cli.main import main;"
    words = [sys.executable, "-c", f"{program} sys.exit(main(['export', 'episodes=x']))"]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, env=environment())
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert "Cannot find the working directory" in done.stderr


@pytest.mark.parametrize(
    "variables",
    [{"PYTHONIOENCODING": "ascii"}, {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}],
    ids=["strict", "locale C"],
)
def test_an_output_without_our_letters_gets_escapes_of_them(variables):
    words = [sys.executable, "-m", "twbal", "sim-collect", "--help"]
    done = subprocess.run(words, capture_output=True, env=environment(**variables))
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"N\\xb7m" in done.stdout


@pytest.mark.parametrize("variable", ["TWBAL_DEBUG", "HYDRA_FULL_ERROR"])
def test_a_traceback_is_to_be_had(variable, tmp_path):
    words = [sys.executable, "-m", "twbal", "sim-collect", "robot.body_mass=-1"]
    done = subprocess.run(words, capture_output=True, text=True, env=environment(**{variable: "1"}), cwd=tmp_path)
    assert done.returncode == 1
    assert "Traceback" in done.stderr
    assert done.stderr.splitlines()[-1].startswith("twbal: error: sim-collect cannot have robot.body_mass=-1")


def test_processes_that_a_stage_starts_print_errors_as_usual(stage):
    seen = []
    stage.main = lambda cfg: seen.append(os.environ.get("HYDRA_FULL_ERROR"))
    assert main(["sim-collect"]) == 0
    assert seen == [None]


def test_an_error_of_ours_within_the_building_of_parts_comes_out_bare(stage, capsys):
    from hydra.utils import instantiate

    stage.main = lambda cfg: instantiate(cfg.state)
    assert main(["sim-collect", "state.names=[tilt,tilt]"]) == 1
    assert only_error(capsys) == "State channels must be distinct and at least one; found ['tilt', 'tilt']."


def test_a_part_that_cannot_be_built_is_named(stage, capsys):
    from hydra.utils import instantiate

    stage.main = lambda cfg: instantiate(cfg.policy)
    assert main(["sim-collect", "+policy.path=that/of/another/kind.pt"]) == 1
    said = only_error(capsys)
    assert said.startswith("policy cannot be built")
    assert "it has no entry 'path': take it out. Its entries are: " in said


def test_what_a_part_lacks_is_named(stage, capsys):
    from hydra.utils import instantiate

    stage.main = lambda cfg: instantiate(
        {"_target_": "twbal.io.importers.mapping.mapping", "quantities": {}, "skip": 0}
    )
    assert main(["sim-collect"]) == 1
    said = only_error(capsys)
    assert "cannot be built from its settings: it lacks 'names', 'rate', 'command_is_sample'" in said
    assert "add `names: ...`" in said and "Its entries are: quantities, names, rate" in said
    assert "TypeError" not in said and "'motor'" not in said


def test_a_missing_value_names_the_setting(stage, capsys):
    stage.main = lambda cfg: cfg.seed
    assert main(["sim-collect", "seed=???"]) == 1
    assert only_error(capsys).startswith("sim-collect needs seed=...")


def test_a_bug_keeps_its_traceback(stage):
    def fail(cfg):
        raise ZeroDivisionError("a bug")

    stage.main = fail
    with pytest.raises(ZeroDivisionError):
        main(["sim-collect"])


def test_ctrl_c_exits_130(stage, capsys):
    def stop(cfg):
        raise KeyboardInterrupt

    stage.main = stop
    assert main(["sim-collect"]) == 130
    assert capsys.readouterr().err == "twbal: stopped\n"


def test_ctrl_c_while_libraries_load_exits_130(monkeypatch, capsys):
    def stop():
        raise KeyboardInterrupt

    monkeypatch.setattr("twbal.core.threads.default_to_one_thread", stop)
    assert main(["sim-collect"]) == 130
    assert capsys.readouterr().err == "twbal: stopped\n"


def test_little_is_loaded_before_ctrl_c_is_caught():
    code = "import sys; import twbal.cli.main; print({'hydra', 'numpy', 'yaml', 'concurrent'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment(), check=True)
    assert done.stdout == "set()\n"


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["diagnose", "diagnosis.starts=2"], "no setting 'diagnosis.starts' (did you mean 'starts'?)"),
        (["sim-collect", "robot.target=2"], "no setting 'robot.target'"),
        (["sim-collect", "robot.body_mass=0,9"], "several values. For a list write 'robot.body_mass=[0,9]'"),
        (["sim-collect", "robot.body_mass=0,9"], "a number with a decimal point write robot.body_mass=0.9."),
        (["sim-collect", "seed=a,b"], "for a sweep over them add -m."),
        (["sim-collect", "robot.body_mass='0,9'"], "Is a decimal point meant? Write 0.9."),
        (["lqr", "robot._target_=x.y"], "robot has the _target_ x.y, which cannot be loaded"),
        (["plot", "episode=runs"], "runs is a folder; expected is an episode log, such as runs/episodes/a.mcap."),
        (["optimise-policy", "dynamics=model"], "model is a folder; expected is a file, such as model/model.pt."),
        (["regress"], "There is no folder data/regression here. Run it in the checkout"),
    ],
)
def test_messages_name_what_is_likely_meant(words, expected, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for path in ("runs/episodes/a.mcap", "runs/manifest.txt", "model/model.pt"):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).touch()
    assert main(words) == 1
    said = only_error(capsys)
    assert expected in said
    assert "_target_'?" not in said and "did you mean 'robot._" not in said


def test_a_reader_that_leaves_early_sees_no_complaint(tmp_path):
    words = f"{sys.executable} -u -m twbal sim-collect --help | head -n 1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", words], capture_output=True, text=True, env=environment(), cwd=tmp_path)
    assert done.stderr == ""
    assert done.stdout.startswith("twbal sim-collect: ")
    assert done.returncode in (0, 141)  # where all was written before the reader left, nobody notices


def test_a_failed_job_does_not_keep_a_sweep_from_the_others(stage, capsys):
    seen = []

    def fail_once(cfg):
        seen.append(cfg.seed)
        if cfg.seed == 1:
            raise ConfigError("not this one")

    stage.main = fail_once
    assert main(["sim-collect", "-m", "seed=1,2,3"]) == 1
    assert seen == [1, 2, 3]
    assert "twbal: error: 1 job of the sweep failed: seed=1 (not this one)." in capsys.readouterr().err


def test_two_runs_at_once_have_folders_of_their_own(stage):
    from twbal.cli.console import run_folder

    folders = []
    stage.main = lambda cfg: folders.append(run_folder())
    for _ in range(3):
        assert main(["sim-collect"]) == 0
    assert len(set(folders)) == 3
    assert all(re.fullmatch(r"outputs/sim-collect/[-\d]+_[-\d]+", str(folder)) for folder in folders)
    assert all((folder / ".hydra" / "config.yaml").is_file() for folder in folders)


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("twbal ", set(STAGES)),
        ("twbal sim", set(STAGES)),
        ("twbal sim-collect robot=", {f"robot={path.stem}" for path in (conf_folder() / "robot").glob("*.yaml")}),
        ("twbal sim-collect roll", {"rollouts="}),
    ],
)
def test_tab_completion(line, expected, monkeypatch, capsys):
    monkeypatch.setenv("COMP_LINE", line)
    assert main(["-sc", "query=bash"]) == 0
    assert set(capsys.readouterr().out.split()) == expected


def test_the_completion_script_is_for_twbal(capsys):
    assert main(["--shell-completion", "install=bash"]) == 0
    assert capsys.readouterr().out.splitlines()[-1].endswith("hydra_bash_completion twbal")


def test_configuration_of_ones_own(stage, tmp_path):
    (tmp_path / "mine" / "robot").mkdir(parents=True)
    text = (conf_folder() / "robot" / "paper.yaml").read_text().replace("name: paper", "name: mine")
    (tmp_path / "mine" / "robot" / "mine.yaml").write_text(text)
    names = []
    stage.main = lambda cfg: names.append(cfg.robot.name)
    assert main(["sim-collect", f"--config-dir={tmp_path / 'mine'}", "robot=mine"]) == 0
    assert names == ["mine"]


def test_a_robot_of_ones_own_without_a_target_is_refused(tmp_path, capsys):
    (tmp_path / "mine" / "robot").mkdir(parents=True)
    text = (conf_folder() / "robot" / "paper.yaml").read_text().replace("_target_:", "# _target_:")
    (tmp_path / "mine" / "robot" / "mine.yaml").write_text(text)
    assert main(["sim-collect", f"--config-dir={tmp_path / 'mine'}", "robot=mine"]) == 1
    assert "lacks its first entry. Add `_target_: twbal.core.robot_sheet.robot_sheet`" in only_error(capsys)


@pytest.mark.parametrize(
    ("right", "wrong", "expected"),
    [
        ("com_height:", "# com_height:", "The sheet of robot 'paper' lacks com_height. A sheet has name"),
        ("name: paper", " name wobbly", "robot has a second line in its _target_, 'name wobbly'"),
        ("body_mass: 10.0", "body_mass: 10,0", "Is a decimal point meant? Write 10.0."),
        ("com_height:", "com_heigth:", "no setting 'robot.com_heigth' (did you mean 'robot.com_height'?)"),
        ("wheel_radius: ", "wheel_radius: m ", "cannot have robot.wheel_radius=m 0.15; expected a number from"),
    ],
)
def test_what_is_wrong_with_a_sheet_of_ones_own_is_said_by_stages_whose_cost_refers_to_it(
    right, wrong, expected, tmp_path, capsys
):
    (tmp_path / "mine" / "robot").mkdir(parents=True)
    text = (conf_folder() / "robot" / "paper.yaml").read_text().replace(right, wrong)
    (tmp_path / "mine" / "robot" / "mine.yaml").write_text(text)
    assert main(["lqr", f"--config-dir={tmp_path / 'mine'}", "robot=mine", f"hydra.run.dir={tmp_path / 'out'}"]) == 1
    assert expected in only_error(capsys)


@pytest.mark.parametrize("body", ["trials: 3", "", "[3]"])
def test_an_experiment_that_is_not_of_the_whole_configuration_is_told_so(body, tmp_path, capsys):
    (tmp_path / "experiment").mkdir()
    (tmp_path / "experiment" / "mine.yaml").write_text(body)
    words = [f"--config-dir={tmp_path}", "experiment=mine", "policy.path=policy.pt", f"hydra.run.dir={tmp_path / 'o'}"]
    assert main(["real-rollout", *words]) == 1
    assert "its first line has to be `# @package _global_`" in only_error(capsys)


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        (b"name: mine\n  track: [0.2, 1\n", "mine.yaml is no yaml: line 2, column 8: mapping values are not allowed"),
        (b"name: mine\nname: yours\n", "mine.yaml is no yaml: line 2, column 1: found duplicate key name"),
        (b"name: [mine\n", "mine.yaml is no yaml: line 2, column 1: "),
        (b"name: \x01\n", "cannot be read (unacceptable character"),
        (b"name: \xff\n", "no text in UTF-8"),
    ],
)
def test_configuration_of_ones_own_that_is_no_yaml_is_one_clear_error(written, expected, tmp_path, capsys):
    (tmp_path / "mine" / "robot").mkdir(parents=True)
    (tmp_path / "mine" / "robot" / "mine.yaml").write_bytes(written)
    assert main(["sim-collect", f"--config-dir={tmp_path / 'mine'}", "robot=mine"]) == 1
    assert expected in only_error(capsys)


@pytest.mark.parametrize("written", ["3", "[3]", "{a: b}", "[[a]]", "[{a: b, c: d}]"])
def test_a_list_of_defaults_of_ones_own_that_is_none_is_one_clear_error(written, tmp_path, capsys):
    (tmp_path / "mine" / "robot").mkdir(parents=True)
    (tmp_path / "mine" / "robot" / "mine.yaml").write_text(f"defaults: {written}\nname: mine\n")
    assert main(["sim-collect", f"--config-dir={tmp_path / 'mine'}", "robot=mine"]) == 1
    said = only_error(capsys)
    assert "efaults" in said
    assert "Expected is a list, as in `defaults: [base, {robot: paper}, _self_]`." in said


def test_a_single_run_checks_its_settings_once(stage, monkeypatch):
    checks = []
    monkeypatch.setattr("twbal.cli.sweeps.check_configuration", lambda cfg, stage, hydra: checks.append(stage))
    stage.main = lambda cfg: None
    assert main(["sim-collect"]) == 0
    assert checks == ["sim-collect"]


@pytest.fixture
def compositions(monkeypatch):
    """Lists the names of what Hydra composes."""
    names, compose = [], Hydra.compose_config
    monkeypatch.setattr(Hydra, "compose_config", lambda *a, **k: names.append(k["config_name"]) or compose(*a, **k))
    return names


def test_a_single_run_is_composed_once(stage, compositions):
    stage.main = lambda cfg: None
    assert main(["sim-collect", "seed=3"]) == 0
    assert compositions == ["sim_collect"]


@pytest.mark.parametrize("told", ["words", "a file"])
def test_a_sweep_may_be_asked_for_by_hydras_mode(stage, told, tmp_path):
    (tmp_path / "mine").mkdir()
    sweep = "# @package _global_\nhydra: {mode: MULTIRUN, sweeper: {params: {seed: '1,2'}}}\n"
    (tmp_path / "mine" / "sweep.yaml").write_text(sweep)
    words = {"words": ["hydra.mode=MULTIRUN", "seed=1,2"], "a file": [f"--config-dir={tmp_path}", "+mine=sweep"]}
    seeds = []
    stage.main = lambda cfg: seeds.append(cfg.seed)
    assert main(["sim-collect", *words[told]]) == 0
    assert seeds == [1, 2]


def environment(**more: str) -> dict[str, str]:
    clean = {name: value for name, value in os.environ.items() if name != "HYDRA_FULL_ERROR"}
    return clean | {"PYTHONPATH": os.pathsep.join(sys.path)} | more
