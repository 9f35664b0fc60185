"""The stages by their commands, from simulated rollouts to a corrected model, in small."""

import re
import sys
from math import radians
from pathlib import Path

import numpy as np
import pytest
from hydra import compose

from twbal.algorithm.model_file import load_model
from twbal.algorithm.prediction import load_prediction
from twbal.cli.chain import Chain, StageCall
from twbal.cli.composition import composing
from twbal.cli.main import main
from twbal.cli.manifest import read_manifest
from twbal.io.logs import read_episodes

pytestmark = pytest.mark.usefixtures("kept_robots")

SHORT = [
    *("search.horizon=6", "search.short_horizon=4", "search.iterations=1", "search.short_iterations=1"),
    *("search.long_horizon=6", "search.long_iterations=1", "search.restarts=1", "parametrisation.basis=4"),
    *(
        "validation.robots=3",
        "validation.features=20",
        "success.duration=0.4",
        "success.settle_time=0.2",
        "success.place_time=0.2",
    ),
]
QUICK = ["model.fit_f.settings.fit.starts=1", "model.fit_g.settings.starts=1"]


@pytest.fixture(scope="module")
def chain(tmp_path_factory):
    """Run folders of one small chain."""
    folder = tmp_path_factory.mktemp("chain")
    arguments = sys.argv
    try:
        run("sim-collect", folder / "sim", "rollouts=4", "steps=12")
        run("fit-sim-gp", folder / "f", f"episodes={folder / 'sim'}", *QUICK)
        run("real-rollout", folder / "real", "policy=random", "trials=2", "steps=10", "exploration=0.05")
        run("fit-diff-gp", folder / "g", f"dynamics={folder / 'f' / 'model.pt'}", f"episodes={folder / 'real'}", *QUICK)
    finally:
        sys.argv = arguments
    return folder


def run(stage, out, *words):
    assert main([stage, f"hydra.run.dir={out}", *words]) == 0


def fails(capsys, stage, out, *words):
    """What the one line on stderr says."""
    capsys.readouterr()
    assert main([stage, f"hydra.run.dir={out}", *words]) == 1
    (line,) = [line for line in capsys.readouterr().err.splitlines() if "pybullet build time" not in line]
    return line.removeprefix("twbal: error: ")


def output_hashes(folder: Path):
    manifest = read_manifest(folder)
    assert manifest is not None
    assert manifest.complete
    return {made.path: made.sha256 for made in manifest.outputs}


def test_simulated_episodes_say_where_they_come_from(chain):
    episodes = read_episodes(chain / "sim" / "episodes")
    assert [episode.provenance.trial for episode in episodes] == [0, 1, 2, 3]
    assert {episode.provenance.source for episode in episodes} == {"simulation"}
    assert "rollouts: 4" in episodes[0].provenance.config
    assert "workers" not in episodes[0].provenance.config
    assert all(0 < len(episode) <= 12 and np.abs(episode.commands).max() <= 5.0 for episode in episodes)


def test_real_episodes_do_not_say_how_the_robot_was_reached(chain):
    episodes = read_episodes(chain / "real" / "episodes")
    assert {episode.provenance.source for episode in episodes} == {"robot"}
    assert "link" not in episodes[0].provenance.config
    assert episodes[0].provenance.policy_hash == read_episodes(chain / "sim" / "episodes")[0].provenance.policy_hash


def test_models_tell_their_episodes(chain):
    f, g = load_model(chain / "f" / "model.pt"), load_model(chain / "g" / "model.pt")
    assert f.model.g is None
    assert g.model.g is not None
    assert np.array_equal(f.model.f.weights, g.model.f.weights)
    simulated, real = (list(output_hashes(chain / stage).values()) for stage in ("sim", "real"))
    assert f.episodes == {"simulation": simulated}
    assert g.episodes == {"simulation": simulated, "robot": real}


@pytest.fixture(scope="module")
def matern(chain, tmp_path_factory):
    """Run folder of a fit with a kernel of GPyTorch."""
    folder = tmp_path_factory.mktemp("matern")
    run("fit-sim-gp", folder / "f", f"episodes={chain / 'sim'}", "model.kernel=matern52", *QUICK)
    return folder


def test_of_several_candidates_for_f_the_evidence_of_each_is_printed_and_which_is_taken(chain, tmp_path, capsys):
    capsys.readouterr()
    f = chain / "f" / "model.pt"
    run("fit-diff-gp", tmp_path, f"dynamics=[{f},null]", f"episodes={chain / 'real'}", *QUICK)
    lines = capsys.readouterr().out.splitlines()[:2]
    told = [
        re.fullmatch(rf"  log evidence of the episodes {under}: (-?\d+\.\d)( \(the highest: g is learned .+\))?", line)
        for under, line in zip((f"under the f of {re.escape(str(f))}", "without a simulation"), lines, strict=True)
    ]
    (taken,) = (float(each[1]) for each in told if each[2])
    assert taken == max(float(each[1]) for each in told)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["state=paper"], "tilt, tilt_rate, acceleration of a robot"),
        (["robot.control_period=0.021"], "a control period of 0.02 s; here it is"),
        (["robot.name=other"], "is an episode of the robot 'paper'; expected is 'other'"),
    ],
)
def test_g_is_not_learned_from_what_does_not_fit_the_settings(chain, tmp_path, capsys, words, message):
    given = [f"dynamics={chain / 'f' / 'model.pt'}", f"episodes={chain / 'real'}"]
    assert message in fails(capsys, "fit-diff-gp", tmp_path / "g", *given, *words)


def test_f_is_not_learned_from_episodes_of_another_control_period(chain, tmp_path, capsys):
    line = fails(capsys, "fit-sim-gp", tmp_path, f"episodes={chain / 'sim'}", "robot.control_period=0.021", *QUICK)
    assert "a control period of 0.02 s; expected is 0.021 s" in line


@pytest.mark.slow
def test_a_model_with_another_kernel_is_searched_by_particles(chain, matern, tmp_path):
    model = load_model(matern / "f" / "model.pt").model
    assert model.f.kernel == "matern52"
    given = [f"dynamics={matern / 'f' / 'model.pt'}", "search=particles", "search.particles=5", *SHORT]
    run("optimise-policy", tmp_path, *given)
    assert np.isfinite(load_prediction(tmp_path / "prediction.pt").best.cost)
    run("fit-diff-gp", tmp_path / "g", given[0], f"episodes={chain / 'real'}", "model.kernel=se+linear", *QUICK)
    assert load_model(tmp_path / "g" / "model.pt").model.g.kernel == "se+linear"


def test_moment_matching_refuses_another_kernel_and_says_what_to_do(matern, tmp_path, capsys):
    message = fails(capsys, "optimise-policy", tmp_path, f"dynamics={matern / 'f' / 'model.pt'}", *SHORT)
    assert "the model has matern52. Search by particles, with search=particles, or fit the model" in message


def test_iterate_refuses_a_kernel_that_it_cannot_search_before_it_simulates_anything(tmp_path, capsys):
    message = fails(capsys, "iterate", tmp_path, "model.kernel=matern52")
    assert "with search=particles" in message
    assert not list(tmp_path.glob("simulation/*"))
    assert "there is no kernel 'matern5'" in fails(capsys, "iterate", tmp_path / "typo", "model.kernel=matern5")


def test_an_unknown_kernel_is_refused_with_those_there_are(chain, tmp_path, capsys):
    message = fails(capsys, "fit-sim-gp", tmp_path, f"episodes={chain / 'sim'}", "model.kernel=matern5", *QUICK)
    assert "there is no kernel 'matern5'. Expected se, matern12, matern32, matern52, rq, linear" in message


@pytest.mark.slow
def test_a_variational_model_is_fitted_and_searched_by_moment_matching(chain, tmp_path):
    few = [f"model.fit_f.settings.{name}" for name in ("inducing=20", "steps=5", "subset=40")]
    run("fit-sim-gp", tmp_path / "f", f"episodes={chain / 'sim'}", "model=variational", *few, QUICK[0])
    assert len(load_model(tmp_path / "f" / "model.pt").model.f.centres) == 20
    run("optimise-policy", tmp_path / "p", f"dynamics={tmp_path / 'f' / 'model.pt'}", *SHORT)
    assert np.isfinite(load_prediction(tmp_path / "p" / "prediction.pt").best.cost)


def test_the_same_commands_give_the_same_bytes(chain, tmp_path):
    run("sim-collect", tmp_path / "sim", "rollouts=4", "steps=12", "workers=1")
    assert output_hashes(tmp_path / "sim") == output_hashes(chain / "sim")
    run("real-rollout", tmp_path / "real", "policy=random", "trials=2", "steps=10", "exploration=0.05")
    assert output_hashes(tmp_path / "real") == output_hashes(chain / "real")
    run("fit-sim-gp", tmp_path / "f", f"episodes={tmp_path / 'sim' / 'episodes'}", *QUICK)
    assert output_hashes(tmp_path / "f") == output_hashes(chain / "f")


def test_a_stage_ends_with_what_it_made_and_the_next_command(chain, capsys):
    run("sim-collect", chain / "sim", "rollouts=4", "steps=12")
    assert capsys.readouterr().out.splitlines() == [
        f"made  {chain / 'sim' / 'episodes'}/ (4 files)",
        f"next  twbal fit-sim-gp episodes={chain / 'sim'}",
    ]


def test_an_f_of_the_robot_itself_is_warned_of(chain, tmp_path, capsys):
    run("fit-sim-gp", tmp_path / "f", f"episodes={chain / 'real'}", *QUICK)
    assert "WARNING: 2 of 2 episodes are not of a simulation" in capsys.readouterr().out
    run("fit-sim-gp", tmp_path / "sim", f"episodes={chain / 'sim'}", *QUICK)
    assert "WARNING" not in capsys.readouterr().out


def test_the_next_command_is_for_the_same_robot_and_state(tmp_path, capsys):
    run("sim-collect", tmp_path / "sim", "rollouts=1", "steps=3", "robot=regbot", "state=paper", "robot.body_mass=2")
    assert capsys.readouterr().out.splitlines()[-1] == (
        f"next  twbal fit-sim-gp episodes={tmp_path / 'sim'} robot=regbot state=paper robot.body_mass=2"
    )


def test_only_trials_that_are_not_there_are_driven(chain, tmp_path):
    out = tmp_path / "real"
    run("real-rollout", out, "policy=random", "trials=2", "steps=10", "exploration=0.05")
    before = output_hashes(out)
    first, second = sorted((out / "episodes").iterdir())
    stamp = first.stat().st_mtime_ns
    second.unlink()
    run("real-rollout", out, "policy=random", "trials=2", "steps=10", "exploration=0.05")
    assert output_hashes(out) == before
    assert first.stat().st_mtime_ns == stamp


def test_the_simulation_says_how_often_the_robot_fell_and_when(tmp_path, capsys):
    run("sim-collect", tmp_path / "long", "policy=random", "rollouts=3", "steps=200")
    said = re.search(r"the simulated robot fell in (\d) of 3 rollouts, after (\S+) to (\S+) s", capsys.readouterr().out)
    lengths = [
        len(episode.commands) * episode.control_period
        for episode in read_episodes(tmp_path / "long" / "episodes")
        if abs(episode.observations[-1][1]) > radians(29.9)
    ]
    assert int(said[1]) == len(lengths) > 0
    assert [float(said[2]), float(said[3])] == pytest.approx([min(lengths), max(lengths)], rel=0.05)
    run("sim-collect", tmp_path / "short", "policy=random", "rollouts=2", "steps=3")
    assert "the simulated robot fell in none of 2 rollouts" in capsys.readouterr().out


def test_other_settings_do_not_touch_a_run_folder(chain, capsys):
    before = output_hashes(chain / "sim")
    assert "other settings (now new: rollouts=5)" in fails(
        capsys, "sim-collect", chain / "sim", "rollouts=5", "steps=12"
    )
    assert output_hashes(chain / "sim") == before


def test_errors_say_what_is_wrong(chain, tmp_path, capsys):
    f, sim, out = chain / "f" / "model.pt", chain / "sim", tmp_path / "out"
    assert "needs episodes=" in fails(capsys, "fit-sim-gp", out)
    assert "is not there" in fails(capsys, "fit-sim-gp", out, f"episodes={tmp_path / 'none'}")
    assert "no episode logs" in fails(capsys, "fit-sim-gp", out, f"episodes={chain / 'f'}")
    assert "expected are tilt, tilt_rate, acceleration" in fails(
        capsys, "fit-sim-gp", out, f"episodes={sim}", "state=paper"
    )
    assert "not a checkpoint" in fails(
        capsys, "fit-diff-gp", tmp_path / "g", f"dynamics={sim / 'manifest.json'}", f"episodes={sim}"
    )
    assert "holds a 'model', expected a 'policy'" in fails(capsys, "real-rollout", tmp_path / "r", f"policy.path={f}")
    assert "Cannot open the port" in fails(
        capsys, "real-rollout", tmp_path / "r2", "policy=random", "link=serial", f"link.port={tmp_path / 'none'}"
    )
    assert "rollouts=many; expected a whole number" in fails(capsys, "sim-collect", tmp_path / "s", "rollouts=many")


def test_too_few_samples_are_an_error(chain, tmp_path, capsys):
    run("sim-collect", tmp_path / "sim", "rollouts=1", "steps=3")
    assert "Too few samples" in fails(capsys, "fit-sim-gp", tmp_path / "f", f"episodes={tmp_path / 'sim'}")


@pytest.mark.parametrize("kept", [0.0, 0.3, 0.9])
def test_a_cut_log_is_an_error(chain, tmp_path, kept, capsys):
    whole = (chain / "sim" / "episodes" / "trial_000.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: int(kept * len(whole))])
    assert "cut.mcap" in fails(capsys, "fit-sim-gp", tmp_path / "f", f"episodes={tmp_path / 'cut.mcap'}")


def test_another_control_period_is_another_robot(tmp_path, capsys):
    said = fails(capsys, "real-rollout", tmp_path, "policy=random", "robot.control_period=0.01", "link.overrides=[]")
    assert "has a control period of 0.02 s" in said


def test_a_command_that_is_told_nothing_keeps_what_it_inherits(tmp_path, as_from_a_shell):
    with composing():
        cfg = compose("iterate", ["robot=regbot", "sim=regbot"])
        chain = Chain(cfg, {"robot": "regbot", "sim": "regbot"}, tmp_path, [])
        chain.run(StageCall("lqr", Path("regulator"), {}))
    assert "robot=regbot" in chain.commands[0]
