"""A value of a sheet that is hardly right is a line of warning before the work, whatever the command."""

from pathlib import Path

import pytest

from twbal.cli.conf_folder import conf_folder
from twbal.cli.main import main

TALL = ["robot=esp32", "robot.com_height=7", "robot.body_inertia_pitch=3.77e-3"]


@pytest.mark.parametrize(
    ("words", "lines"),
    [(["robot=esp32"], 0), (TALL, 1), ([*TALL, "robot.torque_limit=600"], 2)],
)
def test_each_hardly_likely_value_is_a_warning_and_no_error(words, lines, tmp_path, as_from_a_shell, capsys):
    for stage, more in (("sim-collect", ["rollouts=1", "steps=3"]), ("virtual-robot", ["--cfg", "job"])):
        assert main([stage, *words, *more, f"hydra.run.dir={tmp_path / stage}"]) == 0
        said = [line for line in capsys.readouterr().out.splitlines() if "WARNING" in line]
        assert len(said) == (lines if stage == "sim-collect" else 0)  # settings that are shown are for programs, too
        assert all(line.startswith("  WARNING: ") and "of robot 'esp32' is" in line for line in said)


def test_each_job_of_a_sweep_warns(tmp_path, as_from_a_shell, capsys):
    words = ["robot.com_height=0.0759,7", "robot=esp32", "rollouts=1", "steps=3", f"hydra.sweep.dir={tmp_path}"]
    assert main(["sim-collect", "-m", *words]) == 0
    assert capsys.readouterr().out.count("WARNING: com_height of robot 'esp32' is 7 m") == 1


@pytest.mark.parametrize(("name", "more", "warns"), [("esp32", [], 1), ("mine", [], 0), ("esp32", ["robot.name=a"], 0)])
def test_a_copy_of_a_sheet_that_kept_its_name_is_doubted(name, more, warns, tmp_path, as_from_a_shell, capsys):
    sheet = tmp_path / "my_conf" / "robot" / "mine.yaml"
    sheet.parent.mkdir(parents=True)
    sheet.write_text((Path(conf_folder()) / "robot" / "esp32.yaml").read_text().replace("name: esp32", f"name: {name}"))
    words = ["rollouts=1", "steps=3", f"hydra.run.dir={tmp_path / 'out'}", *more]
    assert main(["sim-collect", f"robot={sheet}", *words]) == 0
    said = [line for line in capsys.readouterr().out.splitlines() if "WARNING" in line]
    assert len(said) == warns and all("write name: mine into it" in line for line in said)
