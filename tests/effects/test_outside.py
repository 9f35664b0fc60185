"""An effect from outside the package: the example of CONTRIBUTING.md, simulated, diagnosed and documented."""

import importlib
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf
from synthetic_recordings import synthetic_recording

from twbal.cli.conf_folder import conf_folder
from twbal.cli.main import main
from twbal.core.errors import ConfigError
from twbal.core.plant import Observation
from twbal.core.start_pose import StartPose
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.diagnosis.name import name_effects
from twbal.diagnosis.record import Verdict
from twbal.effects import library
from twbal.effects.dead_zone import DeadZone
from twbal.effects.effects_page import page
from twbal.planar.constants import Constants
from twbal.planar.forces import forces
from twbal.planar.parameters import parameters_class, planar_parameters
from twbal.planar.planar_plant import PlanarPlant
from twbal.planar.planar_state import STRAIGHT, PlanarState
from twbal.sim.bullet_plant import SimPlant

ROOT = Path(__file__).resolve().parents[2]
EFFECT, TEST, *_ = re.findall(
    r"^```py(?:thon)?\n(.*?)^```", (ROOT / "CONTRIBUTING.md").read_text(), re.DOTALL | re.MULTILINE
)[:2]  # behind them comes the example of a file format
REGISTERED = EFFECT.replace("EddyBrake", "SomeBrake")  # somebody may have added the example, as they should
for before, after in {
    "@dataclass": "@register\n@dataclass",
    "from twbal.effects.parameter": "from twbal.effects.library import register\nfrom twbal.effects.parameter",
}.items():
    REGISTERED = REGISTERED.replace(before, after)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "some_brake.py").write_text(REGISTERED)
    return tmp_path


@pytest.fixture
def SomeBrake(folder, monkeypatch):
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setattr(library, "_registered", {})
    yield importlib.import_module("some_brake").SomeBrake
    del sys.modules["some_brake"]


def course(plant, command):
    with plant:
        seen = np.array([plant.reset(0), *(plant.step(command) for _ in range(20))])
    return seen[:, [Observation._fields.index(name) for name in ("tilt", "tilt_rate", "wheel_angle", "wheel_rate")]]


def test_the_test_of_the_example_passes(SomeBrake):
    names = {}
    exec(TEST.replace("twbal.effects.eddy_brake", "some_brake").replace("EddyBrake", "SomeBrake"), names)
    (test,) = (value for name, value in names.items() if name.startswith("test_"))
    test()


@pytest.mark.slow  # compiles the planar model anew
def test_both_engines_simulate_it_alike(SomeBrake, paper):
    settings = {"robot": paper, "start": StartPose(-0.1, 0.0, 0.0, 0.0), "physics_step": 0.00025, "seed": 0}
    engine, planar = (
        course(kind(effects=[SomeBrake(100.0, 0.3)], **settings), -3.0) for kind in (SimPlant, PlanarPlant)
    )
    without = course(PlanarPlant(effects=[], **settings), -3.0)
    does = np.abs(planar - without).max(axis=0)
    assert (does > [0.001, 0.01, 0.01, 0.1]).all()
    assert (np.abs(engine - planar).max(axis=0) < 0.02 * does).all()


@pytest.mark.slow
def test_it_is_named_from_data_that_have_it(SomeBrake, paper):
    recording = synthetic_recording(paper, {"some_brake": {"coefficient": 10.0, "critical": 0.2}}, seed=1, periods=600)
    settings = instantiate(OmegaConf.load(conf_folder() / "groups" / "diagnosis.yaml").default)
    found = name_effects([recording], paper, {}, candidates_for(paper), settings)
    assert found.verdict is Verdict.NAMED
    (effect,) = found.named_effects
    assert effect.name == "some_brake"
    assert effect.parameters["coefficient"].value == pytest.approx(10.0, rel=0.05)


def test_the_command_line_knows_its_settings(SomeBrake, as_from_a_shell, capsys):
    chosen = "+effect@sim.effects.some_brake=some_brake"
    assert main(["sim-collect", chosen, "--help"]) == 0
    assert re.search(
        r"sim\.effects\.some_brake\.coefficient=20\.0 +0 to 1000 N·s/m +force over", capsys.readouterr().out
    )
    assert main(["sim-collect", chosen, "sim.effects.some_brake.coefficient=1001"]) == 1
    assert "sim.effects.some_brake.coefficient=1001; expected a number from 0 to 1000" in capsys.readouterr().err
    Path("brake.yaml").write_text("effects: {some_brake: {coefficient: 1.5, critical: 0.2}}")
    assert main(["sim-collect", "sim=brake.yaml", "--cfg", "job"]) == 0
    assert "_target_: some_brake.SomeBrake\n      coefficient: 1.5" in capsys.readouterr().out


def test_a_term_that_numba_cannot_compile_is_one_clear_error(SomeBrake, paper, monkeypatch):
    monkeypatch.setattr(SomeBrake, "push", lambda self, force, at: force - self.mistyped * at.speed)
    monkeypatch.setattr(library, "source_of", lambda kind: "of this test")
    said = r"Method 'push' of SomeBrake \(.*\) cannot be compiled: Unknown attribute 'mistyped'"
    k, rest = Constants(*[1.0] * len(Constants._fields)), PlanarState(*[0.0] * len(PlanarState._fields))
    with pytest.raises(ConfigError, match=said):
        forces(planar_parameters(paper, {}), k, rest, 0.0, 0.0, STRAIGHT)


def test_it_is_documented(SomeBrake):
    (section,) = (part for part in page().split("\n## ") if part.startswith("some_brake"))
    assert "| `coefficient` | force over a small speed | N·s/m | 0 to 100 * | 20 | 0 |" in section
    assert "Nearly indistinguishable from [rolling_viscous]" in section
    assert "Smythe" in section


@pytest.mark.parametrize("how", ["variable", "entry point"])
def test_a_command_finds_it_by_a_variable_or_an_entry_point(how, folder):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}
    if how == "variable":
        environment["TWBAL_EFFECTS"] = "some_brake"
    else:
        (folder / "mine-1.0.dist-info").mkdir()
        (folder / "mine-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
        (folder / "mine-1.0.dist-info" / "entry_points.txt").write_text("[twbal.effects]\nsome_brake = some_brake\n")
    words = ["sim-collect", "+effect@sim.effects.some_brake=some_brake", "rollouts=2", "steps=3", "workers=2"]
    done = subprocess.run(
        [sys.executable, "-m", "twbal", *words, "hydra.run.dir=out"], cwd=folder, env=environment, capture_output=True
    )
    assert done.returncode == 0, done.stderr.decode()
    assert len(list(folder.rglob("*.mcap"))) == 2


def test_kept_machine_code_is_never_that_of_another_source(SomeBrake, folder):
    assert parameters_class().__name__ != "Parameters"
    before = library.outside_digest()
    (folder / "some_brake.py").write_text(REGISTERED.replace("force - ", "force + "))
    library.source_of.cache_clear()
    importlib.invalidate_caches()
    assert library.outside_digest() != before


def test_an_effect_that_has_a_name_that_is_taken_is_refused(SomeBrake):
    taken = type("DeadZone", (DeadZone,), {"__module__": "mine", "__doc__": "Another one.", "__annotations__": {}})
    with pytest.raises(ConfigError, match="There is an effect 'dead_zone' already"):
        library.register(dataclass(frozen=True)(taken))
