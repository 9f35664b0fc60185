"""The search as a command: what it reads, writes and refuses."""

import re
import sys

import numpy as np
import pytest

import twbal
from twbal.algorithm.distribution_file import load_distribution
from twbal.algorithm.prediction import load_prediction
from twbal.cli.composed import composed
from twbal.cli.main import main
from twbal.cli.manifest import read_manifest
from twbal.cli.simulation_config import simulation_of
from twbal.core.errors import CheckpointError
from twbal.effects.library import values_of
from twbal.io.checkpoint import save_checkpoint
from twbal.planar.parameters import planar_parameters
from twbal.policies.saved import load_policy

CHANNELS = ("tilt", "tilt_rate", "speed", "command_1", "command_2", "position", "position_integral")
HORIZON = 8
QUICK = [
    *("search.horizon=8", "search.short_horizon=4", "search.iterations=2", "search.short_iterations=2"),
    *(
        "search.linearisation_amplitudes=[0.3]",
        "search.lqr_command_widths=[0.3]",
        "search.gain_scales=[1.0]",
        "search.restarts=1",
        "robust=none",
    ),
    *(
        "validation.robots=3",
        "validation.features=20",
        "success.duration=0.4",
        "success.settle_time=0.2",
        "success.place_time=0.2",
        "parametrisation.basis=4",
    ),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Holds a small model of the simulated robot in f/, and a first policy in p/."""
    folder = tmp_path_factory.mktemp("search")
    arguments = sys.argv
    try:
        run("sim-collect", folder / "sim", "rollouts=6", "steps=20")
        run("fit-sim-gp", folder / "f", f"episodes={folder / 'sim'}", "model.fit_f.settings.fit.starts=1")
        search(folder, "p")
    finally:
        sys.argv = arguments
    return folder


@pytest.fixture(scope="module")
def driven(folder):
    """Folder of a short rollout of the sheet's regulator on the virtual robot."""
    arguments = sys.argv
    try:
        run("lqr", folder / "lqr")
        driver = (f"policy.path={folder / 'lqr' / 'policy.pt'}", 'link.overrides=["faults=none"]')
        run("real-rollout", folder / "driven", *driver, "trials=1", "steps=40")
    finally:
        sys.argv = arguments
    return folder / "driven"


def run(stage, out, *words):
    assert main([stage, f"hydra.run.dir={out}", *words]) == 0


def search(folder, name, *words):
    run("optimise-policy", folder / name, f"dynamics={folder / 'f' / 'model.pt'}", *QUICK, *words)


def confirm(folder, name, driver):
    """Drive `driver`'s policy in simulation, and predict p's anew with that."""
    policy = f"policy.path={folder / driver / 'policy.pt'}"
    run(
        "sim-collect",
        folder / f"{name}_driven",
        "policy=saved",
        policy,
        "rollouts=2",
        f"steps={HORIZON}",
        "exploration=0",
    )
    told = [
        f"dynamics={folder / 'f' / 'model.pt'}",
        "optimise=false",
        f"initial_policies=[{folder / 'p' / 'policy.pt'}]",
    ]
    return main(
        [
            "optimise-policy",
            f"hydra.run.dir={folder / name}",
            *QUICK,
            *told,
            f"calibration_episodes=[{folder / f'{name}_driven'}]",
        ]
    )


def test_rollouts_of_the_policy_itself_calibrate_its_bands(folder):
    assert confirm(folder, "confirmed", "p") == 0
    plain, wide = (load_prediction(folder / name / "prediction.pt").states for name in ("p", "confirmed"))
    assert all(np.allclose(w.mean, p.mean) for w, p in zip(wide, plain, strict=True))
    assert all((w.sd >= 0.5 * p.sd - 1e-12).all() for w, p in zip(wide, plain, strict=True))
    assert any((w.sd != p.sd).any() for w, p in zip(wide, plain, strict=True))


@pytest.mark.parametrize("words", [["optimise=true"], ["initial_policies=[p,p]", "optimise=false"]])
def test_rollouts_that_confirm_are_of_one_policy_and_nothing_is_searched(folder, capsys, words):
    policy = str(folder / "p" / "policy.pt")
    words = [word.replace("[p,p]", f"[{policy},{policy}]") for word in words]
    given = [f"dynamics={folder / 'f' / 'model.pt'}", f"initial_policies=[{policy}]", *words]
    out = f"hydra.run.dir={folder / 'refused'}"
    assert main(["optimise-policy", out, *QUICK, *given, f"calibration_episodes=[{folder / 'sim'}]"]) == 1
    assert "are rollouts of the one policy in initial_policies" in capsys.readouterr().err


def test_rollouts_of_another_policy_do_not_confirm(folder, capsys):
    search(folder, "other", "seed=9")
    assert confirm(folder, "unconfirmed", "other") != 0
    assert "another one drove it" in capsys.readouterr().err
    assert not (folder / "unconfirmed" / "prediction.pt").exists()


ROBUST = [
    *("robust=default", "robust.robots=4", "robust.designs=1", "robust.screening=2", "robust.finalists=1"),
    *("robust.improved=1", "robust.evaluations=4", "robust.improving=2"),
]


@pytest.mark.slow
def test_what_is_known_of_the_robot_is_an_input_and_a_search_with_it_is_repeatable(folder, driven, capsys):
    """As by default, with `robust`: the second time nothing is done, elsewhere the same is made."""
    capsys.readouterr()
    run("identify", folder / "identified", f"episodes=[{driven}]")
    said = capsys.readouterr().out
    assert "moved [sd]" in said
    assert re.search(r"coulomb_friction\.torque +N·m", said)
    (record,) = read_manifest(folder / "identified").inputs["episodes"]
    assert record.path == str(driven / "episodes" / "trial_000.mcap")
    known = f"known={folder / 'identified'}"
    search(folder, "known", *ROBUST, known)
    assert re.search(
        r"  regulator of sampled robot 0 \(.+\).*: \d+% of \d+ sampled robots succeed; the learned model expects",
        capsys.readouterr().out,
    )
    (record,) = read_manifest(folder / "known").inputs["known"]
    assert record.path == str(folder / "identified" / "robot_distribution.pt")
    origins = [c.origin for c in load_prediction(folder / "known" / "prediction.pt").candidates]
    assert any(origin.startswith("regulator of sampled robot 0") for origin in origins)
    made = {path: path.stat().st_mtime_ns for path in (folder / "known").glob("*.pt")}
    capsys.readouterr()
    search(folder, "known", *ROBUST, known)
    assert {path: path.stat().st_mtime_ns for path in made} == made
    assert "the learned model expects a cost of" not in capsys.readouterr().out
    search(folder, "known_again", *ROBUST, known)
    assert output_hashes(folder / "known_again") == output_hashes(folder / "known")
    search(folder, "sheet", *ROBUST)
    assert "known" not in read_manifest(folder / "sheet").inputs
    assert output_hashes(folder / "sheet") != output_hashes(folder / "known")


def output_hashes(folder):
    return {made.path: made.sha256 for made in read_manifest(folder).outputs}


def test_the_policy_is_one_that_a_rollout_can_take(folder):
    policy = load_policy(folder / "p" / "policy.pt", CHANNELS)
    states = np.random.default_rng(0).normal(scale=3.0, size=(1000, len(CHANNELS)))
    assert policy.centres.shape == (4, len(CHANNELS))
    assert np.abs(policy.command(states)).max() <= 20.0


def test_the_prediction_begins_at_the_start_and_reaches_the_horizon(folder):
    prediction = load_prediction(folder / "p" / "prediction.pt")
    assert prediction.channels == CHANNELS
    assert len(prediction.states) == HORIZON + 1
    assert prediction.states[0].mean == pytest.approx([-0.17453, 0, 0, 0, 0, 0, 0])
    assert prediction.states[0].sd == pytest.approx([0.02, 0.05, 0.02, 0, 0, 0, 0])
    assert min(np.linalg.eigvalsh(state.covariance).min() for state in prediction.states) > -1e-12
    assert 0 < prediction.best.cost < HORIZON
    assert prediction.best == prediction.candidates[0]


def test_earlier_policies_are_judged_beside_what_is_found(folder):
    earlier = folder / "p" / "policy.pt"
    search(folder, "another", "seed=4")
    search(folder, "again", f"initial_policies=[{earlier},{folder / 'another' / 'policy.pt'}]")
    candidates = load_prediction(folder / "again" / "prediction.pt").candidates
    assert {"policy 0", "policy 1"} < {candidate.origin for candidate in candidates}
    (first,) = [candidate for candidate in candidates if candidate.origin == "policy 0"]
    assert first.cost == load_prediction(folder / "p" / "prediction.pt").best.cost
    assert [len(files) for files in read_manifest(folder / "again").inputs.values()] == [1, 2]


def test_a_policy_that_was_driven_twice_is_not_driven_again(folder):
    twice = folder / "p" / "policy.pt"
    search(folder, "stuck", f"initial_policies=[{twice},{twice}]")
    candidates = load_prediction(folder / "stuck" / "prediction.pt").candidates
    assert candidates
    assert not any(candidate.origin.startswith("policy") for candidate in candidates)


def test_equal_policies_are_searched_from_once(folder):
    earlier = folder / "p" / "policy.pt"
    search(folder, "twice", f"initial_policies=[{earlier},{earlier}]", "search.restarts=9")
    candidates = load_prediction(folder / "twice" / "prediction.pt").candidates
    found = [candidate.origin for candidate in candidates if candidate.origin.startswith("search from")]
    assert sorted(found) == [
        "search from policy 0 x 1",
        "search from random",
        "search from regulator (swing 0.3, width 0.3)",
    ]


def test_without_searching_the_best_of_the_earlier_policies_is_kept_and_predicted(folder):
    search(folder, "kept", f"initial_policies=[{folder / 'p' / 'policy.pt'}]", "optimise=false")
    kept, before = output_hashes(folder / "kept"), output_hashes(folder / "p")
    assert kept["policy.pt"] == before["policy.pt"]
    (candidate,) = load_prediction(folder / "kept" / "prediction.pt").candidates
    assert candidate.origin == "policy 0"


def test_the_same_command_gives_the_same_bytes(folder):
    search(folder, "p2")
    assert output_hashes(folder / "p2") == output_hashes(folder / "p")


def test_it_tells_what_it_does_and_what_comes_next(folder, capsys):
    search(folder, "told")
    *progress, policy, prediction, following = capsys.readouterr().out.splitlines()
    judged = (
        r"  .+: \d+% of 3 robots sampled from the learned model succeed; the learned model expects a cost of \d\.\d\d"
    )
    assert all(re.fullmatch(judged, line) for line in progress)
    assert progress
    assert (policy, prediction) == tuple(f"made  {folder / 'told' / name}.pt" for name in ("policy", "prediction"))
    assert following == f"next  twbal real-rollout policy.path={folder / 'told' / 'policy.pt'}"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["state=paper"], "Choose the state and robot that it was made with"),
        (["robot=regbot"], "of a robot with a wheel radius of 0.15 m and a control period of 0.02 s; here it is"),
        (["robot.control_period=0.021"], "a wheel radius of 0.15 m and a control period of 0.021 s. Choose the state"),
        (["optimise=false"], "optimise=false judges policies without a search: give initial_policies=[...]"),
        (["search.particles=1"], "search.particles must be 0 or at least 2"),
        (["search.degrees=[4,2]"], "search.degrees must rise"),
        (["search.degrees=[0]"], "search.degrees"),
        (["initial_policies=[none.pt]"], "Cannot read none.pt"),
        (["initial_policies=none.pt"], "Cannot read none.pt"),
    ],
)
def test_what_does_not_fit_together_is_refused(folder, tmp_path, capsys, words, message):
    capsys.readouterr()
    dynamics = f"dynamics={folder / 'f' / 'model.pt'}"
    assert main(["optimise-policy", f"hydra.run.dir={tmp_path / 'out'}", dynamics, *QUICK, *words]) == 1
    assert message in capsys.readouterr().err


VERDICT = {"origin": "search 0", "cost": 3.0, "judged_success": 1.0, "judged_cost": 0.1}
PREDICTION = {
    "channels": ["tilt"],
    "mean": np.zeros((3, 1)),
    "covariance": np.ones((3, 1, 1)),
    "best": VERDICT,
    "candidates": [VERDICT],
}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mean": np.zeros((3, 2))}, r"mean must be numbers of shape \(any, 1\)"),
        ({"mean": np.array([[0.0], [np.nan], [0.0]])}, "mean must be finite; found nan"),
        ({"covariance": np.ones((2, 1, 1))}, r"covariance must be numbers of shape \(3, 1, 1\)"),
        ({"best": 3}, "best must be values by their names; found a int"),
        ({"best": {**VERDICT, "cost": "3"}}, "cost must be a number"),
        ({"candidates": VERDICT}, "candidates must be a list"),
        ({"candidates": [None]}, "candidate must be values by their names; found a NoneType"),
        ({"channels": 3}, "channels must be a list"),
    ],
)
def test_a_prediction_that_cannot_be_one_is_refused(change, message, tmp_path):
    save_checkpoint(tmp_path / "prediction.pt", "prediction", PREDICTION)
    assert load_prediction(tmp_path / "prediction.pt").best.cost == 3.0
    save_checkpoint(tmp_path / "prediction.pt", "prediction", {**PREDICTION, **change})
    with pytest.raises(CheckpointError, match=message) as caught:
        load_prediction(tmp_path / "prediction.pt")
    assert "prediction.pt" in str(caught.value)
    save_checkpoint(tmp_path / "prediction.pt", "prediction", {"channels": ["tilt"]})
    with pytest.raises(CheckpointError, match="has no 'mean'"):
        load_prediction(tmp_path / "prediction.pt")


def test_a_policy_can_be_for_several_models(folder):
    """Twice the same model is that model once more: a given policy is predicted to cost the same."""
    model, policy = (folder / part for part in ("f/model.pt", "p/policy.pt"))
    for name, dynamics in (("one_model", f"{model}"), ("two_models", f"[{model},{model}]")):
        judged = (f"initial_policies={policy}", "search.restarts=0", f"dynamics={dynamics}")
        run("optimise-policy", folder / name, *QUICK, *judged)
    once, twice = (load_prediction(folder / name / "prediction.pt") for name in ("one_model", "two_models"))
    assert twice.best.cost == pytest.approx(once.best.cost, rel=1e-9)
    assert [record.path for record in read_manifest(folder / "two_models").inputs["dynamics"]] == [str(model)] * 2


@pytest.mark.slow
def test_a_search_for_several_models_starts_from_the_regulator_of_each(folder, capsys):
    models = ",".join([str(folder / "f" / "model.pt")] * 2)
    run("optimise-policy", folder / "searched", f"dynamics=[{models}]", *QUICK, "search.restarts=3")
    lines = capsys.readouterr().out
    assert all(f"search from regulator of model {i}" in lines for i in range(2))


@pytest.mark.parametrize(
    ("models", "complaint"),
    [
        ("[]", "dynamics=[]; expected path, not empty; or a list of 1 or more"),
        ("[{model},{policy}]", "policy.pt"),
        ("[{model},nowhere.pt]", "nowhere.pt"),
    ],
)
def test_a_list_of_models_with_something_else_in_it_is_refused(folder, capsys, models, complaint):
    told = models.format(model=folder / "f" / "model.pt", policy=folder / "p" / "policy.pt")
    assert main(["optimise-policy", f"hydra.run.dir={folder / 'refused'}", f"dynamics={told}", *QUICK]) == 1
    assert complaint in capsys.readouterr().err
    assert not (folder / "refused" / "policy.pt").exists()


@pytest.mark.slow
def test_the_identified_robot_is_a_simulation_that_stages_take(driven, tmp_path):
    made, again = tmp_path / "identified", tmp_path / "identified_again"
    for out in (made, again):
        run("identify", out, f"episodes=[{driven}]")
    assert output_hashes(again) == output_hashes(made)
    known = load_distribution(made / "robot_distribution.pt", twbal.robot("paper"))
    words = [f"sim={made / 'identified.yaml'}"]
    effects = values_of(simulation_of(composed("sim-collect", words)).effects)
    assert planar_parameters(known.robot, effects) == planar_parameters(known.robot, {})._replace(
        **dict(zip(known.fields, known.mean.tolist(), strict=True))
    )
