"""The order of Algorithm 1, on a chain that only writes down what it was asked."""

from copy import deepcopy
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hydra import compose

from twbal.algorithm.iteration import Base, Basis, DiagnosisOutcome, PolicyFile
from twbal.algorithm.learning import Algorithm
from twbal.algorithm.settings import AlgorithmSettings, InitialPolicy, ModelUpdate, RolloutSettings
from twbal.algorithm.steps import FittedDifference
from twbal.cli.artefacts import MODEL, POLICY
from twbal.cli.composition import composing
from twbal.cli.manifest import Manifest
from twbal.cli.stage_steps import StageSteps
from twbal.cli.typed_config import section, typed
from twbal.core.episode import Episode, Outcome, Provenance
from twbal.core.errors import ConfigError, DataError
from twbal.core.evaluation import SuccessCriterion
from twbal.diagnosis.usability import FEW_DATA
from twbal.virtual_robot.process import KeptRobots

RULE = SuccessCriterion(tilt_limit=0.5, settled_tilt_limit=0.2, settle_step=100, steps=500, place_step=250)


class NotingChain:
    """Notes calls, each once, and does none of them."""

    def __init__(self):
        self.calls = []

    def run(self, call):
        if call not in self.calls:
            self.calls.append(call)
        return Manifest(call.stage, True, "", 0, "", {}, (), {}, "", 1.0)


class NotedSteps(StageSteps):
    """Stages that are not run, with episodes and gaps as they are asked for."""

    def __init__(self, chain, cfg, solved, samples, useless, likeliest, rocking, waits, kept, failing):
        super().__init__(chain, cfg, KeptRobots())
        self.robot_waits = waits
        self._rocking, self._kept, self._failing = rocking, kept, failing
        self._solved, self._samples, self._useless, self._likeliest = solved, samples, useless, likeliest

    def was_driven(self, place):
        return False

    def episodes(self, rollouts):
        return tuple(self._episode(str(r)) for r in rollouts)

    def _episode(self, rollout):
        rocked = 0.1 if rollout in self._rocking else 0.0
        return upright(500, rocked) if rollout in self._solved else upright(self._samples)

    def policy_file(self, policy):
        return PolicyFile(f"{policy}/policy.pt", self._kept.get(str(policy), str(policy)))

    def chosen(self, place):
        (dynamics,) = (call.overrides["dynamics"] for call in self._chain.calls if call.folder == place)
        likeliest = min(self._likeliest, len(dynamics) - 1)
        return FittedDifference(place / MODEL, likeliest, evidences(len(dynamics), likeliest))

    def diagnose(self, place, rollouts):
        if self._failing is not None:
            raise self._failing
        return super().diagnose(place, rollouts)

    def closed(self, diagnosis):
        return 0.0 if str(diagnosis) in self._useless else 0.9


def upright(periods, rocked=0.0):
    observations = np.zeros((periods + 1, 7))
    observations[:, 1] = 0.5 * rocked * np.sin(np.arange(periods + 1))
    observations[:, 0] = 0.02 * np.arange(periods + 1)
    states, source = np.zeros((periods + 1, 1)), Provenance("paper", "robot")
    return Episode(("tilt",), 0.02, observations, states, np.zeros(periods), Outcome.COMPLETED, source)


def evidences(bases, likeliest):
    """Of so many bases [nats]."""
    return tuple(-60.0 if number == likeliest else -80.0 - 5.0 * number for number in range(bases))


SOLVED_TWICE = ("iteration_1/trials", "iteration_2/trials")
"""By policy 1, before and after its model is recalibrated."""


@cache
def composed(*words):
    """The configuration of `iterate` with these words."""
    with composing():
        return compose("iterate", ["seed=5", "ensemble=none", *words])


def learn(
    solved=(),
    words=(),
    diagnosable=1,
    useless=(),
    robust="none",
    likeliest=0,
    rocking=(),
    waits=False,
    kept=None,
    failing=None,
    **changed,
):
    """The calls of a run and what it learned.

    Args:
        solved: the trials that all succeed.
        words: overrides of the configuration.
        diagnosable: rollouts that are enough for a diagnosis.
        useless: diagnoses that leave the gap as it is.
        robust: choice of the robots that a policy must hold.
        rocking: the trials in which the tilt oscillates by 0.1 rad.
        likeliest: index of the base under which real rollouts are likeliest.
        waits: whether the robot waits for its host.
        kept: the earlier policy that a search came to, by the search's folder, where it found nothing better.
        failing: the error that a diagnosis ends with.
        changed: settings.
    """
    cfg = deepcopy(composed(f"robust={robust}", *words))
    usual = {"updates": 2, "trials": 10, "stop_when_solved": False, "sim_rounds": 1, "calibration_rollouts": 0}
    usual |= {"base_by_evidence": True, "diagnose": False, "search_retries": 0, "on_lqr": False}
    usual |= {"improve": False, "oscillation_limit": None, "min_update_time": 0.0, "max_update_rollouts": 4}
    usual |= {"initial_policy": InitialPolicy.SIMULATION, "model_update": ModelUpdate.RESIDUAL}
    simulated = {"sim_round_rollouts": 3, "sim_round_exploration": 0.1}
    settings = AlgorithmSettings(
        **{
            "seed": 5,
            "calibration_steps": 70,
            "random_rollouts": 4,
            "trained_agent": None,
            **simulated,
            **usual,
            **changed,
        }
    )
    chain = NotingChain()
    steps = NotedSteps(
        chain, cfg, solved, FEW_DATA.min_samples // diagnosable, useless, likeliest, rocking, waits, kept or {}, failing
    )
    result = Algorithm(steps, settings, typed(RolloutSettings, section(cfg, "real_rollout")), RULE).run()
    return chain.calls, result


def only(calls, stage):
    return [call for call in calls if call.stage == stage]


def test_the_stages_run_in_the_order_of_the_algorithm():
    calls, _ = learn()
    simulation = ["sim-collect", "fit-sim-gp", "optimise-policy"]
    update = ["real-rollout", "fit-diff-gp", "optimise-policy", "real-rollout"]
    assert [call.stage for call in calls] == [*simulation, *simulation, "real-rollout", *update, *update]


def test_the_last_policy_from_simulation_serves_the_variants_too():
    heavy = ["+effect@ensemble.heavy.body_mass=body_mass", "ensemble.heavy.body_mass.factor=1.2"]
    calls, learning = learn(words=["ensemble=latency", *heavy])
    late, weighty = (
        call for call in only(calls, "sim-collect") if call.folder.name in ("latency_collect", "heavy_collect")
    )
    (effect,) = (key for key in late.overrides if "effects" in key)
    assert (effect, late.overrides[effect]["delay"]) == ("++sim.effects.actuation_delay", 0.04)
    assert weighty.overrides["++sim.effects.body_mass"]["factor"] == 1.2
    before, after, *later = only(calls, "optimise-policy")
    own = [Path(f"simulation/{number}_model/model.pt") for number in (0, 1)]
    assert before.overrides["dynamics"] == own[:1]
    varied = [Path(f"simulation/{name}_model/model.pt") for name in ("latency", "heavy")]
    assert after.overrides["dynamics"] == [own[1], *varied]
    assert all(len(call.overrides["dynamics"]) == 1 for call in later)
    assert {call.overrides["dynamics"] for call in only(calls, "fit-diff-gp")} == {own[1]}
    assert {late.folder, weighty.folder} < set(learning.simulated)


@pytest.mark.parametrize("name", ["0", "very-late"])
def test_a_variant_has_a_word_for_a_name(name):
    with pytest.raises(ConfigError, match="name of a robot of the ensemble must be a word"):
        learn(words=[f"+ensemble.{name}={{}}"])


def test_no_two_calls_share_a_folder():
    calls, _ = learn(updates=4, sim_rounds=3, words=["ensemble=latency"])
    folders = [call.folder for call in calls]
    assert len(set(folders)) == len(folders)
    assert not any(a in b.parents for a in folders for b in folders)


def test_what_is_known_before_serves_the_searches_in_simulation(tmp_path):
    (tmp_path / "told").mkdir()
    calls, _ = learn(robust="default", words=[f"known={tmp_path / 'told'}"])
    file, identified = tmp_path / "told" / "robot_distribution.pt", Path("identify/robot_distribution.pt")
    known = [call.overrides["known"] for call in only(calls, "optimise-policy")]
    assert known == [file, file, *(Path(f"iteration_{i}") / identified for i in (1, 2))]
    calls, _ = learn(robust="default")
    assert ["known" in call.overrides for call in only(calls, "optimise-policy")] == [False, False, True, True]


def test_the_papers_own_chain_has_one_round_in_simulation():
    calls, learning = learn(sim_rounds=0)
    assert len(only(calls, "sim-collect")) == len(only(calls, "fit-sim-gp")) == 1
    assert learning.policies[0].policy == Path("simulation/0_policy")


def test_f_learns_from_all_simulated_rollouts_and_g_from_all_real_ones():
    calls, learning = learn()
    first, second = only(calls, "fit-sim-gp")
    assert first.overrides["episodes"] == [Path("simulation/0_collect")]
    assert second.overrides["episodes"] == [Path("simulation/0_collect"), Path("simulation/1_collect")]
    rollouts = [Path("iteration_0/rollout"), Path("iteration_1/rollout")]
    assert [call.overrides["episodes"] for call in only(calls, "fit-diff-gp")] == [rollouts[:1], rollouts]
    assert {call.overrides["dynamics"] for call in only(calls, "fit-diff-gp")} == {Path("simulation/1_model/model.pt")}
    assert learning.policies[2].rollouts == tuple(rollouts)


def test_trials_teach_nothing():
    calls, learning = learn()
    taught = {folder for call in only(calls, "fit-diff-gp") for folder in call.overrides["episodes"]}
    assert not taught & {learned.trials for learned in learning.policies}


def test_trials_last_as_long_as_the_rule_says_and_are_not_disturbed():
    calls, _ = learn()
    for call in (call for call in only(calls, "real-rollout") if call.folder.name == "trials"):
        assert call.overrides["steps"] == RULE.steps
        assert call.overrides["tilt_limit"] == RULE.tilt_limit
        assert call.overrides["exploration"] == 0.0


@pytest.mark.parametrize("each", [1, 3])
def test_no_two_rollouts_of_the_robot_have_one_number(each):
    numbers = [
        number
        for call in only(learn(words=[f"real_rollout.trials={each}"], updates=6)[0], "real-rollout")
        for number in range(call.overrides["first_trial"], call.overrides["first_trial"] + call.overrides["trials"])
    ]
    assert len(set(numbers)) == len(numbers) == 7 * 10 + 6 * each


def test_a_robot_that_falls_at_once_is_driven_again_until_the_rollouts_last_long_enough():
    length = FEW_DATA.min_samples * 0.02
    for wanted, count in ((0.5 * length, 1), (1.5 * length, 2), (2.5 * length, 3), (9.0 * length, 4)):
        calls, learning = learn(updates=1, min_update_time=wanted)
        driven = [call for call in only(calls, "real-rollout") if call.folder.name != "trials"]
        assert [call.folder.name for call in driven] == ["rollout", "rollout_1", "rollout_2", "rollout_3"][:count]
        assert learning.policies[-1].rollouts == tuple(call.folder for call in driven)
        assert len({call.overrides["first_trial"] for call in driven}) == count


def test_each_rollout_is_driven_by_the_newest_policy():
    calls, learning = learn()
    for learned in learning.policies:
        place = Path(f"iteration_{learned.index}")
        drivers = {c.overrides["policy.path"] for c in only(calls, "real-rollout") if place in c.folder.parents}
        assert drivers == {learned.policy / POLICY}


def test_a_search_knows_all_earlier_policies():
    calls, learning = learn()
    files = [learned.policy / POLICY for learned in learning.policies]
    earlier = [call.overrides["initial_policies"] for call in only(calls, "optimise-policy")]
    assert earlier == [[], [Path("simulation/0_policy/policy.pt")], files[:1], files[:2]]


def test_the_seed_reaches_every_stage():
    assert {call.overrides["seed"] for call in learn()[0]} == {5}


@pytest.mark.parametrize(("asked", "policies"), [(True, 2), (False, 3)])
def test_a_solved_robot_ends_the_run_where_that_is_asked_for(asked, policies):
    _, learning = learn(solved=("iteration_1/trials",), stop_when_solved=asked)
    assert len(learning.policies) == policies


def test_a_policy_that_solves_it_is_driven_as_it_is_for_the_model_and_kept():
    calls, learning = learn(solved=SOLVED_TWICE, stop_when_solved=True, calibration_rollouts=4)
    last = learning.policies[-1]
    assert [learned.recalibrates for learned in learning.policies] == [False, False, True]
    rollout = next(call for call in calls if call.folder == last.rollouts[-1])
    assert (rollout.overrides["steps"], rollout.overrides["exploration"], rollout.overrides["trials"]) == (70, 0.0, 4)
    search = only(calls, "optimise-policy")[-1]
    assert not search.overrides["optimise"]
    assert search.overrides["initial_policies"] == [learning.policies[1].policy / POLICY]
    assert search.overrides["calibration_episodes"] == [last.rollouts[-1]]


STAYS = {"iteration_2/policy": "iteration_1/policy"}
"""The search of update 2 finds nothing better than policy 1."""


@pytest.mark.parametrize("waits", [False, True])
def test_a_policy_that_stays_is_not_driven_in_trials_again(waits):
    calls, learning = learn(updates=3, kept=STAYS, waits=waits)
    assert [learned.trials_of for learned in learning.policies] == [None, None, 1, None]
    assert [learned.trials for learned in learning.policies][1:3] == 2 * [Path("iteration_1/trials")]
    assert Path("iteration_2/trials") not in [call.folder for call in calls]
    assert Path("iteration_2/rollout") in [call.folder for call in calls]  # what it teaches is driven


def test_a_policy_that_stays_is_driven_in_trials_again_where_its_model_is_recalibrated():
    calls, learning = learn(solved=("iteration_1/trials", "iteration_3/trials"), kept=STAYS, **IMPROVING)
    assert searches(calls) == [False, True, None]
    assert [(learned.trials_of, learned.recalibrates) for learned in learning.policies] == [
        *((None, False), (None, False), (1, False), (None, True))
    ]
    assert learning.policies[-1].trials == Path("iteration_3/trials")


def test_trials_that_failed_when_the_model_was_recalibrated_stand_for_a_policy_that_stays():
    settings = {"stop_when_solved": True, "calibration_rollouts": 4, "updates": 3}
    kept = {f"iteration_{i}/policy": "iteration_1/policy" for i in (2, 3)}
    _, learning = learn(solved=("iteration_1/trials",), kept=kept, **settings)
    recalibrated, stayed = learning.policies[2:4]
    assert (recalibrated.recalibrates, stayed.trials_of) == (True, 2)


def places(calls):
    return [call.folder.as_posix() for call in calls]


@pytest.mark.parametrize(
    "settings",
    [
        {},
        {"robust": "default"},
        {"stop_when_solved": True, "solved": SOLVED_TWICE, "calibration_rollouts": 4},
        {"stop_when_solved": True, "solved": SOLVED_TWICE, "improve": True, "robust": "default", "updates": 5},
        {"stop_when_solved": True, "updates": 0},
        {"diagnose": True},
        {"model_update": ModelUpdate.LINEAR},
        {"kept": {"iteration_1/policy": "simulation/1_policy"}},
        {"kept": {"iteration_1/policy": "simulation/1_policy"}, "robust": "default", "updates": 3},
    ],
)
def test_a_robot_that_waits_for_its_host_changes_the_order_alone(settings):
    calls, learned = learn(**settings)
    waiting, as_well = learn(**settings, waits=True)
    assert sorted(places(waiting)) == sorted(places(calls))
    by_place = {call.folder: call for call in calls}
    drivers = [(call.stage, call.overrides) for call in waiting]
    assert drivers == [(by_place[call.folder].stage, by_place[call.folder].overrides) for call in waiting]
    assert as_well == learned


def test_what_is_learned_anyway_is_begun_before_the_trials_of_a_robot_that_waits():
    order = places(learn(waits=True, robust="default")[0])
    trials, model, policy = (
        order.index(f"iteration_{i}/{name}") for i, name in ((0, "trials"), (1, "model"), (1, "policy"))
    )
    assert order.index("iteration_0/rollout") < model < trials < policy


def test_trials_that_decide_whether_anything_is_learned_come_first():
    order = places(learn(waits=True, stop_when_solved=True)[0])
    assert order.index("iteration_0/trials") < order.index("iteration_0/rollout")


IMPROVING = {"stop_when_solved": True, "improve": True, "updates": 5, "calibration_rollouts": 4, "robust": "default"}


def searches(calls):
    """Of each update whether its search asks for margin; None for one that recalibrates."""
    found = [call.overrides for call in only(calls, "optimise-policy") if call.folder.parent.name != "simulation"]
    return [asked.get("with_margin", False) if asked.get("optimise", True) else None for asked in found]


def test_the_first_policy_that_solves_it_is_followed_by_one_more_update_that_asks_for_margin():
    calls, learning = learn(solved=(*SOLVED_TWICE, "iteration_3/trials"), **IMPROVING)
    assert searches(calls) == [False, True, None]
    assert only(calls, "optimise-policy")[-1].overrides["initial_policies"] == [learning.policies[2].policy / POLICY]


def test_a_run_that_was_recalibrated_when_it_had_fewer_updates_ends_as_it_did(monkeypatch):
    """Where the update with margin would have its folder lies the recalibration."""
    monkeypatch.setattr(NotedSteps, "was_driven", lambda self, place: place == Path("iteration_1/calibration"))
    calls, learning = learn(solved=(*SOLVED_TWICE, "iteration_3/trials"), **IMPROVING)
    assert searches(calls) == [False, None]
    assert [learned.recalibrates for learned in learning.policies] == [False, False, True]


def test_where_the_policy_with_margin_fails_the_one_before_is_recalibrated():
    calls, learning = learn(solved=("iteration_1/trials", "iteration_3/trials"), **IMPROVING)
    assert searches(calls) == [False, True, None]
    assert only(calls, "optimise-policy")[-1].overrides["initial_policies"] == [learning.policies[1].policy / POLICY]
    assert only(calls, "real-rollout")[-2].overrides["policy.path"] == learning.policies[1].policy / POLICY
    assert learning.policies[-1].rollouts[:-1] == learning.policies[2].rollouts


@pytest.mark.parametrize(("rocking", "kept"), [("iteration_2/trials", 1), ("iteration_1/trials", 2)])
def test_of_two_policies_that_solve_it_the_one_that_rocks_is_not_kept(rocking, kept):
    solved = (*SOLVED_TWICE, "iteration_3/trials")
    calls, learning = learn(solved=solved, rocking=(rocking,), **IMPROVING, oscillation_limit=0.08)
    search = only(calls, "optimise-policy")[-1]
    assert search.overrides["initial_policies"] == [learning.policies[kept].policy / POLICY]


@pytest.mark.parametrize(
    ("solved", "rocking", "asked", "aside"),
    [
        ([0, 1, 2], [], [True, None], [[]]),
        ([1, 2, 3], [], [False, True, None], [[0]]),  # policy 0 falls
        ([1, 2, 3], [1], [False, True, None], [[0, 1]]),
        ([1, 2, 3, 4], [1, 2], [False, True, True, None], [[0, 1], [0, 1, 2]]),
        ([1, 3, 4], [1], [False, True, True, None], [[0, 1], [0, 1, 2]]),  # policy 2 falls
        ([1, 2, 3, 4], [1, 2, 3], [False, True, True, None], [[0, 1], [0, 1, 2]]),  # twice is enough
    ],
)
def test_a_policy_under_which_the_robot_falls_or_its_tilt_oscillates_is_set_aside_and_improved_on_twice_at_most(
    solved, rocking, asked, aside
):
    trials, rocks = ([f"iteration_{number}/trials" for number in numbers] for numbers in (solved, rocking))
    calls, _ = learn(solved=trials, rocking=rocks, **IMPROVING, oscillation_limit=0.08)
    assert searches(calls) == asked
    margins = [c.overrides for c in only(calls, "optimise-policy") if c.overrides.get("with_margin")]
    assert [each.get("set_aside", []) for each in margins] == aside


@pytest.mark.parametrize(
    "changed",
    [{"improve": False}, {"robust": "none"}, {"updates": 1}, {"stop_when_solved": False, "updates": 2}],
)
def test_no_update_asks_for_margin_where_none_is_wanted_possible_or_left(changed):
    calls, _ = learn(solved=SOLVED_TWICE, **{**IMPROVING, **changed})
    assert True not in searches(calls)


@pytest.mark.parametrize(("updates", "recalibrates"), [(1, [0, 0, 1]), (2, [0, 0, 1, 0]), (3, [0, 0, 1, 0, 0])])
def test_a_policy_that_fails_when_it_is_tried_again_was_no_solution(updates, recalibrates):
    calls, learning = learn(
        solved=("iteration_1/trials",), stop_when_solved=True, calibration_rollouts=4, updates=updates
    )
    assert [learned.recalibrates for learned in learning.policies] == recalibrates
    driven = [
        call.overrides["first_trial"] + i
        for call in only(calls, "real-rollout")
        if call.folder.name != "trials"
        for i in range(call.overrides["trials"])
    ]
    assert len(set(driven)) == len(driven)


def test_a_policy_that_solves_nothing_is_not_confirmed():
    _, learning = learn(stop_when_solved=True, calibration_rollouts=4)
    assert not any(learned.recalibrates for learned in learning.policies)


def test_without_trials_nothing_but_the_rollouts_is_driven():
    calls, learning = learn(trials=0)
    assert [call.folder.name for call in only(calls, "real-rollout")] == ["rollout", "rollout"]
    assert all(learned.trials is None for learned in learning.policies)


def test_a_diagnosis_mends_the_simulation_before_g_is_learned():
    calls, learning = learn(diagnose=True)
    update = ["diagnose", "sim-collect", "sim-collect", "fit-sim-gp", "fit-diff-gp", "optimise-policy", "real-rollout"]
    assert [call.stage for call in calls[7:15]] == ["real-rollout", *update]
    mended = [call for call in only(calls, "sim-collect") if "sim" in call.overrides]
    assert {call.overrides["sim"] for call in mended[:2]} == {Path("iteration_1/diagnosis/augmented.yaml")}
    assert [call.overrides["dynamics"] for call in only(calls, "fit-diff-gp")] == [
        Path("iteration_1/sim_model/model.pt"),
        Path("iteration_2/sim_model/model.pt"),
    ]
    assert only(calls, "diagnose")[1].overrides["episodes"] == list(learning.policies[2].rollouts)


def test_every_policy_that_drove_the_robot_drives_the_mended_simulation():
    calls, learning = learn(diagnose=True)
    for number, fit in enumerate(only(calls, "fit-sim-gp")[2:], start=1):
        driven = [
            call for call in calls if call.folder in fit.overrides["episodes"] and "policy.path" in call.overrides
        ]
        assert [call.overrides["policy.path"] for call in driven] == [
            p.policy / POLICY for p in learning.policies[:number]
        ]
        assert len({call.overrides["first_trial"] for call in driven}) == number


def test_a_policy_that_balances_in_the_mended_simulation_drives_the_robot():
    calls, learning = learn(diagnose=True, updates=1, search_retries=2, solved=("iteration_1/sim_validation",))
    (validation,) = (call for call in only(calls, "sim-collect") if call.folder.name == "sim_validation")
    assert validation.overrides["sim"] == Path("iteration_1/diagnosis/augmented.yaml")
    assert (
        validation.overrides["policy.path"]
        == learning.policies[1].policy / POLICY
        == Path("iteration_1/policy/policy.pt")
    )
    given = [validation.overrides[name] for name in ("steps", "tilt_limit", "exploration")]
    assert given == [RULE.steps, RULE.tilt_limit, 0.0]
    assert calls.index(validation) < next(i for i, c in enumerate(calls) if c.folder == Path("iteration_1/trials"))


def test_a_policy_that_falls_in_the_mended_simulation_drives_that_and_is_searched_anew():
    calls, learning = learn(diagnose=True, updates=1, search_retries=2, solved=("iteration_1/again_1/sim_validation",))
    first, second = Path("iteration_1/policy/policy.pt"), Path("iteration_1/again_1/policy/policy.pt")
    assert learning.policies[1].policy / POLICY == second
    assert learning.policies[1].f == Path("iteration_1/again_1/sim_model/model.pt")
    assert (learning.policies[1].fit_s, learning.policies[1].search_s, learning.policies[1].searches) == (4.0, 2.0, 2)
    before, after = only(calls, "fit-sim-gp")[2:]
    (more,) = set(after.overrides["episodes"]) - set(before.overrides["episodes"])
    assert next(call for call in calls if call.folder == more).overrides["policy.path"] == first
    assert first not in {call.overrides["policy.path"] for call in only(calls, "real-rollout")}
    *_, search = only(calls, "optimise-policy")
    assert search.overrides["dynamics"] == [Path("iteration_1/again_1/model/model.pt")]
    assert search.overrides["initial_policies"] == [learning.policies[0].policy / POLICY]


@pytest.mark.parametrize("search_retries", [0, 1, 3])
def test_a_policy_that_falls_in_each_rehearsal_drives_the_robot_in_the_end(search_retries):
    calls, learning = learn(diagnose=True, updates=1, search_retries=search_retries)
    assert len([call for call in only(calls, "sim-collect") if call.folder.name == "sim_validation"]) == search_retries
    assert learning.policies[1].searches == search_retries + 1
    assert only(calls, "real-rollout")[-1].overrides["policy.path"] == learning.policies[1].policy / POLICY


def test_no_two_calls_share_a_folder_with_rehearsals_either():
    folders = [call.folder for call in learn(diagnose=True, search_retries=3)[0]]
    assert len(set(folders)) == len(folders)
    assert not any(a in b.parents for a in folders for b in folders)


def test_rollouts_too_short_to_diagnose_teach_g_alone():
    calls, _ = learn(diagnose=True, diagnosable=2)
    assert [call.folder for call in only(calls, "diagnose")] == [Path("iteration_2/diagnosis")]
    first = only(calls, "fit-diff-gp")[0]
    assert first.overrides["dynamics"] == Path("simulation/1_model/model.pt")


def test_a_diagnosis_that_leaves_the_gap_changes_nothing():
    calls, _ = learn(diagnose=True, useless=("iteration_1/diagnosis",))
    assert [call.overrides["dynamics"] for call in only(calls, "fit-diff-gp")] == [
        Path("simulation/1_model/model.pt"),
        Path("iteration_2/sim_model/model.pt"),
    ]


@pytest.mark.parametrize(
    "error", [DataError("diverges"), FloatingPointError("overflow"), ValueError("array must not contain infs or NaNs")]
)
def test_of_rollouts_that_a_diagnosis_fails_on_g_is_learned_alone(error, capsys):
    calls, learning = learn(diagnose=True, failing=error)
    alone, _ = learn()
    assert calls == alone
    assert learning.policies[1].diagnosis is DiagnosisOutcome.NOT_MADE
    assert f"no diagnosis: {error}" in "".join(capsys.readouterr())


def test_a_policy_that_is_only_confirmed_needs_no_diagnosis():
    calls, _ = learn(solved=SOLVED_TWICE, stop_when_solved=True, calibration_rollouts=4, diagnose=True)
    assert [call.folder for call in only(calls, "diagnose")] == [Path("iteration_1/diagnosis")]


def test_without_a_simulation_the_robot_is_driven_at_random_first_and_all_of_its_rollouts_are_learned_from():
    calls, learning = learn(initial_policy=InitialPolicy.RANDOM, model_update=ModelUpdate.FULL)
    random, *_ = only(calls, "real-rollout")
    assert (random.choices, random.overrides["trials"]) == ({"policy": "random"}, 4)
    assert not only(calls, "sim-collect") + only(calls, "fit-sim-gp")
    rollouts = [Path("random/rollout"), Path("iteration_0/rollout"), Path("iteration_1/rollout")]
    assert [call.overrides["episodes"] for call in only(calls, "fit-diff-gp")] == [rollouts[:1], rollouts[:2], rollouts]
    assert {call.overrides["dynamics"] for call in only(calls, "fit-diff-gp")} == {None}
    assert learning.policies[0].rollouts == tuple(rollouts[:1])


def test_a_regulator_is_identified_from_all_rollouts_and_nothing_is_searched():
    calls, learning = learn(initial_policy=InitialPolicy.LQR, model_update=ModelUpdate.LINEAR, calibration_rollouts=2)
    rollouts = [Path("iteration_0/rollout"), Path("iteration_1/rollout")]
    assert [call.overrides["episodes"] for call in only(calls, "lqr")] == [[], rollouts[:1], rollouts]
    assert {call.stage for call in calls} == {"lqr", "real-rollout"}
    assert not any(learned.predicted for learned in learning.policies)


def test_a_network_on_a_regulator_is_searched_on_the_same_one_each_time():
    calls, _ = learn(on_lqr=True)
    assert {call.folder for call in only(calls, "lqr")} == {Path("regulator")}
    assert {call.overrides["residual_on"] for call in only(calls, "optimise-policy")} == {Path("regulator/policy.pt")}


def test_an_agent_is_trained_once_or_was_before(tmp_path):
    calls, learning = learn(initial_policy=InitialPolicy.AGENT, updates=0)
    assert [call.stage for call in calls] == ["train-agent", "real-rollout"]
    (tmp_path / POLICY).touch()
    for given in (tmp_path, tmp_path / POLICY):
        calls, learning = learn(initial_policy=InitialPolicy.AGENT, updates=0, trained_agent=str(given))
        assert [call.stage for call in calls] == ["real-rollout"]
        assert learning.policies[0].policy / POLICY == tmp_path / "policy.pt"


def test_with_robots_of_the_parameter_distribution_the_identified_simulation_and_none_are_further_bases_of_g():
    calls, learning = learn(robust="default")
    update = ["real-rollout", "identify", "sim-collect", "sim-collect", "fit-sim-gp", "fit-diff-gp", "optimise-policy"]
    assert [call.stage for call in calls[7:14]] == update
    simulated = [*["sim-collect"] * 3, "fit-sim-gp"]
    second = ["real-rollout", "identify", "diagnose", *simulated, *simulated, "fit-diff-gp", "optimise-policy"]
    assert [call.stage for call in calls[15:28]] == second
    for number, (identify, fit, search) in enumerate(
        zip(only(calls, "identify"), only(calls, "fit-diff-gp"), only(calls, "optimise-policy")[2:], strict=True), 1
    ):
        place = Path(f"iteration_{number}")
        assert identify.folder == place / "identify"
        assert identify.overrides["episodes"] == fit.overrides["episodes"] == list(learning.policies[number].rollouts)
        diagnosed = [place / "diagnosed_model" / "model.pt"] if number == 2 else []
        bases = [Path("simulation/1_model/model.pt"), place / "identified_model" / "model.pt", *diagnosed, None]
        assert fit.overrides["dynamics"] == bases
        assert search.overrides["known"] == place / "identify" / "robot_distribution.pt"
        assert search.overrides["dynamics"] == [place / "model" / "model.pt"]


def test_the_identified_simulation_is_driven_at_random_and_by_every_policy_that_drove_the_robot():
    calls, learning = learn(
        robust="default",
        solved=("iteration_2/trials", "iteration_3/trials"),
        stop_when_solved=True,
        calibration_rollouts=4,
    )
    fits = [call for call in only(calls, "fit-sim-gp") if call.folder.name == "identified_model"]
    assert [learned.recalibrates for learned in learning.policies] == [False, False, False, True]
    for number, fit in enumerate(fits, start=1):
        simulated = [call for call in calls if call.folder in fit.overrides["episodes"]]
        file = Path(f"iteration_{number}/identify/identified.yaml")
        assert {call.overrides["sim"] for call in simulated} == {file}
        drivers = [call.overrides.get("policy.path") for call in simulated]
        explores = [call.overrides["exploration"] > 0.0 for call in simulated[1:]]
        kinds = [True, False] if number == 3 else [True]  # what calibrates a model adds undisturbed rollouts
        expected = [(p.policy / POLICY, kind) for p in learning.policies[:number] for kind in kinds]
        assert drivers[0] is None
        assert list(zip(drivers[1:], explores, strict=True)) == expected
        assert len({call.overrides["first_trial"] for call in simulated[1:]}) == len(expected)
    *_, last = only(calls, "optimise-policy")
    assert last.overrides["known"] == Path("iteration_3/identify/robot_distribution.pt")
    assert last.overrides["initial_policies"] == [learning.policies[2].policy / POLICY]


@pytest.mark.parametrize(
    ("likeliest", "base", "gain"), [(0, Base.GIVEN, 25.0), (1, Base.IDENTIFIED, 20.0), (2, Base.NONE, 20.0)]
)
def test_what_was_learned_says_which_base_it_has_and_by_how_much(likeliest, base, gain):
    _, learning = learn(robust="default", likeliest=likeliest, updates=1)
    first, second = learning.policies
    assert (first.base, first.evidence_gain) == (Base.GIVEN, None)
    assert (second.base, second.evidence_gain) == (base, gain)
    assert tuple(second.log_evidences.values()) == evidences(3, likeliest)
    assert second.basis is (Basis.ROBOT if base is Base.NONE else Basis.CORRECTED)
    assert second.f == first.f == Path("simulation/1_model/model.pt")


def diagnosed_at(calls):
    """Numbers of the updates with a diagnosis."""
    return [int(call.folder.parent.name.removeprefix("iteration_")) for call in only(calls, "diagnose")]


def test_after_an_update_that_failed_what_a_diagnosis_finds_is_one_more_base():
    calls, learning = learn(robust="default", updates=3, likeliest=2, solved=("iteration_2/trials",), improve=True)
    assert diagnosed_at(calls) == [2]  # policy 1 failed, and policy 2 did not
    place, rollouts = Path("iteration_2"), learning.policies[2].rollouts
    assert only(calls, "diagnose")[0].overrides["episodes"] == list(rollouts)
    (fit,) = (call for call in calls if call.folder == place / "diagnosed_model")
    simulated = [call for call in calls if call.folder in fit.overrides["episodes"]]
    assert {call.overrides["sim"] for call in simulated} == {place / "diagnosis" / "augmented.yaml"}
    drivers = [None, *(learned.policy / POLICY for learned in learning.policies[:2])]
    assert [call.overrides.get("policy.path") for call in simulated] == drivers
    found = learning.policies[2]
    assert (found.base, found.diagnosis) == (Base.DIAGNOSED, DiagnosisOutcome.USED)
    assert list(found.log_evidences) == [Base.GIVEN, Base.IDENTIFIED, Base.DIAGNOSED, Base.NONE]
    assert [learned.diagnosis for learned in learning.policies].count(DiagnosisOutcome.NOT_MADE) == 3


@pytest.mark.parametrize("changed", [{"useless": ("iteration_2/diagnosis",), "likeliest": 1}, {"likeliest": 3}])
def test_what_a_diagnosis_finds_is_no_base_where_rollouts_do_not_bear_it_out_or_another_is_likelier(changed):
    calls, learning = learn(robust="default", **changed)
    assert diagnosed_at(calls) == [2]
    assert (Base.DIAGNOSED in learning.policies[2].log_evidences) == ("useless" not in changed)
    assert learning.policies[2].diagnosis is DiagnosisOutcome.NOT_USED


@pytest.mark.parametrize(
    "changed",
    [
        {"robust": "none"},
        {"base_by_evidence": False},
        {"diagnosable": 3},  # too short
        {"trials": 0},  # nobody knows whether it failed
        {"updates": 1},
        {"solved": ("iteration_0/trials",), "stop_when_solved": True, "improve": True},  # policy 1, of margin, fails
        {"solved": SOLVED_TWICE, "stop_when_solved": True, "calibration_rollouts": 4},
    ],
)
def test_no_diagnosis_is_made_unless_an_update_failed_and_the_rollouts_suffice(changed):
    assert not only(learn(**{"robust": "default", **changed})[0], "diagnose")


def test_rollouts_that_a_diagnosis_cannot_use_still_teach_g(monkeypatch, capsys):
    def refuse(steps, place, rollouts):
        raise DataError("it turns too fast")

    monkeypatch.setattr(NotedSteps, "diagnose", refuse)
    _, learning = learn(robust="default")
    assert (learning.policies[2].base, learning.policies[2].diagnosis) == (Base.GIVEN, DiagnosisOutcome.NOT_MADE)
    assert "no diagnosis: it turns too fast" in capsys.readouterr().out


def test_without_a_choice_of_the_base_the_robots_are_known_all_the_same():
    calls, learning = learn(robust="default", base_by_evidence=False)
    assert {call.overrides["dynamics"] for call in only(calls, "fit-diff-gp")} == {Path("simulation/1_model/model.pt")}
    assert all("known" in call.overrides for call in only(calls, "optimise-policy")[2:])
    assert len(only(calls, "sim-collect")) == 2
    assert learning.policies[-1].evidence_gain is None


def test_without_these_robots_nothing_is_identified():
    assert not only(learn()[0], "identify")


def test_where_all_is_learned_from_the_robot_nothing_is_simulated_and_the_robots_are_known_all_the_same():
    calls, _ = learn(robust="default", initial_policy=InitialPolicy.RANDOM, model_update=ModelUpdate.FULL)
    assert len(only(calls, "identify")) == 3
    assert not only(calls, "sim-collect")
    assert {call.overrides["dynamics"] for call in only(calls, "fit-diff-gp")} == {None}


def test_no_two_calls_share_a_folder_with_identified_simulations_either():
    folders = [call.folder for call in learn(robust="default", diagnose=True, search_retries=3, updates=4)[0]]
    assert len(set(folders)) == len(folders)
    assert not any(a in b.parents for a in folders for b in folders)


def test_it_is_said_of_each_policy_how_many_of_its_trials_succeeded(capsys):
    learn(solved=("iteration_1/trials",), stop_when_solved=True)
    said = [line for line in capsys.readouterr().out.splitlines() if line.endswith("trials succeeded")]
    assert said == ["  0 of 10 trials succeeded", "  10 of 10 trials succeeded"]
