import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest

from twbal.sim.urdf import urdf_text


@pytest.fixture(params=["paper", "regbot"])
def robot(request):
    return replace(request.getfixturevalue(request.param), com_offset=0.1)


def vector(element, name):
    return np.array([float(v) for v in element.get(name).split()])


def test_masses_add_up_to_the_robot(robot):
    masses = [float(m.get("value")) for m in ElementTree.fromstring(urdf_text(robot)).iter("mass")]
    assert sorted(masses) == sorted([robot.body_mass, robot.wheel_mass, robot.wheel_mass])


def test_centre_of_mass_lies_in_front_by_the_offset(robot):
    origin = vector(ElementTree.fromstring(urdf_text(robot)).find("link[@name='body']/inertial/origin"), "xyz")
    assert np.hypot(*origin[[0, 2]]) == pytest.approx(robot.com_height, rel=1e-12)
    assert np.arctan2(origin[0], origin[2]) == pytest.approx(0.1, rel=1e-12)
    assert origin[1] == 0


def test_wheels_stand_a_track_apart_left_before_right(robot):
    joints = ElementTree.fromstring(urdf_text(robot)).findall("joint")
    y = [vector(j.find("origin"), "xyz")[1] for j in joints]
    assert y == [robot.track / 2, -robot.track / 2]
    assert all((vector(j.find("axis"), "xyz") == [0, 1, 0]).all() for j in joints)


def test_wheels_collide_as_spheres_of_their_radius(robot):
    collisions = ElementTree.fromstring(urdf_text(robot)).findall("link/collision/geometry/sphere")
    assert [float(c.get("radius")) for c in collisions] == [robot.wheel_radius] * 2


def test_no_link_has_an_inertia_that_engines_refuse(robot):
    for inertia in ElementTree.fromstring(urdf_text(robot)).iter("inertia"):
        moments = sorted(float(inertia.get(name)) for name in ("ixx", "iyy", "izz"))
        assert moments[0] > 0
        assert moments[0] + moments[1] >= moments[2]
