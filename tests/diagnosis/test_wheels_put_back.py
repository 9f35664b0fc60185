"""The simulation has no effect for the wheels' mass and inertia: what was fitted to them goes into what it has."""

import numpy as np
import pytest
from hydra.utils import instantiate
from omegaconf import OmegaConf
from synthetic_recordings import synthetic_recording

from twbal.cli.conf_folder import conf_folder
from twbal.diagnosis import name
from twbal.diagnosis.candidates import always_free
from twbal.diagnosis.data_sheet import WHEELS
from twbal.diagnosis.hypothesis import fit_hypothesis
from twbal.planar.parameters import planar_parameters
from twbal.sysid.model import Data, Model

SETTINGS = instantiate(OmegaConf.load(conf_folder() / "groups" / "diagnosis.yaml").default)


@pytest.mark.parametrize("factor", [0.6, 1.7])
def test_a_model_with_the_wheels_of_the_data_sheet_predicts_as_well(paper, factor):
    """From wheels far off, with what else is free fitted to them: the way back is long, and its end is as good."""
    data = Data([synthetic_recording(paper, {}, seed=5, periods=1500, tolerance=0.0)], 10)
    planar = planar_parameters(paper, {})
    free_parameters = always_free(SETTINGS.tolerances, planar, 1)
    start = name.with_fitted_noise(data, Model(planar, 0.0, name.first_noise(paper, data.sensed)))
    off = start.put({free.field: factor * free.mean for free in free_parameters if free.field in WHEELS})
    others = [free._replace(sd=np.inf) for free in free_parameters if free.field not in WHEELS]
    begin = fit_hypothesis(data, off, others, (), 8)
    wheels = [free for free in free_parameters if free.field in WHEELS]
    hypothesis = begin._replace(fit=begin.fit._replace(free_parameters=(*begin.fit.free_parameters, *wheels)))
    found = name._filter_result(data, hypothesis, {})
    before = data.errors(begin.fit.model, begin.fit.kalman)[0][20:]
    np.testing.assert_allclose(found.errors[0][20:].std(axis=0), before.std(axis=0), rtol=0.1)
