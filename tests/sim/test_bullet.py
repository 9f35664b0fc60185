import subprocess
import sys

import pytest

from twbal.sim.bullet import Client, pybullet


def test_the_simulator_starts_without_a_word():
    done = subprocess.run(
        [sys.executable, "-c", "import twbal.sim.bullet_plant"], capture_output=True, text=True, check=True
    )
    assert (done.stdout, done.stderr) == ("", "")


def test_a_world_that_is_closed_twice_leaves_the_next_one_alone():
    first = Client()
    assert first.getNumBodies() == 0
    first.close()
    second = Client()
    second.createMultiBody(0, -1)
    first.close()
    assert second.getNumBodies() == 1
    second.close()


def test_a_closed_world_is_none_any_more():
    closed, other = Client(), Client()
    closed.getNumBodies()
    closed.close()
    with pytest.raises(pybullet.error):
        closed.getNumBodies()
    other.close()
