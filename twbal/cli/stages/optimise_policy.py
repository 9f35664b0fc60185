"""Search the policy that the model expects to do best."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.cli.artefacts import episode_files, load_model
from twbal.cli.console import closing, next_command, run_folder
from twbal.cli.manifest import Manifest, Step, perform
from twbal.cli.prediction_file import load_prediction, prediction_of, save_prediction
from twbal.cli.typed_config import recorded, typed
from twbal.core.channels import Channels
from twbal.core.errors import ConfigError
from twbal.core.evaluation import widened
from twbal.core.files import file_hash
from twbal.io.checkpoint import save_checkpoint
from twbal.io.logs import read_episode
from twbal.models.dynamics import DynamicsModel
from twbal.policies.saved import load_regulator, load_searched_policy
from twbal.search.optimise import SearchResult, search_policy
from twbal.search.start_state import start_state
from twbal.search.task import SearchSettings, Task
from twbal.search.warm import is_compiled

NOT_RECORDED = ("dynamics", "earlier", "confirming", "base", "workers")
POLICY, PREDICTION = "policy.pt", "prediction.pt"


@dataclass(frozen=True)
class Settings:
    """See conf/stage/optimise_policy.yaml."""

    seed: int
    searches: bool
    workers: int


def main(cfg: DictConfig) -> float:
    """Run the stage in Hydra's run folder.

    Returns:
        The expected long-term cost of the best policy; for a sweeper to make small.
    """
    out = run_folder()
    closing(run(cfg, out), out, next_command("real-rollout", {"policy.path": out / POLICY}, "robot", "state"))
    return load_prediction(out / PREDICTION).best.cost


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Search on the model that `cfg` names into `out`/policy.pt and prediction.pt, unless they are there already."""
    settings = typed(Settings, cfg)
    dynamics, earlier = _paths(cfg.dynamics), _paths(cfg.earlier)
    confirming = episode_files(cfg.confirming) if cfg.confirming else []
    inputs = {"dynamics": dynamics, "earlier": earlier}
    for name, files in (("confirming", confirming), ("base", [Path(cfg.base)] if cfg.base else [])):
        inputs |= {name: files} if files else {}
    step = Step("optimise-policy", out, recorded(cfg, NOT_RECORDED), inputs, settings.seed)

    def result() -> SearchResult:
        return _confirmed(_search(cfg, dynamics, earlier, settings), confirming, earlier, instantiate(cfg.state))

    return perform(step, lambda: write_result(result(), out))


def _paths(given: str | Sequence[str]) -> list[Path]:
    return [Path(path) for path in ([given] if isinstance(given, str) else given)]


def write_result(result: SearchResult, out: Path) -> list[Path]:
    """Write the best policy and its prediction to `out`; returns the files."""
    save_checkpoint(out / POLICY, "policy", result.best.policy.to_payload())
    save_prediction(out / PREDICTION, prediction_of(result))
    return [out / POLICY, out / PREDICTION]


def _search(cfg: DictConfig, dynamics: Sequence[Path], earlier: Sequence[Path], settings: Settings) -> SearchResult:
    """Build what the search needs from `cfg` and search."""
    channels: Channels = instantiate(cfg.state)
    models = [load_model(path).model for path in dynamics]
    for model, path in zip(models, dynamics, strict=True):
        _check_state(model, channels, path)
    search: SearchSettings = instantiate(cfg.search)
    base = load_regulator(cfg.base, channels.names) if cfg.base else None
    if not is_compiled():
        print("  compiling the search, once for this version of twbal (about a minute)", flush=True)
    task = Task(
        models=models,
        start=start_state(instantiate(cfg.start), channels),
        cost=instantiate(cfg.cost),
        settings=search if settings.searches else replace(search, searched=0),
        judging=instantiate(cfg.judge),
        seed=settings.seed,
    )
    return search_policy(
        task=task,
        shape=instantiate(cfg.shape),
        torque_limit=float(cfg.robot.torque_limit),
        earlier=[load_searched_policy(path, channels.names) for path in earlier],
        progress=lambda line: print(f"  {line}", flush=True),
        workers=settings.workers or os.cpu_count() or 1,
        base=None if base is None else base.gain,
    )


def _confirmed(
    result: SearchResult, files: Sequence[Path], earlier: Sequence[Path], channels: Channels
) -> SearchResult:
    """The result with its prediction as wide as the episodes in `files`, of that very policy, ask for."""
    if not files:
        return result
    best = result.best
    driver = None if best.earlier is None else file_hash(earlier[best.earlier])
    episodes = [read_episode(file) for file in files]
    for file, episode in zip(files, episodes, strict=True):
        if episode.provenance.policy_hash != driver:
            raise ConfigError(
                f"{file} is to confirm the prediction of the best policy ({best.origin}), but another one drove "
                "it. Give confirming=[...] the rollouts of the one policy in earlier=[...], and searches=false."
            )
    return result._replace(predicted=widened(result.predicted, episodes, channels.measured))


def _check_state(model: DynamicsModel, channels: Channels, path: Path) -> None:
    if model.channels != channels:
        raise ConfigError(
            f"The model in {path} has the state {', '.join(model.channels.names)} of a robot with a wheel radius of "
            f"{model.channels.wheel_radius} m; here it is {', '.join(channels.names)} and {channels.wheel_radius} m. "
            "Choose the state and robot that it was made with by state=... and robot=..."
        )
