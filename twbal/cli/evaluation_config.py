"""The simulations that a configuration names to be evaluated."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from hydra import compose
from hydra.core.global_hydra import GlobalHydra
from hydra.utils import instantiate
from omegaconf import DictConfig, ListConfig

from twbal.algorithm.distribution_file import load_distribution
from twbal.cli.artefacts import DISTRIBUTION
from twbal.cli.composed import composed, translating
from twbal.cli.composition import composing
from twbal.cli.manifest import read_manifest
from twbal.cli.sim_files import IDENTIFIED, effects_in, is_simulation_file, simulation_file
from twbal.cli.typed_config import members, typed
from twbal.core.errors import ConfigError
from twbal.core.files import file_hash
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.evaluation_inputs import EvaluationSettings, GivenSimulation
from twbal.diagnosis.log_names import distinct_names
from twbal.diagnosis.side_findings import LOST
from twbal.effects.library import values_of
from twbal.planar.robot_distribution import TILT_FILTER

NOMINAL = "nominal"
"""Choice of the group `sim` that it has by itself, and name of the simulation that it is."""
OTHER = "sim"
"""Name of another simulation that `sim=...` chooses for the others to be compared with."""


def simulations_of(cfg: DictConfig) -> list[GivenSimulation]:
    """The simulation that `sim` chooses and those that `sims` names. To be called within a stage, or while composing.

    Raises:
        ConfigError: one is not there, is no single simulation, or two have the same name.
    """
    words, first = _words(cfg.sims), _effects(cfg.sim, "sim")
    is_nominal = first == _chosen(NOMINAL)
    found = [GivenSimulation(NOMINAL if is_nominal else OTHER, "sim", first, {})]
    for name, word in words.items():
        if is_simulation_file(word):
            found.append(_in_file(name, word, instantiate(cfg.robot)))
        else:
            found.append(GivenSimulation(name, f"sim={word}", _chosen(word), {}))
    same = [each for each in found[1:] if each.source == f"sim={NOMINAL}" and each.effects == found[0].effects]
    kept = [_with_note(each) for each in found if each not in same]  # the one that is always there may be named, too
    twice = [name for name, count in Counter(each.name for each in kept).items() if count > 1]
    if twice:
        raise ConfigError(
            f"Two simulations have the name {twice[0]!r}. Give names by sims={{first:<file>,second:<file>}}; "
            f"{found[0].name!r} is the one that sim=... chooses."
        )
    return kept


def composed_evaluation(
    overrides: Sequence[str],
) -> tuple[list[GivenSimulation], RobotParameters, EvaluationSettings]:
    """What `twbal evaluate-sim` compares with these words, how, and of which robot, for episodes that are no files.

    Raises:
        ConfigError: an override that the stage does not take, or a value or simulation that cannot be right.
    """
    cfg = composed("evaluate-sim", ["episodes=in_memory", *overrides])
    with translating("evaluate-sim"), composing():
        return simulations_of(cfg), instantiate(cfg.robot), typed(EvaluationSettings, cfg)


def simulation_files(simulations: Sequence[GivenSimulation]) -> list[Path]:
    """Files of those that came from files."""
    files = [Path(each.source) for each in simulations if is_simulation_file(each.source)]
    return [
        *files,
        *(path for file in files if file.name == IDENTIFIED and (path := file.parent / DISTRIBUTION).is_file()),
    ]


def _words(given: ListConfig | DictConfig | str | None) -> dict[str, str]:
    """Files and choices by name."""
    if given is None:
        return {}
    if isinstance(given, DictConfig):
        return {str(name): _resolved(str(word)) for name, word in given.items()}
    words = [_resolved(word) for word in ([given] if isinstance(given, str) else map(str, given))]
    if len(set(words)) < len(words):
        raise ConfigError(f"sims names {Counter(words).most_common(1)[0][0]} twice; name each simulation once.")
    names = distinct_names([Path(word) for word in words])
    return {f"sim={name}" if name == word == NOMINAL else name: word for name, word in zip(names, words, strict=True)}


def _resolved(word: str) -> str:
    """A run folder's file in its place."""
    return str(simulation_file(word)) if is_simulation_file(word) else word


def _chosen(choice: str) -> Mapping[str, Mapping[str, float]]:
    """The effects of a choice of the group `sim`."""
    choices = GlobalHydra.instance().config_loader().get_group_options("sim")
    if choice not in choices:
        raise ConfigError(
            f"There is no simulation {choice!r}. sims takes files, such as augmented.yaml of `twbal diagnose`, run "
            f"folders that have one, and choices of the group sim: {', '.join(choices)}."
        )
    return _effects(compose("evaluate_sim", [f"sim={choice}"]).sim, f"sim={choice}")


def _effects(sim: DictConfig, what: str) -> Mapping[str, Mapping[str, float]]:
    if sim.get("draws"):
        raise ConfigError(f"{what} draws another robot for each rollout; evaluate-sim needs one simulation.")
    return values_of(members(sim.effects))


def _with_note(given: GivenSimulation) -> GivenSimulation:
    """The same, with a word on what predictions do without."""
    if LOST not in given.effects:
        return given
    said = f"{given.name} loses commands at random; predictions take all of them as they were sent"
    return replace(given, note="; ".join(filter(None, (given.note, said))))


def _in_file(name: str, word: str, robot: RobotParameters) -> GivenSimulation:
    """The simulation in a file.

    One that `twbal identify` made is that of the true tilt, with which policies are learned. A robot may measure its
    tilt through a filter; what was found of that lies in the file beside it, and enters here.
    """
    path = Path(word)
    effects, beside = effects_in(path), path.parent / DISTRIBUTION
    given = GivenSimulation(name, word, effects, _found_on(path))
    if path.name != IDENTIFIED or TILT_FILTER in effects or not beside.is_file():
        return given
    values = dict(load_distribution(beside, robot).tilt_filter)
    if not values:
        return given
    note = f"{name} measures the tilt through the filter that identify found: {values['rate']:.3g} 1/s ({beside})"
    return replace(given, effects={**effects, TILT_FILTER: values}, note=note)


def _found_on(path: Path) -> dict[str, str]:
    """Paths of the logs by their sha256 that a simulation was found on, by the manifest beside it; else none."""
    made_by = read_manifest(path.parent)
    if made_by is None or not any(
        made.path == path.name and made.sha256 == file_hash(path) for made in made_by.outputs
    ):
        return {}
    return {log.sha256: log.path for log in made_by.inputs.get("episodes", ())}
