"""Learn the correction g, what real episodes differ from the model f."""

from dataclasses import dataclass
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.algorithm.model_file import SavedModel, load_model, save_model
from twbal.cli.artefacts import MODEL, episode_files, hashes
from twbal.cli.console import next_command, print_result, run_folder
from twbal.cli.manifest import Manifest, Step, perform
from twbal.cli.typed_config import recorded, typed
from twbal.core.channels import Channels
from twbal.io.logs import read_episode
from twbal.models.recipe import ModelRecipe

NOT_RECORDED = ("episodes", "dynamics", "model.fit_f", "model.keep_f_variance")


@dataclass(frozen=True)
class Settings:
    """See conf/fit_diff_gp.yaml."""

    seed: int


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    print_result(run(cfg, out), out, next_command("optimise-policy", {"dynamics": out / MODEL}, "robot", "state"))


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Learn g from the model and the episodes that `cfg` names into `out`/model.pt, unless it is there already."""
    settings = typed(Settings, cfg)
    dynamics, files = Path(cfg.dynamics) if cfg.dynamics else None, episode_files(cfg.episodes)
    recipe, channels = instantiate(cfg.model), instantiate(cfg.state)
    inputs = {"dynamics": [dynamics] if dynamics else [], "episodes": files}
    step = Step("fit-diff-gp", out, recorded(cfg, NOT_RECORDED), inputs, settings.seed)

    def learn() -> list[Path]:
        if dynamics is None:
            return [fit_all_to_file(files, channels, recipe, settings.seed, out / MODEL)]
        return [fit_to_file(dynamics, files, recipe, settings.seed, out / MODEL)]

    return perform(step, learn)


def fit_to_file(dynamics: Path, files: list[Path], recipe: ModelRecipe, seed: int, path: Path) -> Path:
    """Learn g from logs, given the f in `dynamics`, and write f and g to `path`, which is returned.

    See `ModelRecipe.learn_difference`.
    """
    before = load_model(dynamics)
    learned = recipe.learn_difference(before.model, [read_episode(file) for file in files], seed)
    save_model(path, SavedModel(learned.model, {**before.episodes, "robot": hashes(files)}))
    return path


def fit_all_to_file(files: list[Path], channels: Channels, recipe: ModelRecipe, seed: int, path: Path) -> Path:
    """Learn the whole dynamics from logs and write it to `path`, which is returned; see `ModelRecipe.learn_all`."""
    learned = recipe.learn_all([read_episode(file) for file in files], channels, seed)
    save_model(path, SavedModel(learned.model, {"robot": hashes(files)}))
    return path
