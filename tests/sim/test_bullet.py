import subprocess
import sys


def test_the_simulator_starts_without_a_word():
    done = subprocess.run(
        [sys.executable, "-c", "import twbal.sim.bullet_plant"], capture_output=True, text=True, check=True
    )
    assert (done.stdout, done.stderr) == ("", "")
