"""A live view never makes who drives wait, whatever the process that draws does."""

import os
import sys
import time

import numpy as np
import pytest

from twbal.core.errors import ConfigError
from twbal.core.heading import HeadingSample
from twbal.core.motion_profile import Motion
from twbal.core.plant import Observation
from twbal.viz.live.dropping import DroppingQueue
from twbal.viz.live.sample import SIZE, Sample, Sampler, decoded, encoded
from twbal.viz.live.view import LiveView, check_target

SAMPLE = Sample(*(0.5 * k for k in range(len(Sample._fields))))
READER = "import sys; print('ready', flush=True); sys.exit(len(sys.stdin.buffer.read()) != {expected})"
SLEEPER = "import time; print('ready', flush=True); time.sleep(600)"


def program(code):
    return [sys.executable, "-c", code]


def test_a_full_queue_drops_what_is_new_at_once_and_keeps_what_is_old_whole():
    reading, writing = os.pipe()
    queue = DroppingQueue(writing, 4096)
    begun = time.monotonic()
    taken = [queue.put(number.to_bytes(2, "big") * 44) for number in range(5000)]
    assert time.monotonic() - begun < 2.0  # a queue that waits for its reader would wait for ever
    assert queue.taken == sum(taken) == 4096 // 88 and queue.dropped == 5000 - queue.taken
    assert os.read(reading, 1 << 20) == b"".join(number.to_bytes(2, "big") * 44 for number in range(queue.taken))
    assert queue.put(b"x")  # there is room again
    queue.close()
    queue.close()
    os.close(reading)


def test_a_queue_that_nobody_reads_any_more_says_so_and_goes_on_dropping():
    reading, writing = os.pipe()
    queue = DroppingQueue(writing, 4096)
    os.close(reading)
    assert not queue.put(b"x") and not queue.put(b"x")
    assert queue.broken and queue.dropped == 2
    queue.close()


def test_a_view_that_reads_gets_every_byte_and_has_nothing_to_say():
    with LiveView(program(READER.format(expected=100 * SIZE))) as view:
        for _ in range(100):
            view.show(SAMPLE)
        assert view.close() is None


def test_a_view_that_draws_nothing_delays_nobody_and_that_is_told():
    with LiveView(program(SLEEPER), end_timeout=0.2) as view:
        longest = 0.0
        for _ in range(2000):
            begun = time.thread_time()  # of this thread alone: other programs may be in the way
            view.show(SAMPLE)
            longest = max(longest, time.thread_time() - begun)
        words = view.close()
    assert longest < 0.01
    assert "lacks" in words and "of 2000 control periods" in words and "did not end within 0.2 s" in words


def test_a_view_that_dies_ends_nothing_and_its_last_words_are_told():
    with LiveView(program("print('ready', flush=True); raise SystemExit('no more paint')")) as view:
        view._process.wait(60)
        view.show(SAMPLE)
        words = view.close()
    assert "lacks 1 of 1 control periods" in words and "exit code 1: no more paint" in words


def test_a_view_that_does_not_begin_is_an_error_with_its_last_words():
    with pytest.raises(ConfigError, match=r"did not start; its last words: no paint"):
        LiveView(program("raise SystemExit('no paint')"))
    with pytest.raises(ConfigError, match=r"not ready within 0.1 s"):
        LiveView(program("import time; time.sleep(600)"), start_timeout=0.1, end_timeout=0.1)


def test_samples_come_back_as_they_went():
    data = encoded(SAMPLE) + encoded(SAMPLE._replace(heading=float("nan")))
    rows = decoded(data)
    assert rows.shape == (2, len(Sample._fields)) and tuple(rows[0]) == SAMPLE
    assert np.isnan(rows[1, Sample._fields.index("heading")])


def test_a_sample_has_place_and_speed_over_ground_since_the_drive_began():
    sampler = Sampler(wheel_radius=0.1)
    sampler.sample(Observation(0.0, 0.2, 0.0, 0.0, 5.0, 0.0, 0.0), Motion(), None, 0.0)
    seen = Observation(1.0, 0.1, -0.5, 0.0, 8.1, 2.5, 0.0)
    heading = HeadingSample(0.4, 0.0, 0.3, 0.0, 0.0)
    sample = sampler.sample(seen, Motion(0.25, 0.15, 0.0), heading, 1.5, asked=0.6)
    assert sample.place == pytest.approx(0.1 * (8.1 + 0.1 - 5.0 - 0.2)) and sample.wheel == pytest.approx(3.0)
    assert sample.speed == pytest.approx(0.1 * (2.5 - 0.5))
    assert (sample.reference_place, sample.reference_speed, sample.asked_speed) == (0.25, 0.15, 0.6)
    assert (sample.heading, sample.reference_heading, sample.command) == (0.3, 0.4, 1.5)


@pytest.mark.parametrize(
    ("target", "installed", "message"),
    [
        ("windows", True, "view is window, file, or the address of a viewer"),
        ("file", False, r"pip install -e '\.\[viewers\]'"),
        ("window", True, "needs a screen, and there is none"),
        ("rerun+http://127.0.0.1:1/proxy", True, r"No viewer answers at rerun\+http://127\.0\.0\.1:1/proxy"),
    ],
)
def test_a_view_that_cannot_be_drawn_is_refused_before(monkeypatch, target, installed, message):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: object() if installed else None)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(ConfigError, match=message):
        check_target(target)
