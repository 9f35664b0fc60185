"""Search the policy that the model expects to do best."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.algorithm.distribution_file import load_distribution
from twbal.algorithm.model_file import load_model
from twbal.algorithm.policy_search import PolicySearch, recalibrated
from twbal.algorithm.prediction import load_prediction, prediction_of, save_prediction
from twbal.cli.artefacts import POLICY, PREDICTION, episode_files, hashes, paths_in
from twbal.cli.console import print_result, run_folder, say
from twbal.cli.known_robot import distribution_file
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.model_state import check_state
from twbal.cli.recorded_period import drive_next
from twbal.cli.typed_config import members, recorded, typed
from twbal.core.errors import ConfigError
from twbal.effects.library import values_of
from twbal.io.checkpoint import save_checkpoint
from twbal.io.logs import read_episode
from twbal.policies.saved import load_regulator, load_searched_policy

NOT_RECORDED = ("dynamics", "initial_policies", "calibration_episodes", "known", "residual_on", "workers")


@dataclass(frozen=True)
class Settings:
    """See conf/optimise_policy.yaml."""

    seed: int
    optimise: bool
    with_margin: bool
    set_aside: list[int]
    workers: int


def main(cfg: DictConfig) -> float:
    """Run the stage in Hydra's run folder.

    Returns:
        The expected long-term cost of the best policy; for a sweeper to make small.
    """
    out = run_folder()
    print_result(run(cfg, out), out, drive_next(out / POLICY, cfg.robot.control_period))
    return load_prediction(out / PREDICTION).best.cost


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Search on the model that `cfg` names into `out`/policy.pt and prediction.pt, unless they are there already."""
    settings = typed(Settings, cfg)
    dynamics, earlier = paths_in(cfg.dynamics), paths_in(cfg.initial_policies)
    calibration_episodes = episode_files(cfg.calibration_episodes) if cfg.calibration_episodes else []
    if calibration_episodes and (settings.optimise or len(earlier) != 1):
        raise ConfigError(
            "calibration_episodes=[...] are rollouts of the one policy in initial_policies=[...], with optimise=false; "
            f"found {len(earlier)} of them and optimise={str(settings.optimise).lower()}."
        )
    if not (settings.optimise or earlier):
        raise ConfigError("optimise=false judges policies without a search: give initial_policies=[...].")
    known = distribution_file(cfg.known)
    inputs = {"dynamics": dynamics, "initial_policies": earlier}
    for name, files in (
        ("calibration_episodes", calibration_episodes),
        ("known", [known] if known else []),
        ("residual_on", [Path(cfg.residual_on)] if cfg.residual_on else []),
    ):
        inputs |= {name: files} if files else {}
    step = StageWork("optimise-policy", out, recorded(cfg, NOT_RECORDED), inputs, settings.seed)
    return perform(step, lambda: _search_to_files(cfg, dynamics, earlier, calibration_episodes, known, settings, out))


def policy_search(cfg: DictConfig, settings: Settings) -> PolicySearch:
    """What `cfg` says of a search."""
    return PolicySearch(
        channels=instantiate(cfg.state),
        start=instantiate(cfg.start),
        cost=instantiate(cfg.cost),
        shape=instantiate(cfg.parametrisation),
        search=instantiate(cfg.search),
        validation=instantiate(cfg.validation),
        robot=instantiate(cfg.robot),
        simulated=values_of(members(cfg.sim.effects)),
        robust=instantiate(cfg.robust) if cfg.robust else None,
        seed=settings.seed,
        workers=settings.workers,
        with_margin=settings.with_margin,
        set_aside=tuple(settings.set_aside),
    )


def _search_to_files(
    cfg: DictConfig,
    dynamics: Sequence[Path],
    earlier: Sequence[Path],
    calibration_episodes: Sequence[Path],
    known: Path | None,
    settings: Settings,
    out: Path,
) -> list[Path]:
    """Write the best policy and its prediction to `out`; returns the files."""
    search = policy_search(cfg, settings)
    names = search.channels.names
    models = [load_model(path).model for path in dynamics]
    for model, path in zip(models, dynamics, strict=True):
        check_state(model, search.channels, path)
    base = load_regulator(cfg.residual_on, names) if cfg.residual_on else None
    policies = [load_searched_policy(path, names) for path in earlier]
    search = search if settings.optimise else search.without_search()
    distribution = load_distribution(known, search.robot) if known else None
    if not calibration_episodes:
        result = search.find(models, policies, base, distribution, say)
    else:
        driven = [read_episode(file) for file in calibration_episodes]
        result = search.judge(models, policies[0], distribution, say)
        result = recalibrated(result, driven, hashes(earlier)[0], search.channels, search.cost)
    save_checkpoint(out / POLICY, "policy", result.best.policy.to_payload())
    save_prediction(out / PREDICTION, prediction_of(result))
    return [out / POLICY, out / PREDICTION]
