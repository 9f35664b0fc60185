"""The range of viscous friction reaches to the back-EMF that sheets of packaged robots tell."""

import pytest
from hydra import compose
from hydra.utils import instantiate

from twbal.cli.composition import composing
from twbal.diagnosis.effect_candidates import candidates_for


@pytest.mark.parametrize(("robot", "told"), [("balboa", 0.047), ("tumbller", 1.2e-3), ("regbot", 0.0034)])
def test_a_diagnosis_can_find_the_back_emf_of_a_packaged_robot(robot, told):
    with composing():
        sheet = instantiate(compose("sim_collect", [f"robot={robot}"]).robot)
    (candidate,) = [each for each in candidates_for(sheet) if each.name == "viscous_friction"]
    (coefficient,) = candidate.parameters
    assert coefficient.low < told < 0.8 * coefficient.high
