"""The film shows wheels, and that they turn."""

import numpy as np
import pytest

from twbal.sim.film import Role, _wheel_mesh, film


def frames(robot, wheel):
    """A standing robot whose wheels have turned so far, one frame for each angle [rad]."""
    poses = np.column_stack([np.zeros((len(wheel), 2)), wheel])
    return [frame.astype(int) for frame in film(robot, [Role(poses, (0.8, 0.3, 0.0))], 240, 135)]


def test_a_wheel_that_turns_is_seen_to_turn(paper):
    still, same, turned = frames(paper, [0.0, 0.0, np.pi / 4])
    assert (still == same).all()
    assert (np.abs(still - turned).sum(axis=2) > 100).sum() > 20  # spokes elsewhere


def test_the_wheel_is_a_closed_disc_of_its_size():
    lines = [line.split() for line in _wheel_mesh(0.15, 0.04).splitlines()]
    corners = np.array([[float(x) for x in line[1:]] for line in lines if line[0] == "v"])
    faces = [[int(i) - 1 for i in line[1:]] for line in lines if line[0] == "f"]
    assert np.ptp(corners[:, 1]) == pytest.approx(0.04)
    assert np.hypot(corners[:, 0], corners[:, 2]).max() == pytest.approx(0.15, rel=1e-5)
    edges = [(face[i], face[(i + 1) % 3]) for face in faces for i in range(3)]
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)  # each edge once in each direction: closed, and one way round
    volume = sum(float(np.dot(a, np.cross(b, c))) for a, b, c in corners[faces]) / 6
    assert abs(volume) == pytest.approx(np.pi * 0.15**2 * 0.04, rel=0.01)
    assert volume > 0  # faces look outwards
