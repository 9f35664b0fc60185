"""Refuses a sweep one of whose values is out of its range, before its first job."""

from collections.abc import Sequence

from hydra.core.override_parser.types import Glob, Override
from hydra.errors import HydraException
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from twbal.cli.commands import compose_stage, parsed
from twbal.cli.settings.lookup import Table
from twbal.cli.settings.validate import check


def check_swept_values(stage: str, words: Sequence[str]) -> None:
    """Hold each value that a sweep lists for a setting against the table. To be called within the sweep.

    What else can be wrong with a job, such as two settings that do not go together, is said when it begins.

    Args:
        stage: its name on the command line.
        words: overrides of the sweep, as on the command line.

    Raises:
        ConfigError: of the first value that is out of its range or of the wrong kind.
    """
    read = {word: parsed(word) for word in words}
    lists = [each for each in read.values() if each and _lists_values(each)]
    if not lists:
        return
    fixed = [word for word, each in read.items() if each is None or not each.is_sweep_override()]
    first = [*fixed, *(_words_of(each)[0] for each in lists)]
    try:
        cfg = compose_stage(stage, first)
        for each in lists:
            _check(stage, cfg, each)
    except (HydraException, OmegaConfBaseException):
        return  # the jobs say what is wrong


def _check(stage: str, cfg: DictConfig, swept: Override) -> None:
    """Check the values that one override lists, in a copy of the first job's configuration."""
    key, own = swept.key_or_group, OmegaConf.create(cfg)
    table = Table(stage, OmegaConf.to_container(cfg, resolve=True))  # type: ignore[arg-type]
    row = table.row(key)
    if row is None:
        return
    for word in _words_of(swept):
        value = parsed(word)
        if value is None:
            continue
        OmegaConf.update(own, key, value.value(), merge=True, force_add=True)
        found = OmegaConf.select(own, key)
        plain = OmegaConf.to_container(found, resolve=True) if OmegaConf.is_config(found) else found
        if not row.kind.takes(plain):
            check(stage, OmegaConf.to_container(own, resolve=True))  # type: ignore[arg-type]


def _lists_values(override: Override) -> bool:
    """Whether it lists values of a setting, which an interval does not, and a pattern of names does of choices."""
    return override.is_discrete_sweep() and not isinstance(override.value(), Glob)


def _words_of(swept: Override) -> list[str]:
    """One override for each of the values, in order."""
    return [f"{swept.get_key_element()}={value}" for value in swept.sweep_string_iterator()]
