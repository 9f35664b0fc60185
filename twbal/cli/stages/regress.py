"""Regression runs on logged data: does every part of twbal still make of them what it made before?"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal import __version__
from twbal.algorithm.model_file import load_model
from twbal.cli.console import run_folder, with_progress
from twbal.cli.manifest import StageWork, perform_anew
from twbal.cli.regression.baseline import Tolerance, compare, junit, table, updated
from twbal.cli.regression.measures import (
    Measures,
    cost_measures,
    diagnosis_measures,
    effect_measures,
    fit_measures,
    log_measures,
    model_measures,
    place_measures,
    policy_measures,
    search_measures,
)
from twbal.cli.typed_config import recorded
from twbal.cli.yaml_data import read_yaml
from twbal.core.channels import Channels
from twbal.core.errors import ConfigError, DataError, RegressionError
from twbal.core.files import file_hash, write_atomically
from twbal.core.json_records import read_record, write_record
from twbal.core.robot_parameters import RobotParameters
from twbal.diagnosis.effect_candidates import candidates_for
from twbal.effects.library import library
from twbal.io.logs import read_episodes
from twbal.policies.saved import load_searched_policy
from twbal.sysid.recording import Usability, read_recordings

LOGS = ("simulated", "real", "held_out", "excited")
MODEL, POLICY = "model.pt", "policy.pt"
PLACED, PLACED_POLICY = "placed", "placed.pt"
"""Rollouts of a policy that keeps a place, and that policy; a data set may be without."""
REPORT, NOW = "junit.xml", "measures.json"


@dataclass(frozen=True)
class Baseline:
    """What `baseline.json` says.

    Attributes:
        data: sha256 of each file of the data set.
        version: of twbal that measured.
        measures: by name.
    """

    data: dict[str, str]
    version: str
    measures: Measures


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder; never skipped, as it is the code that it checks."""
    out, folder = run_folder(), Path(cfg.data)
    baseline = Path(cfg.baseline) if cfg.baseline else folder / "baseline.json"
    tolerances = _tolerances(Path(cfg.tolerances) if cfg.tolerances else folder / "tolerances.yaml")
    data = _hashes(folder)
    known = None
    if not cfg["update"]:  # a DictConfig has a method of that name
        known = _baseline_of(baseline, data, folder)
        compare(known.measures, known.measures, tolerances)  # whether one fits each of them
    measured: list[Baseline] = []

    def make() -> list[Path]:
        measured.append(Baseline(data, __version__, dict(sorted(measure(cfg, folder).items()))))
        write_record(out / NOW, measured[0])
        if known is None:
            return [out / NOW]
        write_atomically(out / REPORT, junit(compare(known.measures, measured[0].measures, tolerances)))
        return [out / NOW, out / REPORT]

    perform_anew(StageWork("regress", out, recorded(cfg, ()), {}, 0), make)
    (found,) = measured
    if known is None:
        _update(baseline, found, tolerances)
        return
    compared = compare(known.measures, found.measures, tolerances)
    print(table(compared))
    print(f"made  {out / REPORT}")
    moved = sum(each.moved for each in compared)
    if moved:
        raise RegressionError(
            f"{moved} of {len(compared)} measures moved beyond their tolerances. If that is meant: the same command "
            "with update=true, and say why in the commit."
        )
    print(f"all {len(compared)} measures are as in the baseline of version {known.version}")


def _baseline_of(path: Path, data: dict[str, str], folder: Path) -> Baseline:
    """The baseline, if it is one of this data.

    Raises:
        DataError: it is of other data, is not there or cannot be read.
    """
    known = _read(path)
    if known.data != data:
        changed = sorted(name for name in {*known.data, *data} if known.data.get(name) != data.get(name))
        raise DataError(
            f"{path} is the baseline of another data set: {', '.join(changed[:4])} differ in {folder}. Give the "
            "one that belongs to it, or measure it anew by update=true."
        )
    return known


def _update(path: Path, found: Baseline, tolerances: Sequence[Tolerance]) -> None:
    """Write the baseline; what did not move beyond its tolerance keeps its digits, which differ between machines."""
    try:
        known = _read(path)
    except DataError:  # there is none, or none that can be read
        known = Baseline({}, "", {})
    compared = compare(known.measures if known.data == found.data else {}, found.measures, tolerances)
    write_record(path, replace(found, measures=updated(compared)))
    changed = sum(each.moved for each in compared)
    print(f"made  {path}: {len(found.measures)} measures; {changed} are new, gone or moved, the others as they were")


def measure(cfg: DictConfig, folder: Path) -> Measures:
    """All measures of the data set in a folder."""
    logs = {name: read_episodes(folder / name) for name in LOGS}
    robot: RobotParameters = instantiate(cfg.robot)
    channels: Channels = instantiate(cfg.state)
    model, policy = load_model(folder / MODEL).model, load_searched_policy(folder / POLICY, channels.names)
    cost, pose, recipe = instantiate(cfg.cost), instantiate(cfg.start), instantiate(cfg.model)
    real = [*logs["real"], *logs["held_out"]]
    candidates = candidates_for(robot, tuple(library()))
    effects = {c.name: library()[c.name](**{p.name: p.start for p in c.parameters}) for c in candidates}
    limits = cfg.recordings
    usability = Usability(limits.min_length, limits.min_samples, limits.max_yaw_rate, limits.max_tilt)
    names = [f"excited {k}" for k in range(len(logs["excited"]))]
    recordings = read_recordings(logs["excited"], names, robot, usability)
    parts: Sequence[Callable[[], Measures]] = (
        *(partial(log_measures, name, episodes) for name, episodes in logs.items()),
        partial(model_measures, "model", model, logs["held_out"]),
        partial(policy_measures, policy, real),
        partial(cost_measures, cost, real),
        partial(search_measures, model, policy, cost, pose),
        partial(fit_measures, recipe, channels, logs["simulated"], logs["real"], logs["held_out"]),
        partial(effect_measures, robot, effects, float(cfg.sim.physics_step)),
        partial(diagnosis_measures, recordings, robot, candidates, instantiate(cfg.diagnosis)),
    )
    if (folder / PLACED).is_dir():
        placed = read_episodes(folder / PLACED)
        keeper = load_searched_policy(folder / PLACED_POLICY, placed[0].channels)
        parts = (
            *parts,
            partial(log_measures, PLACED, placed),
            partial(place_measures, keeper, placed, robot, instantiate(cfg.success)),
        )
    found: Measures = {}
    for part in with_progress(parts, "parts", len(parts)):
        found |= part()
    bad = [name for name, value in found.items() if isinstance(value, float) and not math.isfinite(value)]
    if bad:
        raise RegressionError(f"{bad[0]} is {found[bad[0]]}, which is no finite number ({len(bad)} such measures).")
    return found


def _hashes(folder: Path) -> dict[str, str]:
    """sha256 of the data: logs, model and policy."""
    files = [path for name in (*LOGS, PLACED) for path in sorted((folder / name).glob("*.mcap"))]
    files += [folder / MODEL, folder / POLICY, *folder.glob(PLACED_POLICY)]
    return {path.relative_to(folder).as_posix(): file_hash(path) for path in files}


def _tolerances(path: Path) -> list[Tolerance]:
    try:
        found = read_yaml(path)
        return [Tolerance(str(pattern), float(t["relative"]), float(t["absolute"])) for pattern, t in found.items()]
    except FileNotFoundError as error:
        where = f"There are no tolerances {path}" if path.parent.is_dir() else f"There is no folder {path.parent} here"
        raise ConfigError(
            f"{where}. Run it in the checkout, whose data/regression has all it needs, or give a folder like that by "
            "data=..., or a file of tolerances by tolerances=..."
        ) from error
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ConfigError(
            f"{path} does not say tolerances ({type(error).__name__}: {error}). Expected is `pattern: {{relative: ..., "
            "absolute: ...}` on each line."
        ) from error


def _read(path: Path) -> Baseline:
    try:
        return read_record(Baseline, path)
    except FileNotFoundError:
        raise DataError(f"There is no baseline {path}. Make one by update=true, with code that you trust.") from None
    except DataError as error:
        raise DataError(f"{path} is no baseline of `twbal regress` ({error})") from error
