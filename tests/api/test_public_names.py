"""What `import twbal` offers, and that it costs nothing until it is used."""

import inspect
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

import twbal
from twbal.core.errors import CheckpointError, ConfigError, LogError

FUNCTIONS = [getattr(twbal, name) for name in twbal.__all__ if name[0].islower()]


def test_no_public_name_hides_a_package():
    packages = {module.name for module in pkgutil.iter_modules(twbal.__path__)}
    assert not packages & set(twbal.__all__)


def test_importing_the_library_loads_none_of_it():
    code = "import sys, twbal; print(*(n for n in sys.modules if n.split('.')[0] in ('numpy', 'torch', 'hydra')))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "\n"


def test_an_unknown_name_lists_those_that_there_are():
    with pytest.raises(AttributeError, match=r"no attribute 'train'; it has: .*learn"):
        twbal.train  # noqa: B018


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda function: function.__name__)
def test_every_parameter_and_result_has_a_type(function):
    signature = inspect.signature(function)
    assert signature.return_annotation is not inspect.Signature.empty
    assert all(p.annotation is not inspect.Parameter.empty for p in signature.parameters.values())


@pytest.mark.parametrize("kind", [str, Path])
def test_paths_are_text_or_paths(kind, tmp_path):
    with pytest.raises(CheckpointError, match="There is no checkpoint"):
        twbal.load_policy(kind(tmp_path / "none.pt"))
    with pytest.raises(CheckpointError, match="There is no checkpoint"):
        twbal.load_model(kind(tmp_path / "none.pt"))
    with pytest.raises(LogError, match="is not there"):
        twbal.read_episodes(kind(tmp_path / "none"))


def test_an_unknown_robot_lists_those_that_there_are():
    with pytest.raises(ConfigError, match=r"no choice 'papr'.*paper"):
        twbal.robot("papr")
