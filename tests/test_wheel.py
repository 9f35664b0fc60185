"""The built wheel, in an empty environment away from the checkout."""

import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

from twbal import __version__

ROOT = Path(__file__).resolve().parents[1]
pytestmark = pytest.mark.slow


def run(*words, cwd, **environment):
    """What a command prints; its complaints, where it fails, are the test's."""
    # Nothing of this environment may reach the other one.
    clean = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "VIRTUAL_ENV"))}
    done = subprocess.run([*map(str, words)], cwd=cwd, env=clean | environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    words = ["-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--wheel-dir", folder, ROOT]
    run(sys.executable, *words, cwd=folder)
    (built,) = folder.glob("twbal-*.whl")
    return built


@pytest.fixture(scope="module")
def twbal(wheel, tmp_path_factory):
    """The command in an environment that holds the wheel and what it depends on."""
    folder = tmp_path_factory.mktemp("empty")
    venv.create(folder / "venv", with_pip=True)
    words = ["-m", "pip", "install", "--quiet", "--constraint", ROOT / "constraints.txt", wheel]
    run(folder / "venv" / "bin" / "python", *words, cwd=folder)
    return folder / "venv" / "bin" / "twbal"


def test_the_wheel_carries_code_and_configuration_and_no_more(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    tops = {name.split("/")[0] for name in names}
    assert tops == {"twbal", "hydra_plugins", f"twbal-{__version__}.dist-info"}
    carried = {name.removeprefix("twbal/conf/") for name in names if name.startswith("twbal/conf/")}
    assert carried == {path.relative_to(ROOT / "conf").as_posix() for path in (ROOT / "conf").rglob("*.yaml")}
    assert not [name for name in names if "__pycache__" in name]


def test_the_installed_command_finds_its_configuration(twbal, tmp_path):
    assert run(twbal, "--version", cwd=tmp_path) == f"twbal {__version__}\n"
    run(twbal, "sim-collect", "rollouts=2", cwd=tmp_path)
    assert len(list(tmp_path.glob("outputs/sim-collect/*/episodes/*.mcap"))) == 2
    assert str(twbal.parents[1]) in run(twbal, "sim-collect", "--info", "searchpath", cwd=tmp_path)


def test_the_installed_command_runs_algorithm_1(twbal, tmp_path):
    run(twbal, "iterate", f"hydra.run.dir={tmp_path / 'run'}", cwd=tmp_path)
    assert (tmp_path / "run" / "summary.json").is_file()
    assert (tmp_path / "run" / "report.html").is_file()
