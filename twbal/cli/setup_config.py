"""The set-up of a run in memory that the configuration of `iterate` describes."""

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.algorithm.settings import AlgorithmSettings, RolloutSettings
from twbal.algorithm.setup import AgentTraining, ModelFits, Setup
from twbal.cli.known_robot import known_robot
from twbal.cli.model_state import check_kernel_of
from twbal.cli.simulation_config import simulation_of
from twbal.cli.stages import optimise_policy, sim_collect
from twbal.cli.typed_config import members, section, typed
from twbal.diagnosis.inputs import DataSettings


def setup_of(cfg: DictConfig, diagnose: DictConfig) -> Setup:
    """What a run is set up with.

    Args:
        cfg: of `iterate`.
        diagnose: of `diagnose`, for what it reads of the rollouts.

    Raises:
        ConfigError: there is no such kernel, or no search on models with it.
    """
    check_kernel_of(cfg)
    collecting = typed(sim_collect.Settings, section(cfg, "sim_collect"))
    searching = typed(optimise_policy.Settings, cfg.optimise_policy)
    return Setup(
        simulation=simulation_of(cfg),
        ensemble={str(name): members(effects) for name, effects in cfg.ensemble.items()},
        at_random=instantiate(cfg.policy),
        simulated=collecting.rollout_settings,
        workers=collecting.workers,
        driving=typed(RolloutSettings, section(cfg, "real_rollout")),
        models=ModelFits(instantiate(cfg.model), int(cfg.fit_sim_gp.seed), int(cfg.fit_diff_gp.seed)),
        search=optimise_policy.policy_search(cfg, searching),
        rule=instantiate(cfg.success),
        regulator_command_width=float(cfg.lqr.command_width),
        algorithm=typed(AlgorithmSettings, cfg),
        diagnosis=instantiate(cfg.diagnosis),
        diagnosis_data=typed(DataSettings, diagnose),
        agent=AgentTraining(instantiate(cfg.agent), int(cfg.train_agent.steps), int(cfg.seed)),
        known=known_robot(cfg),
    )
