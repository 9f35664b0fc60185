import numpy as np
import pytest
from hydra import compose
from hydra.utils import instantiate
from toy_robot import CHANNELS, RAW, SMOOTHED, episode

from twbal.cli.composition import composing
from twbal.core.episode import Episode, Provenance
from twbal.core.errors import DataError
from twbal.models.dataset import transitions
from twbal.models.dynamics import without_simulation
from twbal.models.fit import fit_gp
from twbal.models.fit_settings import FitSettings
from twbal.models.sparse import SparseSettings, fit_sparse_gp

RECIPES = pytest.mark.parametrize("recipe", [RAW, SMOOTHED], ids=["raw", "smoothed"])


@RECIPES
def test_f_plus_g_predicts_the_real_robot_far_better_than_f(recipe):
    simulated = [episode(20, k, 1.0, "simulation") for k in range(6)]
    learned = recipe.learn_simulation(simulated, CHANNELS, seed=0)
    assert learned.data.inputs.shape == (120, 4)
    after = recipe.learn_difference(learned.model, [episode(25, 10 + k, 0.6, "robot") for k in range(2)], seed=0)
    assert after.model.f is learned.model.f
    real = episode(30, 99, 0.6, "robot")
    errors = [
        np.abs(model.step_mean(real.states[:-1], real.commands) - real.states[1:])[:, 1].mean()
        for model in (learned.model, after.model)
    ]
    assert errors[1] < 0.3 * errors[0]


def test_without_smoothing_the_state_grows_by_the_noise_of_the_fit():
    learned = RAW.learn_simulation([episode(40, 0, 1.0, "simulation")], CHANNELS, seed=0)
    assert np.array_equal(learned.model.process_noise, learned.model.f.noise_variance)
    after = RAW.learn_difference(learned.model, [episode(25, 10, 0.6, "robot")], seed=0).model
    assert np.array_equal(after.process_noise, after.g.noise_variance)
    assert not after.observation_noise.any()


@RECIPES
def test_real_episodes_with_another_state_are_refused(recipe):
    learned = recipe.learn_simulation([episode(20, 0, 1.0, "simulation")], CHANNELS, seed=0)
    told = Provenance("toy", "robot")
    other = Episode(("tilt",), 0.02, np.arange(21.0).reshape(3, 7), np.zeros((3, 1)), np.zeros(2), "completed", told)
    with pytest.raises(DataError, match="channels tilt; expected are tilt, tilt_rate, command_1"):
        recipe.learn_difference(learned.model, [other], seed=0)


@pytest.mark.parametrize(
    ("choice", "fit_f", "settings"), [("exact", fit_gp, FitSettings), ("sparse", fit_sparse_gp, SparseSettings)]
)
def test_every_model_choice_composes_and_learns(choice, fit_f, settings):
    with composing():
        recipe = instantiate(compose(overrides=[f"+model={choice}"]).model)
    assert recipe.fit_f.func is fit_f
    assert isinstance(recipe.fit_f.keywords["settings"], settings)
    assert recipe.fit_g.func is fit_gp
    assert recipe.fit_g.keywords["settings"].length_scale_prior.log_sd == 0.7
    learned = recipe.learn_simulation([episode(20, 0, 1.0, "simulation")], CHANNELS, seed=0)
    assert np.isfinite(recipe.learn_difference(learned.model, [episode(9, 1, 0.6, "robot")], seed=0).log_evidence).all()


@RECIPES
def test_without_a_simulation_all_is_learned_from_the_robot(recipe):
    learned = recipe.learn_difference(
        without_simulation(CHANNELS), [episode(25, k, 0.6, "robot") for k in range(6)], seed=0
    )
    test = transitions([episode(40, 99, 0.6, "robot")], CHANNELS)
    error = np.sqrt(np.mean((learned.model.change(test.inputs) - test.targets) ** 2, axis=0))
    assert (error < 0.1 * test.targets.std(axis=0)).all()
    assert not learned.model.has_simulation
    assert not learned.model.f.mean(test.inputs).any()
