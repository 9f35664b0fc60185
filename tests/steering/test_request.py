import pytest

from twbal.steering.request import Key, Response, Steering, SteeringRequest, Sticks

STEP, TURN, TIMEOUT, STICK_TIMEOUT = 0.1, 0.5, 0.5, 2.0


def steering(hold=False):
    return Steering(Response(STEP, TURN, TIMEOUT, hold, STICK_TIMEOUT))


def after(*keys, hold=False, every=0.03):
    """What is asked for after keys that follow fast, and when the last came."""
    steered = steering(hold)
    for number, key in enumerate(keys):
        steered.take(every * number, key)
        steered.wait(every * number)
    return steered, every * (len(keys) - 1)


@pytest.mark.parametrize(
    ("keys", "asked"),
    [
        ([Key.FASTER] * 3, SteeringRequest(0.3, 0.0)),
        ([Key.FASTER] * 3 + [Key.SLOWER] * 3, SteeringRequest()),
        ([Key.SLOWER] * 2, SteeringRequest(-0.2, 0.0)),
        ([Key.FASTER] * 40, SteeringRequest(1.0, 0.0)),
        ([Key.SLOWER] * 40, SteeringRequest(-1.0, 0.0)),
        ([Key.FASTER, Key.LEFT], SteeringRequest(0.1, TURN)),
        ([Key.LEFT, Key.RIGHT], SteeringRequest(0.0, -TURN)),
        ([Key.FASTER, Key.LEFT, Key.KEEP], SteeringRequest(0.1, TURN)),
        ([Key.FASTER, Key.LEFT, Key.REST], SteeringRequest()),
        ([Sticks(0.4, -0.2)], SteeringRequest(0.4, -0.2)),
        ([Sticks(0.4, 0.0), Key.FASTER], SteeringRequest(0.5, 0.0)),
    ],
)
def test_keys_come_to_a_speed_and_a_turn(keys, asked):
    steered, _ = after(*keys)
    assert steered.asked == pytest.approx(asked, abs=1e-12)


def test_silence_of_half_a_second_ends_what_keys_asked_for_and_not_before():
    steered, last = after(Key.FASTER, Key.LEFT)
    steered.wait(last + TIMEOUT - 1e-6)
    assert steered.asked == SteeringRequest(STEP, TURN)
    steered.wait(last + TIMEOUT + 1e-6)
    assert steered.asked == SteeringRequest()
    (event,) = steered.events
    assert event.text == "no key for 0.5 s: the reference goes to rest"
    steered.wait(last + 10.0)
    assert steered.events == [event]  # said once


def test_with_more_time_for_keys_a_turn_outlasts_the_wait_for_the_first_repeat():
    steered = Steering(Response(STEP, TURN, 1.0, False, STICK_TIMEOUT))
    steered.take(0.0, Key.LEFT)
    for time in (0.3, 0.65, 0.99):
        steered.wait(time)
        assert steered.asked.turn == TURN
    steered.wait(1.01)
    assert steered.asked == SteeringRequest()


def test_a_key_that_is_held_down_goes_on_as_long_as_it_repeats():
    steered, last = after(*[Key.FASTER] * 2, *[Key.KEEP] * 200, every=0.04)
    assert last > 5 * TIMEOUT
    assert steered.asked == SteeringRequest(2 * STEP, 0.0)


def test_a_turn_ends_also_while_other_keys_keep_the_speed():
    steered = steering()
    steered.take(0.0, Key.LEFT)
    for time in (0.1, 0.3, 0.5, 0.7):
        steered.take(time, Key.FASTER)
        steered.wait(time)
        assert bool(steered.asked.turn) is (time <= 0.5)
    assert steered.asked.speed == pytest.approx(0.4)


def test_a_speed_that_is_held_stays_without_keys_and_a_turn_does_not():
    steered, last = after(Key.FASTER, Key.LEFT, hold=True)
    steered.wait(last + 100.0)
    assert steered.asked == SteeringRequest(STEP, 0.0) and not steered.events


@pytest.mark.parametrize("hold", [False, True])
def test_sticks_of_a_gamepad_that_falls_silent_ask_for_nothing_after_a_time(hold):
    """It is out of range, or its stick is held still: Linux tells neither from the other."""
    steered, last = after(Sticks(0.5, 0.5), hold=hold)
    steered.wait(last + STICK_TIMEOUT - 1e-6)
    assert steered.asked == SteeringRequest(0.5, 0.5)
    steered.wait(last + STICK_TIMEOUT + 1e-6)
    assert steered.asked == SteeringRequest()
    (event,) = steered.events
    assert event.text == "no event of the gamepad for 2 s: the reference goes to rest"
    steered.take(last + 5.0, Key.KEEP)  # another event of it, such as of a button
    assert steered.asked == SteeringRequest()
    steered.take(last + 6.0, Sticks(0.4, 0.0))
    steered.wait(last + 7.0)
    assert steered.asked == SteeringRequest(0.4, 0.0)


REST, SILENCE = "rest", "silence"


@pytest.mark.parametrize("end", [REST, SILENCE])
@pytest.mark.parametrize(
    ("then", "asked"),
    [
        ([Sticks(1.0, 0.0)], SteeringRequest()),  # as an event of the other stick says it
        ([Sticks(1.0, 0.3)], SteeringRequest(0.0, 0.3)),
        ([Sticks(0.96, 0.0)], SteeringRequest()),
        ([Sticks(0.9, 0.0)], SteeringRequest(0.9, 0.0)),
        ([Sticks(0.9, 0.0), Sticks(1.0, 0.0)], SteeringRequest(1.0, 0.0)),
        ([Sticks(0.0, 0.0), Sticks(1.0, 0.0)], SteeringRequest(1.0, 0.0)),
    ],
)
def test_a_stick_that_is_held_at_a_rest_counts_again_once_it_is_itself_moved(end, then, asked):
    steered = steering()
    steered.take(0.0, Sticks(1.0, 0.0))
    if end == REST:
        steered.take(0.5, Key.REST)
    steered.wait(0.5 if end == REST else STICK_TIMEOUT + 0.1)
    assert steered.asked == SteeringRequest()
    for sticks in then:
        steered.take(3.0, sticks)
    assert steered.asked == asked


def test_each_event_of_the_gamepad_shows_that_it_is_there():
    steered, _ = after(Sticks(0.5, 0.5), *[Key.KEEP] * 10, every=1.9)
    assert steered.asked == SteeringRequest(0.5, 0.5) and not steered.events


def test_sticks_in_their_middle_may_be_silent():
    steered, last = after(Sticks(0.5, 0.0), Sticks(0.0, 0.0))
    steered.wait(last + 100.0)
    assert not steered.events


def test_from_the_end_on_nothing_but_a_stop_is_taken():
    steered, last = after(Key.FASTER, Key.END, Key.FASTER, Sticks(1.0, 0.0))
    assert steered.asked == SteeringRequest() and steered.ending and not steered.stopped
    steered.take(last, Key.STOP)
    assert steered.stopped == "stopped by a key"
