"""Learn the model f of the simulated robot."""

from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.algorithm.model_file import SavedModel, save_model
from twbal.cli.artefacts import MODEL, episode_files, episodes_of, hashes, say_duplicates
from twbal.cli.console import next_command, print_result, run_folder, say
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.typed_config import recorded
from twbal.core.channels import Channels
from twbal.models.recipe import ModelRecipe

NOT_RECORDED = ("episodes", "model.fit_g")


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    print_result(run(cfg, out), out, next_command("optimise-policy", {"dynamics": out / MODEL}, "robot", "state"))


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Learn f from the episodes that `cfg` names into `out`/model.pt, unless it is there already."""
    files = episode_files(cfg.episodes)
    recipe, channels = instantiate(cfg.model), instantiate(cfg.state)
    step = StageWork("fit-sim-gp", out, recorded(cfg, NOT_RECORDED), {"episodes": files}, int(cfg.seed))
    robot, path = str(cfg.robot.name), out / MODEL
    return perform(step, lambda: [fit_to_file(files, robot, channels, recipe, int(cfg.seed), path)])


def fit_to_file(files: list[Path], robot: str, channels: Channels, recipe: ModelRecipe, seed: int, path: Path) -> Path:
    """Learn f from logs of `robot` and write it to `path`, which is returned; see `ModelRecipe.learn_simulation`.

    Raises:
        DataError: a log is of another robot, or cannot be used.
    """
    say_duplicates(files)
    episodes = episodes_of(files, robot)
    if measured := sum(episode.provenance.source != "simulation" for episode in episodes):
        say(
            f"WARNING: {measured} of {len(episodes)} episodes are not of a simulation. f is to be learned from "
            "simulated episodes; learn from those of a robot by fit-diff-gp"
        )
    learned = recipe.learn_simulation(episodes, channels, seed)
    save_model(path, SavedModel(learned.model, {"simulation": hashes(files)}))
    return path
