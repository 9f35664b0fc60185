"""What is kept for other tests is what Hydra composes by itself."""

import subprocess
import sys

from hydra import compose
from omegaconf import OmegaConf

from twbal.cli.composition import composing

WORDS = ["robot=regbot", "rollouts=3"]
BY_ITSELF = f"""
from hydra import compose
from omegaconf import OmegaConf
from twbal.cli.composition import composing
with composing():
    print(OmegaConf.to_yaml(compose("sim_collect", {WORDS})), end="")
"""


def test_a_kept_configuration_is_that_of_hydra_and_nobody_changes_it_for_others():
    own = subprocess.run([sys.executable, "-c", BY_ITSELF], check=True, capture_output=True, text=True).stdout
    with composing():
        for _ in range(2):
            kept = compose("sim_collect", WORDS)
            assert OmegaConf.to_yaml(kept) == own
            OmegaConf.set_struct(kept, False)
            kept.rollouts, kept.robot.body_mass, kept.more = -1, -1.0, {"a": 1}
