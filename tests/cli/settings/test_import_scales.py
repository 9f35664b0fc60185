"""Scales of a mapping: one number, or one for each column."""

import math

import pytest

from twbal.cli.main import main
from twbal.cli.settings.validate import check, faults
from twbal.core.errors import ConfigError
from twbal.core.files import write_atomically
from twbal.core.plant import Observation
from twbal.io.logs import read_episode

PERIOD = 0.01


def found(scale):
    source = {"from": ["left", "right"], "scale": scale}
    return list(faults("import-log", {"import": {"quantities": {"wheel_angle": source}}}))


@pytest.mark.parametrize("scale", [1, -0.5, [1, -1], [2.0], [1e-3, -1e-3]], ids=repr)
def test_a_scale_is_a_number_or_a_list_of_them(scale):
    assert found(scale) == []


@pytest.mark.parametrize("scale", ["1", [], [1, "a"], [1, None], [math.inf, 1], True, None], ids=repr)
def test_other_scales_are_refused_and_what_they_may_be_is_said(scale):
    (fault,) = found(scale)
    assert fault.key == "import.quantities.wheel_angle.scale"
    assert "a number from -1e12 to 1e12; or a list of 1 or more" in fault.expected


def test_a_decimal_comma_in_braces_is_told_from_a_wrong_name():
    """Yaml takes {from: gyro, scale: 0,1} for a scale of 0 and an entry 1."""
    source = {"from": "gyro", "scale": 0, "1": None}
    with pytest.raises(ConfigError, match=r"import\.quantities\.tilt_rate\.1' \(a decimal comma\? Write 0\.1"):
        check("import-log", {"import": {"quantities": {"tilt_rate": source}}})


@pytest.fixture
def log(tmp_path):
    """A log whose right wheel counts backward."""
    lines = ["time,tilt,left,right,torque"]
    for k in range(200):
        t = PERIOD * k
        wheel = 2 * math.sin(2 * t)
        lines.append(f"{t:.9g},{0.05 * math.sin(3 * t):.9g},{wheel:.9g},{-wheel:.9g},{math.sin(5 * t):.9g}")
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


MAPPING = """defaults: [columns, _self_]
quantities:
  wheel_angle: {{from: [left, right], unit: rad{}}}
  command: {{from: torque}}
  tilt_rate: null
  acceleration: null
  yaw_rate: null
  wheel_rate: null
"""


@pytest.mark.parametrize("place", ["yaml", "command line"])
def test_two_scales_work_in_yaml_and_on_the_command_line(place, log, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("twbal.cli.stages.import_log.save", lambda figure, path, **_: write_atomically(path, ""))
    (tmp_path / "conf" / "import").mkdir(parents=True)
    written = MAPPING.format(", scale: [1, -1]" if place == "yaml" else "")
    (tmp_path / "conf" / "import" / "mine.yaml").write_text(written)
    words = [f"--config-dir={tmp_path / 'conf'}", "import=mine", f"files={log}", f"robot.control_period={PERIOD}"]
    words += ["++import.quantities.wheel_angle.scale=[1,-1]"] if place == "command line" else []
    code = main(["import-log", *words, f"hydra.run.dir={tmp_path / 'out'}"])
    said = capsys.readouterr()
    assert code == 0, said.err
    observations = read_episode(tmp_path / "out" / "episodes" / "log.mcap").observations
    wheel_angle = observations[:, Observation._fields.index("wheel_angle")]
    assert wheel_angle == pytest.approx([2 * math.sin(2 * PERIOD * k) for k in range(200)], abs=1e-6)
