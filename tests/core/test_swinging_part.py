from xml.etree import ElementTree

import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.core.swinging_part import swinging_part, without_part
from twbal.effects.effect import assemble
from twbal.effects.flexible_frame import FlexibleFrame
from twbal.sim.urdf import urdf_text


def parts_of(robot, effect):
    model = assemble(robot, [effect])
    part = swinging_part(model)
    return without_part(model.robot, part), part


def test_both_parts_together_are_the_body(paper):
    rest, part = parts_of(paper, FlexibleFrame(0.1, 5.0, 0.05, 1.8))
    assert rest.body_mass + part.mass == pytest.approx(paper.body_mass)
    first = rest.body_mass * rest.com_height + part.mass * part.height
    assert first == pytest.approx(paper.body_mass * paper.com_height)
    about_axle = rest.body_inertia_pitch + rest.body_mass * rest.com_height**2 + part.mass * part.height**2
    assert about_axle == pytest.approx(paper.body_inertia_pitch + paper.body_mass * paper.com_height**2)


def test_by_itself_it_swings_at_its_frequency_and_loses_what_its_damping_takes(paper):
    _, part = parts_of(paper, FlexibleFrame(0.1, 4.0, 0.05, 1.8))
    A = np.array([[0.0, 1.0], [part.force(1.0, 0.0) / part.mass, part.force(0.0, 1.0) / part.mass]])
    pole = np.linalg.eigvals(A)[0]
    assert abs(pole) == pytest.approx(2.0 * np.pi * 4.0)
    assert -pole.real / abs(pole) == pytest.approx(0.05)


def test_it_stands_on_the_line_to_the_centre_of_mass_and_slides_across_it(paper):
    rest, part = parts_of(paper, FlexibleFrame(0.1, 5.0, 0.05, 1.8))
    tree = ElementTree.fromstring(urdf_text(rest, part))
    body, own = (
        np.array([float(x) for x in tree.find(where).get("xyz").split()])
        for where in ("link[@name='body']/inertial/origin", "joint[@name='swinging_part_joint']/origin")
    )
    axis = np.array([float(x) for x in tree.find("joint[@name='swinging_part_joint']/axis").get("xyz").split()])
    assert np.cross(body, own) == pytest.approx(np.zeros(3), abs=1e-12)
    assert axis @ own == pytest.approx(0.0, abs=1e-12) and axis[0] > 0.9


def test_a_rigid_frame_has_no_such_part(paper):
    assert swinging_part(assemble(paper, [])) is None
    assert swinging_part(assemble(paper, [FlexibleFrame(0.0, 5.0, 0.05, 1.8)])) is None


def test_a_part_that_takes_all_of_the_inertia_is_refused(paper):
    with pytest.raises(ConfigError, match="smaller share or height"):
        parts_of(paper, FlexibleFrame(0.5, 5.0, 0.05, 3.0))


def test_a_rest_that_is_no_body_is_refused(paper):
    """Its yaw inertia would be more than those of pitch and roll together, which an engine takes for no inertia."""
    part = swinging_part(assemble(paper, [FlexibleFrame(0.25, 3.0, 0.05, 2.0)]))
    with pytest.raises(ConfigError, match="would be no body"):
        without_part(paper, part)
    without_part(paper, swinging_part(assemble(paper, [FlexibleFrame(0.2, 3.0, 0.05, 2.0)])))
