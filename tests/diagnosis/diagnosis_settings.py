"""The default settings of a diagnosis, with least scores as recordings of some seconds make them, and more."""

from dataclasses import replace

from hydra.utils import instantiate
from omegaconf import OmegaConf

from twbal.cli.conf_folder import conf_folder
from twbal.diagnosis.settings import LeastScores

LEAST_SCORES = LeastScores(20.0, 6.0)
SETTINGS = replace(
    instantiate(OmegaConf.load(conf_folder() / "groups" / "diagnosis.yaml").default), least_scores=LEAST_SCORES
)
