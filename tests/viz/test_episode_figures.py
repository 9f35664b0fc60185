"""The courses of an episode are what their axes show, whatever the simulation makes of the same commands."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.text import Text

from twbal.core.channels import Channels
from twbal.core.episode import Episode, Estimated, Outcome, Provenance
from twbal.core.palette import MUTED
from twbal.core.plant import Observation
from twbal.viz.episode_figures import Stretch, courses_figure
from twbal.viz.page import percent

CHANNELS = Channels(("tilt", "tilt_rate"), 0.1)
TIME = 0.01 * np.arange(101)


@pytest.fixture
def episode():
    measured = np.zeros((101, len(Observation._fields)))
    measured[:, 0] = TIME
    measured[:, 1] = 0.1 * np.sin(TIME)
    commands = np.cos(TIME[:-1])
    states = CHANNELS.states(measured, commands)
    return Episode(CHANNELS.names, 0.01, measured, states, commands, Outcome.COMPLETED, Provenance("mine", "robot"))


def pieces(episode, tilt):
    found = [episode.observations[k : k + 51].copy() for k in (0, 50)]
    for part in found:
        part[:, 1] = np.linspace(0.0, tilt, 51)
    return [Stretch(TIME[k : k + 51], part) for k, part in zip((0, 50), found, strict=True)]


@pytest.mark.parametrize(("tilt", "is_cut"), [(0.1, False), (3.0, True)])
def test_a_simulated_robot_that_falls_makes_no_line_of_one_that_stands(tilt, is_cut, episode):
    panel = courses_figure(episode, "mine", pieces(episode, tilt)).axes[0]
    bottom, top = panel.get_ylim()
    stands = np.degrees(episode.observations[:, 1])
    assert bottom < stands.min() and stands.max() < top
    assert np.ptp(stands) > 0.3 * (top - bottom)
    assert [text.get_text() for text in panel.texts] == ["simulated: 0 to 172"] * is_cut


def test_a_simulated_tilt_that_turns_over_is_a_line_without_a_jump(episode):
    """A simulation gives the tilt between -180 and 180 degrees."""
    over = pieces(episode, 4.0)
    for piece in over:
        piece.observations[:, 1] = (piece.observations[:, 1] + np.pi) % (2.0 * np.pi) - np.pi
    panel = courses_figure(episode, "mine", over).axes[0]
    assert all(np.abs(np.diff(line.get_ydata())).max() < 10.0 for line in panel.lines)
    assert [text.get_text() for text in panel.texts] == ["simulated: 0 to 229"]


def test_the_legend_says_what_the_simulated_pieces_are(episode):
    (placed,) = courses_figure(episode, "mine", pieces(episode, 0.1)).legends
    measured, simulated = (text.get_text() for text in placed.get_texts())
    assert measured == "measured"
    assert simulated.endswith("put back onto the measured motion every 0.5 s")


def test_a_note_over_a_panel_overlaps_no_title(episode):
    guessed = replace(episode, estimated=(Estimated("tilt", 0.1),))
    figure = courses_figure(guessed, "mine", pieces(episode, 3.0))
    figure.draw_without_rendering()
    panel = figure.axes[0]
    (title,) = (text for text in panel.findobj(Text) if text.get_text() == "estimated, not measured")
    (note,) = panel.texts
    assert title.get_color() == MUTED.light
    assert panel.get_window_extent().y1 < note.get_window_extent().y0
    assert note.get_window_extent().y1 < title.get_window_extent().y0


def test_the_legend_has_what_is_in_any_panel(episode):
    guessed = replace(episode, estimated=(Estimated("tilt", 0.1),))
    (placed,) = courses_figure(guessed, "mine", pieces(episode, 0.1)).legends
    names = [text.get_text() for text in placed.get_texts()]
    assert names[0] == "worked out" and "measured" in names


def test_an_episode_of_one_sample_is_drawn_as_points(episode):
    one = replace(episode, observations=episode.observations[:1], states=episode.states[:1], commands=np.zeros(0))
    *measured, _ = courses_figure(one, "mine").axes
    assert all(panel.lines[0].get_marker() == "o" for panel in measured)
    (whole, *_) = courses_figure(episode, "mine").axes
    assert whole.lines[0].get_marker() == "None"


def test_a_share_that_rounds_to_nothing_has_no_sign():
    assert percent(-0.001) == "0\u00a0%"
