"""Every command that README, docs, help and messages show is run, in a scratch folder and in small."""

import importlib
import os
import re
import runpy
import shlex
import subprocess
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest
from how_to_run import SMALL, TABLE, Benchmark, Elsewhere, Install, Make, Stage
from scratch import furnish
from shown import PAGES, ROOT, blocks, commands

from twbal.cli.main import STAGES, main
from twbal.virtual_robot.process import VirtualRobotProcess, virtual_robot_command

pytestmark = pytest.mark.usefixtures("kept_robots")

SHOWN = commands()


def told(kind):
    """Commands that are to be run in one way, with how."""
    known = [(shown.text, TABLE[shown.text]) for shown in SHOWN if shown.text in TABLE]
    return [pytest.param(text, how, id=text) for text, how in known if isinstance(how, kind)]


@pytest.fixture(scope="module")
def scratch(tmp_path_factory):
    folder, before, arguments = tmp_path_factory.mktemp("scratch"), Path.cwd(), sys.argv
    os.chdir(folder)
    try:
        furnish(folder)
    finally:
        os.chdir(before)
        sys.argv = arguments
    return folder


@pytest.fixture(scope="module")
def port():
    """Of a virtual robot that waits for a host, as a robot on a serial port does."""
    robot = VirtualRobotProcess.ready(virtual_robot_command(["seed=3"]), 60.0)
    yield robot.port
    robot.close()


@pytest.fixture
def run(scratch, port, monkeypatch):
    """Runs a command of the table; what it reads is made before."""
    monkeypatch.setattr(sys, "argv", ["twbal"])
    monkeypatch.chdir(scratch)
    done = DONE.setdefault(scratch, set())

    def of_table(text):
        how = TABLE[text]
        for earlier in how.after:
            of_table(earlier)
        stage, *words = [word.replace("{port}", port) for word in words_of(text, how)]
        small = SMALL.get(stage, ()) if how.small is None else how.small
        whole = (stage, *words, *small)
        if whole in done:  # shown with and without `twbal`, or by a path and by a placeholder
            return
        if stage == "virtual-robot":  # which serves until it is ended
            VirtualRobotProcess.ready(virtual_robot_command(words), 60.0).close()
            return
        unasked = ["link.confirm_placed=null"] if "link=serial" in words else []
        assert main([stage, *words, *unasked, *small]) == 0, text
        done.add(whole)

    return of_table


DONE: dict[Path, set[tuple[str, ...]]] = {}  # what has run in a scratch folder


def words_of(text, how):
    """The words behind `twbal`, with what a reader fills in."""
    for part, filled in how.fill.items():
        text = text.replace(part, filled)
    assert not re.search(r"<\w[^>]*>", text), f"{text!r}: say in tests/docs/how_to_run.py what stands in place of <...>"
    words = shlex.split(text)
    return words[1:] if words[0].rpartition("/")[-1] == "twbal" else words


def test_every_command_that_is_shown_is_in_the_table():
    missing = [f"{shown.place}: `{shown.text}`" for shown in SHOWN if shown.text not in TABLE]
    assert not missing, "\n".join(["Not in the table of tests/docs/how_to_run.py; add how to run it:", *missing])


def test_every_command_of_the_table_is_shown():
    gone = sorted(set(TABLE) - {shown.text for shown in SHOWN})
    assert not gone, "\n".join(["Shown nowhere any more; take it out of tests/docs/how_to_run.py:", *gone])


@pytest.mark.parametrize(("text", "how"), [case for case in told(Stage) if not case.values[1].slow])
def test_a_command_runs_as_it_is_shown(text, how, run):
    if how.extra:
        pytest.importorskip(how.extra)
    run(text)


@pytest.mark.filterwarnings("ignore")  # as where users run them: those of libraries are not errors there
@pytest.mark.slow
@pytest.mark.parametrize(("text", "how"), [case for case in told(Stage) if case.values[1].slow])
def test_a_longer_command_runs_as_it_is_shown(text, how, run):
    if how.extra:
        pytest.importorskip(how.extra)
    run(text)


@pytest.mark.parametrize(("text", "how"), [case for case in told(Stage) if case.values[1].slow])
def test_a_longer_command_has_settings_that_there_are(text, how, run, capsys):
    stage, *words = words_of(text, how)
    if any(word.startswith("--config-dir") for word in words):  # whose choices an earlier command may have to make
        for earlier in how.after:
            run(earlier)
    if "-m" in words:  # of a sweep, the first job
        words = [
            word.partition(",")[0]
            for word in words
            if word != "-m" and not word.startswith(("hydra", "parametrisation"))
        ]
    made = [word.replace("{port}", "p") for word in words if not word.startswith("sim=outputs")]  # which is not there
    assert main([stage, *made, "--cfg", "job"]) == 0, capsys.readouterr().err


@pytest.mark.parametrize(("text", "how"), told(Make))
def test_make_knows_its_targets(text, how):
    done = subprocess.run(["make", "-n", *text.split()[1:]], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("text", "how"), told(Install))
def test_what_pip_installs_is_there(text, how):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = re.findall(r"\.\[([\w,]+)\]", text)
    if extras:
        assert set(",".join(extras).split(",")) <= set(project["optional-dependencies"])
        assert "-e '.[" in text, "twbal is not on the package index: pip install -e '.[extra]', in the checkout"
    else:
        assert distribution(Path(text.split()[0]).name)


@pytest.mark.parametrize(("text", "how"), told(Benchmark))
def test_a_benchmark_starts(text, how, monkeypatch, tmp_path):
    _, _, module, *words = shlex.split(text)
    if how.measures:
        assert importlib.util.find_spec(f"{module}.__main__")
        assert callable(getattr(importlib.import_module("benchmarks.measure"), "measure", None))
        return
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, f"{module}.__main__", raising=False)  # another test may have imported it
    if importlib.util.find_spec(module).submodule_search_locations is None:
        monkeypatch.delitem(sys.modules, module, raising=False)
    monkeypatch.setattr(sys, "argv", [module, *words, "nonsense=1"])
    with pytest.raises(SystemExit, match=r"unknown settings: nonsense|Strata: "):
        runpy.run_module(module, run_name="__main__", alter_sys=False)


@pytest.mark.parametrize(("text", "how"), told(Elsewhere))
def test_a_command_that_is_run_elsewhere_is_run_there(text, how):
    if how.test is not None:
        file, word = how.test
        assert word in (ROOT / file).read_text(), f"{file} no longer has {word!r}, which is to run `{text}`"


def test_a_stage_that_prose_names_is_there():
    for page in PAGES:
        named = set(re.findall(r"`twbal ([a-z][\w-]*)", page.read_text()))
        assert named <= set(STAGES), f"{page.name} names stages that are not there: {', '.join(named - set(STAGES))}"


PYTHON = [block for page in PAGES for block in blocks(page) if block.language == "python"]


@pytest.mark.parametrize("block", PYTHON, ids=[block.place for block in PYTHON])
def test_python_runs_as_it_is_shown(block, tmp_path, monkeypatch):
    for package in re.findall(r"# pip install ([\w-]+)", block.text):
        try:
            distribution(package)
        except PackageNotFoundError:
            pytest.skip(f"{package} is not installed")
    (tmp_path / "0.mcap").symlink_to(ROOT / "data/regression/real/trial_000.mcap")
    (tmp_path / "policy.pt").symlink_to(ROOT / "data/regression/policy.pt")
    monkeypatch.chdir(tmp_path)
    exec(compile(block.text, block.place, "exec"), {"__name__": "__main__"})
