from pathlib import Path

import pytest

import twbal
from twbal.cli.conf_folder import conf_folder
from twbal.core.errors import ConfigError


def test_a_checkout_finds_the_folder_beside_the_package():
    folder = conf_folder()
    assert folder.is_absolute()
    assert folder.parent == Path(twbal.__file__).resolve().parents[1]
    assert (folder / "sim_collect.yaml").is_file()


def test_a_copy_inside_the_package_comes_first(tmp_path, monkeypatch):
    inside, beside = tmp_path / "twbal" / "conf", tmp_path / "conf"
    for folder in (inside, beside):
        folder.mkdir(parents=True)
    monkeypatch.setattr("twbal.cli.conf_folder.__file__", str(tmp_path / "twbal" / "cli" / "conf_folder.py"))
    assert conf_folder() == inside
    inside.rmdir()
    assert conf_folder() == beside


def test_a_package_without_configuration_says_where_it_looked(tmp_path, monkeypatch):
    monkeypatch.setattr("twbal.cli.conf_folder.__file__", str(tmp_path / "twbal" / "cli" / "conf_folder.py"))
    with pytest.raises(ConfigError, match="Install it with pip") as caught:
        conf_folder()
    assert str(tmp_path / "twbal" / "conf") in str(caught.value)
