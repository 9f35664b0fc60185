"""Learn the correction g, what real episodes differ from the model f."""

from collections.abc import Sequence
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.algorithm.base_evidence import BaseEvidence
from twbal.algorithm.model_file import SavedModel, load_model, save_model
from twbal.cli.artefacts import EVIDENCE, MODEL, episode_files, episodes_of, hashes, say_duplicates
from twbal.cli.console import next_command, print_result, run_folder, say
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.model_state import check_state
from twbal.cli.typed_config import recorded
from twbal.core.channels import Channels
from twbal.core.episode import Episode
from twbal.core.files import file_hash
from twbal.core.json_records import write_record
from twbal.models.bases import learn_on_likeliest
from twbal.models.dynamics import without_simulation
from twbal.models.recipe import ModelRecipe

NOT_RECORDED = ("episodes", "dynamics", "model.fit_f", "model.keep_f_variance")


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    print_result(run(cfg, out), out, next_command("optimise-policy", {"dynamics": out / MODEL}, "robot", "state"))


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Learn g from the models and the episodes that `cfg` names into `out`/model.pt, unless it is there already."""
    seed, bases, files = int(cfg.seed), _bases(cfg.dynamics), episode_files(cfg.episodes)
    recipe, channels = instantiate(cfg.model), instantiate(cfg.state)
    inputs = {"dynamics": [base for base in bases if base is not None], "episodes": files}
    if len(bases) > 1 and None in bases:
        inputs["no dynamics"] = []
    step = StageWork("fit-diff-gp", out, recorded(cfg, NOT_RECORDED), inputs, seed)

    robot = str(cfg.robot.name)

    def learn() -> list[Path]:
        say_duplicates(files)
        before, episodes = [_read(base, channels) for base in bases], episodes_of(files, robot)
        if simulated := sum(episode.provenance.source == "simulation" for episode in episodes):
            say(
                f"WARNING: {simulated} of {len(episodes)} episodes are of a simulation. g is to be learned from those "
                "of a robot; learn f from simulated ones by fit-sim-gp"
            )
        if len(bases) > 1:
            return fit_likeliest_to_files(bases, before, episodes, files, recipe, seed, out)
        learned = recipe.learn_difference(before[0].model, episodes, seed)  # without a simulation the whole dynamics
        save_model(out / MODEL, SavedModel(learned.model, {**before[0].episodes, "robot": hashes(files)}))
        return [out / MODEL]

    return perform(step, learn)


def _bases(given: str | Sequence[str | None] | None) -> list[Path | None]:
    """Candidates for f, that without a simulation last."""
    several = [given] if given is None or isinstance(given, str) else list(given)
    paths: list[Path | None] = [Path(path) for path in several if path is not None]
    return [*paths, None] if len(paths) < len(several) else paths


def _read(base: Path | None, channels: Channels) -> SavedModel:
    """A candidate for f; None is that without a simulation.

    Raises:
        CheckpointError: it cannot be read.
        ConfigError: it has another state than `channels`.
    """
    if base is None:
        return SavedModel(without_simulation(channels), {})
    saved = load_model(base)
    check_state(saved.model, channels, base)
    return saved


def fit_likeliest_to_files(
    bases: Sequence[Path | None],
    before: Sequence[SavedModel],
    episodes: Sequence[Episode],
    files: Sequence[Path],
    recipe: ModelRecipe,
    seed: int,
    out: Path,
) -> list[Path]:
    """Learn g from the episodes in `files` on the likeliest of several bases; see `learn_on_likeliest`.

    Writes the model and the evidence to `out`; returns the files.
    """
    learned = learn_on_likeliest(recipe, [saved.model for saved in before], episodes, seed)
    channels = before[0].model.channels
    evidence = BaseEvidence(
        channels=tuple(channels.names[i] for i in channels.measured),
        dynamics=tuple(None if base is None else file_hash(base) for base in bases),
        log_evidences=tuple(tuple(row) for row in learned.log_evidences.tolist()),
        chosen=learned.chosen,
    )
    for number, (base, total) in enumerate(zip(bases, evidence.totals, strict=True)):
        under = "without a simulation" if base is None else f"under the f of {base}"
        chosen = " (the highest: g is learned on top of it)" if number == learned.chosen else ""
        say(f"log evidence of the episodes {under}: {total:.1f}{chosen}")
    used = {**before[learned.chosen].episodes, "robot": hashes(files)}
    save_model(out / MODEL, SavedModel(learned.learned.model, used))
    write_record(out / EVIDENCE, evidence)
    return [out / MODEL, out / EVIDENCE]
