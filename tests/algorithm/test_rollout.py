import numpy as np
import pytest

from twbal.algorithm.rollout import rollout
from twbal.core.channels import Channels
from twbal.core.episode import Outcome, Provenance
from twbal.core.errors import ConfigError, DataError, LinkError, LinkLostError
from twbal.core.plant import Observation, Plant, Pose
from twbal.policies.policy import Policy

CHANNELS = Channels(("tilt", "command_1"), 0.15)
PROVENANCE = Provenance("toy", "simulation", seed=4, trial=2)


class Toy(Plant):
    """Its tilt grows by a tenth of each command; at step `at` it does what `then` says."""

    control_period = 0.02

    def __init__(self, at=10**9, then=None):
        self.at, self.then, self.stops, self.closed = at, then, 0, False

    def reset(self, trial):
        self.trial, self.tilt, self.given = trial, 0.0, []
        if self.at == 0:
            raise self.then
        return self.seen()

    def seen(self):
        return Observation(self.control_period * len(self.given), self.tilt, 0, 0, 0, 0, 0)

    def step(self, command):
        self.given.append(command)
        self.tilt += 0.1 * command
        if len(self.given) == self.at:
            if isinstance(self.then, BaseException):
                raise self.then
            self.tilt = self.then
        return self.seen()

    def stop(self):
        self.stops += 1

    def close(self):
        self.closed = True


class Counting(Policy):
    """Commands 1, 2, 3 ... thousandths, with a random part that is far smaller."""

    def controller(self, rng):
        count = 0

        def law(state):
            nonlocal count
            count += 1
            return 1e-3 * count + 1e-9 * rng.random()

        return law


def drive(plant, steps=5, limit=0.5):
    return rollout(plant, Counting(), CHANNELS, steps, limit, PROVENANCE)


def test_commands_act_between_the_observations_that_frame_them():
    plant = Toy()
    episode = drive(plant)
    assert episode.outcome is Outcome.COMPLETED
    assert plant.trial == 2
    assert episode.commands.tolist() == plant.given
    np.testing.assert_allclose(np.diff(episode.states[:, 0]), 0.1 * episode.commands, rtol=1e-9)
    assert episode.states[:, 1].tolist() == [0.0, *episode.commands]
    assert np.array_equal(episode.tilt, episode.states[:, 0])
    assert (episode.channels, episode.provenance) == (CHANNELS.names, PROVENANCE)


def test_commands_are_recorded_as_the_plant_cuts_them():
    plant = Toy()
    plant.command_limit = 0.0025
    episode = drive(plant)
    assert plant.given[-1] > plant.command_limit
    np.testing.assert_array_equal(episode.commands, np.minimum(plant.given, 0.0025))


def test_the_same_seed_and_trial_repeat_the_rollout():
    assert np.array_equal(drive(Toy()).commands, drive(Toy()).commands)


@pytest.mark.parametrize(
    ("tilt", "outcome"), [(0.51, Outcome.TILT_LIMIT), (-0.51, Outcome.TILT_LIMIT), (0.5, "completed")]
)
def test_it_ends_where_the_tilt_passes_its_limit(tilt, outcome):
    plant = Toy(at=3, then=tilt)
    episode = drive(plant, steps=4, limit=0.505)
    assert episode.outcome == outcome
    assert len(episode) == (3 if outcome is Outcome.TILT_LIMIT else 4)
    assert episode.tilt[3] == tilt
    assert plant.stops == 1


@pytest.mark.parametrize(
    ("end", "outcome", "text"),
    [
        (LinkLostError("no answer for 0.1 s"), Outcome.LINK_LOST, "no answer for 0.1 s"),
        (KeyboardInterrupt(), Outcome.STOPPED, "stopped by the person"),
    ],
)
def test_an_interrupted_rollout_keeps_what_was_seen(end, outcome, text):
    plant = Toy(at=3, then=end)
    episode = drive(plant)
    assert episode.outcome is outcome
    assert len(episode) == 2
    assert episode.events[0].text == text
    assert episode.events[0].time == pytest.approx(0.04)
    assert plant.stops == 1


class Interrupting(Observation):
    """Ctrl-C is pressed when its tilt is read."""

    @property
    def tilt(self):
        raise KeyboardInterrupt


def test_ctrl_c_while_a_step_is_recorded_leaves_that_step_out():
    class Late(Toy):
        def seen(self):
            seen = super().seen()
            return Interrupting(*seen) if len(self.given) == 3 else seen

    episode = drive(Late())
    assert episode.outcome is Outcome.STOPPED
    assert len(episode) == 2
    assert episode.events[0].time == pytest.approx(0.04)


@pytest.mark.parametrize("end", [LinkLostError("gone"), LinkError("not there"), KeyboardInterrupt()])
def test_a_robot_that_was_never_seen_is_an_error_and_is_stopped(end):
    plant = Toy(at=0, then=end)
    with pytest.raises(type(end)):
        drive(plant)
    assert plant.stops == 1


def test_a_value_that_is_not_finite_ends_the_rollout_and_keeps_what_was_seen():
    plant = Toy(at=2, then=float("nan"))
    episode = drive(plant)
    assert (len(episode), episode.outcome) == (1, Outcome.LINK_LOST)
    assert "not a finite number: Observation" in episode.events[0].text
    assert plant.stops == 1


@pytest.mark.parametrize("tick", [0.0, -0.02])
def test_a_clock_that_does_not_run_forward_ends_the_rollout_and_keeps_what_was_seen(tick):
    class Stuck(Toy):
        def seen(self):
            late = max(len(self.given) - 3, 0)
            return super().seen()._replace(time=0.02 * (len(self.given) - late) + tick * late)

    plant = Stuck()
    episode = drive(plant)
    assert (len(episode), episode.outcome) == (3, Outcome.LINK_LOST)
    assert "clock does not run forward" in episode.events[0].text
    assert plant.stops == 1


@pytest.mark.parametrize("wrong", [float("nan"), float("inf"), None, np.array([1.0, 2.0]), "1"])
def test_a_command_that_is_no_number_is_not_given_and_what_was_seen_is_kept(wrong):
    class Broken(Policy):
        def controller(self, rng):
            commands = iter([1e-3, 2e-3])
            return lambda state: next(commands, wrong)

    plant = Toy()
    episode = rollout(plant, Broken(), CHANNELS, 5, 0.5, PROVENANCE)
    assert (len(episode), episode.outcome) == (2, Outcome.POLICY_FAULT)
    assert f"The policy commands {wrong} N·m" in episode.events[0].text
    assert plant.given == [1e-3, 2e-3]
    assert plant.stops == 1


@pytest.mark.parametrize("limit", [float("nan"), float("inf"), 1e9, 1.6, 0.0, -0.5])
def test_a_tilt_limit_that_would_never_end_a_fall_is_refused_before_the_robot_is_touched(limit):
    plant = Toy()
    with pytest.raises(ConfigError, match=r"at most 1\.5708 rad"):
        drive(plant, limit=limit)
    assert not hasattr(plant, "given")


class Unstoppable(Toy):
    """Its first stops end as `ends` says."""

    def __init__(self, *ends, **toy):
        super().__init__(**toy)
        self.ends = list(ends)

    def stop(self):
        super().stop()
        if self.ends:
            raise self.ends.pop(0)


def test_a_robot_that_does_not_confirm_its_stop_is_a_lost_link_and_the_episode_is_kept():
    episode = drive(Unstoppable(LinkLostError("not confirmed")))
    assert (len(episode), episode.outcome) == (5, Outcome.LINK_LOST)
    assert [event.text for event in episode.events] == ["not confirmed"]


def test_a_stop_without_confirmation_after_a_lost_link_is_told_beside_what_came_before():
    episode = drive(Unstoppable(LinkLostError("not confirmed"), at=3, then=LinkLostError("silence")))
    assert (len(episode), episode.outcome) == (2, Outcome.LINK_LOST)
    assert [event.text for event in episode.events] == ["silence", "not confirmed"]


@pytest.mark.parametrize(
    ("silence", "length", "outcome", "texts"),
    [
        ({}, 5, Outcome.STOPPED, ["stopped by the person"]),
        ({"at": 3, "then": LinkLostError("silence")}, 2, Outcome.LINK_LOST, ["silence", "stopped by the person"]),
    ],
)
def test_ctrl_c_in_the_last_stop_stops_again_and_keeps_the_episode(silence, length, outcome, texts):
    plant = Unstoppable(KeyboardInterrupt(), **silence)
    episode = drive(plant)
    assert (len(episode), episode.outcome) == (length, outcome)
    assert [event.text for event in episode.events] == texts
    assert plant.stops == 2


def test_a_fault_of_the_policy_stops_the_robot():
    class Broken(Policy):
        def controller(self, rng):
            return lambda state: 1 / 0

    plant = Toy()
    episode = rollout(plant, Broken(), CHANNELS, 5, 0.5, PROVENANCE)
    assert (plant.stops, episode.outcome) == (1, Outcome.POLICY_FAULT)
    assert "The policy ended with the error ZeroDivisionError: division by zero, in state [" in episode.events[-1].text


def test_leaving_a_plant_closes_it():
    with Toy() as plant:
        pass
    assert plant.closed


class Watched(Toy):
    """A toy of which `told` says the true pose after so many steps."""

    def __init__(self, told):
        super().__init__()
        self.told = told

    def pose(self):
        return self.told(len(self.given))


def test_each_observation_has_its_true_pose():
    episode = drive(Watched(lambda step: Pose(step, -step, 0.5, self_tilt(step))))
    np.testing.assert_allclose(episode.poses, [(k, -k, 0.5, self_tilt(k)) for k in range(6)])
    np.testing.assert_allclose(episode.poses[:, 3], episode.tilt, atol=1e-6)


def self_tilt(step):
    """Tilt of the toy after commands of 1, 2, 3 ... thousandths."""
    return 1e-4 * step * (step + 1) / 2


def test_an_instant_without_a_pose_is_a_gap_and_a_rollout_without_any_has_none():
    gap = drive(Watched(lambda step: None if step == 2 else Pose(1.0, 2.0, 3.0, 4.0))).poses
    assert np.isnan(gap[2]).all()
    assert gap[[0, 1, 3, 4, 5]].tolist() == [[1.0, 2.0, 3.0, 4.0]] * 5
    assert drive(Watched(lambda step: None)).poses is None
    assert drive(Toy()).poses is None


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_pose_that_is_no_number_ends_the_rollout_as_an_observation_does(value):
    episode = drive(Watched(lambda step: Pose(0.0, value if step == 3 else 0.0, 0.0, 0.0)))
    assert episode.outcome is Outcome.LINK_LOST
    assert len(episode) == 2
    assert "true pose" in episode.events[-1].text
    with pytest.raises(LinkLostError, match="true pose"):
        drive(Watched(lambda step: Pose(value, 0.0, 0.0, 0.0)))


class Own(Policy):
    """Gives the law that it was made with."""

    def __init__(self, law):
        self._law = law

    def controller(self, rng):
        return self._law


def driven_by(policy, plant=None):
    return rollout(plant or Toy(), policy, CHANNELS, 4, 0.5, PROVENANCE)


def test_a_law_that_works_on_its_state_in_place_changes_no_record():
    def law(state):
        command = 1e-3 - state[0]
        state *= 0.0
        return command

    np.testing.assert_array_equal(driven_by(Own(law)).states, driven_by(Own(lambda state: 1e-3 - state[0])).states)


@pytest.mark.parametrize("one", [np.array([0.25]), np.array(0.25), np.float32(0.25), np.array([[0.25]])])
def test_a_command_is_one_number_also_of_an_array(one):
    assert driven_by(Own(lambda state: one)).commands.tolist() == [0.25] * 4


@pytest.mark.parametrize("several", [np.array([0.1, 0.2]), [0.1, 0.2], np.array([])])
def test_a_command_of_several_numbers_says_what_to_return(several):
    episode = driven_by(Own(lambda state: several))
    assert episode.outcome is Outcome.POLICY_FAULT
    assert episode.events[-1].text.endswith("return one number, as by float(u).")


class WithoutGenerator(Policy):
    def controller(self):
        return lambda state: 0.0


class Raising(Policy):
    def controller(self, rng):
        raise ValueError("mine")


@pytest.mark.parametrize(
    ("policy", "said"),
    [
        (Raising(), "Rollout 2 did not begin: `controller` of the policy Raising .* ValueError: mine. Expected"),
        (WithoutGenerator(), r"TypeError: .* Expected is a method `controller\(self, rng\)` that returns a law"),
        (Own(None), "`controller` of the policy Own returned None"),
        (Own(0.0), r"returned 0\.0"),
    ],
)
def test_a_policy_that_gives_no_law_is_one_clear_error_and_the_robot_is_stopped(policy, said):
    plant = Toy()
    with pytest.raises(DataError, match=said):
        driven_by(policy, plant)
    assert plant.stops == 1


class Returning(Toy):
    """Its observations are what `of` makes of true ones."""

    def __init__(self, of):
        super().__init__()
        self._of = of

    def seen(self):
        return self._of(super().seen())


@pytest.mark.parametrize("of", [tuple, list, np.array])
def test_seven_numbers_are_an_observation(of):
    found, expected = drive(Returning(of)), drive(Toy())
    np.testing.assert_array_equal(found.observations, expected.observations)


@pytest.mark.parametrize(
    "of",
    [
        lambda seen: None,
        lambda seen: tuple(seen)[:5],
        lambda seen: (np.array(seen), 0.0, False, {}),
        lambda seen: np.array(seen)[None],
        lambda seen: seen._replace(tilt="0.1"),
        lambda seen: "1234567",
    ],
)
def test_what_is_no_observation_says_what_to_return_and_the_robot_is_stopped(of):
    plant = Returning(of)
    with pytest.raises(DataError, match="must return an Observation, or its 7 numbers in this order: time, tilt, "):
        drive(plant)
    assert plant.stops == 1
