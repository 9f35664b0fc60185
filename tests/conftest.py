import gc
import signal
import sys
from contextlib import ExitStack, nullcontext
from pathlib import Path

import pytest
from hydra.utils import instantiate
from kept_configurations import keep_configurations
from omegaconf import OmegaConf

from twbal.core.threads import default_to_one_thread

default_to_one_thread()  # as the commands do; test modules, which load what is numeric, are imported after this

# A job in the background of a shell ignores Ctrl-C, and so do the commands that it starts; tests press it.
signal.signal(signal.SIGINT, signal.default_int_handler)

CONF = Path(__file__).parents[1] / "conf"


def pytest_addoption(parser):
    """What the conformance suite (link/conformance) is told."""
    parser.addoption(
        "--robot",
        metavar="PORT|COMMAND",
        help="try this robot alone: its port, or a program that prints `port <path>`; {clock} in it becomes lockstep "
        "and real_time",
    )


def pytest_configure(config):
    """Tests compose the same files again and again."""
    keep_configurations(patch := pytest.MonkeyPatch())
    config.add_cleanup(patch.undo)


def pytest_collection_finish():
    """Take the modules out of all later garbage collections, which else go through them again and again."""
    gc.collect()
    gc.freeze()


def from_yaml(name):
    return instantiate(OmegaConf.load(CONF / name))


@pytest.fixture(scope="session")
def paper():
    return from_yaml("robot/paper.yaml")


@pytest.fixture(scope="session")
def regbot():
    return from_yaml("robot/regbot.yaml")


@pytest.fixture(autouse=True)
def state_of_its_own(monkeypatch, tmp_path_factory, request):
    """Records of checked robots neither outlive a test nor come from who runs it."""
    folder = tmp_path_factory.getbasetemp() / "state" / str(abs(hash(request.node.nodeid)))
    monkeypatch.setenv("XDG_STATE_HOME", str(folder))


@pytest.fixture(scope="module")
def kept_robots():
    """Virtual robots of the same settings are one process, which commands have one after the other.

    They do what fresh ones do (virtual_robot/test_process.py), and take two seconds each to start.
    """
    from twbal.virtual_robot import process

    with ExitStack() as stack, pytest.MonkeyPatch.context() as patch:
        kept, new = {}, process.KeptRobots

        class Kept:
            def begin(self, command, robots):
                pass

            def are_ready(self, command, robots, start_timeout):
                return False  # for a copy of the process beside this one

            def launch(self, command, start_timeout):
                words = tuple(command)
                if words not in kept:
                    kept[words] = stack.enter_context(new())
                return kept[words].launch(command, start_timeout)

        patch.setattr(process, "KeptRobots", lambda: nullcontext(Kept()))
        yield


@pytest.fixture
def as_from_a_shell(monkeypatch, tmp_path):
    """A stage sets sys.argv; what it writes goes to an empty folder."""
    monkeypatch.setattr(sys, "argv", ["twbal"])
    monkeypatch.delenv("HYDRA_FULL_ERROR", raising=False)
    monkeypatch.delenv("TWBAL_DEBUG", raising=False)
    monkeypatch.chdir(tmp_path)
