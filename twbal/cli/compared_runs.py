"""The runs that `twbal compare` puts beside each other, and what of them does not compare."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from twbal.algorithm.comparison import BY_RULE, BY_RULE_TIMES, Run, run_values
from twbal.algorithm.summary import read_summary
from twbal.cli.manifest import MANIFEST, read_manifest
from twbal.cli.settings.nested_settings import flattened
from twbal.cli.sweep_results import job_folders, result_of
from twbal.cli.yaml_data import OF_A_RUN, read_yaml, yaml_of
from twbal.core.errors import ConfigError, DataError

SUMMARY = "summary.json"
STAGE = "iterate"
_OF_THE_KEY = ("robot", "seed", "link.seed")  # by which runs are paired
_TIMES = ("duration", "settle_time", "place_time")  # of the rule of success
_NAMED = 3  # jobs, and settings, that are named one by one
_JUDGED_BY = {
    "success": ("rule of success", "successes", BY_RULE),
    "cost": ("cost function", "costs", ("cost", "crps_ratio")),
    "state": ("state", "costs", ("cost", "crps_ratio")),
    "search.horizon": ("horizon", "costs and bands", ("cost", "crps_ratio", "coverage", "tilt_band")),
}
"""By a setting of a run: what it is in words, what is judged by it, and which metrics these are."""


class FoundRun(NamedTuple):
    """A run in its folder.

    Attributes:
        folder: of the run.
        run: what it came to.
        settings: its configuration by dotted key, as its yaml holds it; without any where nothing tells it.
        words: overrides of its command; none where they are not known.
    """

    folder: Path
    run: Run
    settings: Mapping[str, Any]
    words: tuple[str, ...]


class Incomparable(NamedTuple):
    """What does not compare between runs.

    Attributes:
        metrics: of `METRICS`.
        doubts: why, a sentence each.
    """

    metrics: frozenset[str]
    doubts: tuple[str, ...]


def found_runs(files: Sequence[Path]) -> list[FoundRun]:
    """The runs that have these summaries.

    Raises:
        ConfigError: the configuration of one is no yaml that can be read.
        DataError: a summary, or a manifest, cannot be read.
    """
    return [_found(file) for file in files]


def by_swept_settings(name: str, runs: Sequence[FoundRun]) -> dict[str, list[FoundRun]]:
    """One group of runs, or one for each combination of swept settings where runs share robot and seeds.

    Args:
        name: of the group.
        runs: in it.
    """
    if _are_distinct(runs):
        return {name: list(runs)}
    common = set.intersection(*(set(each.words) for each in runs))
    groups: dict[str, list[FoundRun]] = {}
    for each in runs:
        others = [word for word in each.words if word not in common and _key(word) not in _OF_THE_KEY]
        groups.setdefault(f"{name}: {' '.join(others) or 'default'}", []).append(each)
    return groups if all(map(_are_distinct, groups.values())) else {name: list(runs)}


def unpaired(groups: Mapping[str, Sequence[FoundRun]]) -> Iterator[str]:
    """Of each group that has several runs with the same robot and seeds, a sentence."""
    for name, runs in groups.items():
        if not _are_distinct(runs):
            count = len({each.run.key for each in runs})
            yield (
                f"{len(runs)} runs of {name} have {count} different robots and seeds between them: those that share "
                "them cannot be paired. Give runs of other settings as groups of their own"
            )


def incomparable(runs: Sequence[FoundRun]) -> Incomparable:
    """What was judged by other settings in some of the runs than in others."""
    metrics, doubts = set[str](), []
    for part, (what, judged, by_it) in _JUDGED_BY.items():
        differing = _differing(runs, part)
        if differing:
            metrics |= set(by_it)
            more = f" and {len(differing) - _NAMED} more" if len(differing) > _NAMED else ""
            doubts.append(
                f"the runs do not have the same {what} ({'; '.join(differing.values())}"
                f"{more}), so their {judged} do not compare: - stands in their place"
            )
        if any(f"success.{time}" in differing for time in _TIMES):
            metrics |= set(BY_RULE_TIMES)
    return Incomparable(frozenset(metrics), tuple(doubts))


def left_out(name: str, folder: Path) -> str:
    """What is said of the jobs of a sweep that have no summary; "" where all have one, or the folder is a run."""
    if not folder.is_dir() or (folder / SUMMARY).is_file():
        return ""
    jobs = [job for job in job_folders(folder) if _is_of_iterate(job)]
    without = [job for job in jobs if not any(job.rglob(SUMMARY))]
    if not without:
        return ""
    named = "; ".join(f"{job.relative_to(folder)}: {result_of(job)}" for job in without[:_NAMED])
    more = f"; and {len(without) - _NAMED} more" if len(without) > _NAMED else ""
    have, are = ("has", "is") if len(without) == 1 else ("have", "are")
    return f"{len(without)} of {len(jobs)} jobs of {name} {have} no {SUMMARY} ({named}{more}) and {are} left out"


def _found(file: Path) -> FoundRun:
    summary, tree = read_summary(file), _settings(file.parent)
    settings = dict(flattened(tree)) if isinstance(tree, dict) else {}
    key = (summary.robot, str(summary.seed), str(settings.get("link.seed")))
    return FoundRun(file.parent, Run(key, run_values(summary)), settings, _words(file.parent))


def _settings(run: Path) -> Any:
    """A run's configuration, as its yaml holds it; {} where there is none.

    A copy of a run may be without hidden files, and so without Hydra's. Then the run's manifest is asked.
    """
    try:
        return read_yaml(run / ".hydra" / "config.yaml", OF_A_RUN)
    except FileNotFoundError:
        manifest = read_manifest(run)
        return {} if manifest is None else yaml_of(manifest.settings, run / MANIFEST, OF_A_RUN)


def _words(run: Path) -> tuple[str, ...]:
    """The overrides of a run's command; none where they are not known."""
    try:
        words = read_yaml(run / ".hydra" / "overrides.yaml", OF_A_RUN)
    except FileNotFoundError:
        return ()
    return tuple(map(str, words)) if isinstance(words, list) else ()


def _differing(runs: Sequence[FoundRun], part: str) -> dict[str, str]:
    """The settings of a part that runs have unlike, with their values in words; a run without the part does not count.

    Args:
        runs: to look at.
        part: dotted key of a setting, or of a part that has several.
    """
    every = [
        found
        for each in runs
        if (found := {key: value for key, value in each.settings.items() if f"{key}.".startswith(f"{part}.")})
    ]
    keys = dict.fromkeys(key for found in every for key in found)
    values = {key: list(dict.fromkeys(json.dumps(found.get(key), sort_keys=True) for found in every)) for key in keys}
    return {key: f"{key}={' or '.join(map(_plain, found))}" for key, found in values.items() if len(found) > 1}


def _plain(value: str) -> str:
    """A value in JSON without the quotes of a text."""
    return value.strip('"')


def _is_of_iterate(job: Path) -> bool:
    """Whether a folder is one of `iterate`, as far as its manifest, or what Hydra keeps of it, tells."""
    try:
        manifest = read_manifest(job)
        if manifest is not None:
            return manifest.stage == STAGE
        kept = dict(flattened(read_yaml(job / ".hydra" / "hydra.yaml", OF_A_RUN)))
    except (DataError, ConfigError, FileNotFoundError, AttributeError):
        return True
    return bool(kept.get("hydra.job.name", STAGE) == STAGE)


def _are_distinct(runs: Sequence[FoundRun]) -> bool:
    """Whether no two runs have the same robot and seeds."""
    return max(Counter(each.run.key for each in runs).values(), default=1) == 1


def _key(word: str) -> str:
    """Of an override."""
    return word.lstrip("+~").partition("=")[0]
