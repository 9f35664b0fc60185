"""Packaged configurations for Python: what a command would run with, composed outside of any command."""

import sys
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

from hydra import compose
from hydra.errors import HydraException, InstantiationException
from hydra.utils import instantiate
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from twbal.cli.composition import composing
from twbal.cli.config_check import check_configuration
from twbal.cli.hydra_errors import explained
from twbal.cli.own_choices import refuse_missing_folders, refuse_packaged_names
from twbal.cli.sheet_doubts import doubts_of
from twbal.cli.sim_files import with_files
from twbal.core.errors import TwbalError

_OF_THE_LIBRARY = ("twbal.", "contextlib")  # modules between `warn_of` and who calls the library


def composed(stage: str, overrides: Sequence[str] = ()) -> DictConfig:
    """The checked configuration of `twbal <stage> <overrides>`.

    Args:
        stage: its name on the command line.
        overrides: such as `["robot=regbot", "sim=regbot"]`.

    Raises:
        ConfigError: an override that the stage does not take, or a value that cannot be right.

    Warns:
        UserWarning: a value of the robot's sheet is hardly right.
    """
    with translating(stage), composing():
        refuse_packaged_names(overrides)
        refuse_missing_folders(overrides)
        cfg = compose(stage.replace("-", "_"), with_files(overrides))
        check_configuration(cfg, stage)
    warn_of(doubts_of(cfg))
    return cfg


@contextmanager
def translating(stage: str) -> Iterator[None]:
    """Let what Hydra and OmegaConf complain of in the body come out as errors of twbal.

    Args:
        stage: on whose configuration the body works.

    Raises:
        TwbalError: in the place of theirs.
    """
    try:
        yield
    except (HydraException, OmegaConfBaseException) as error:
        raise explained(error, stage, in_python=True) from error


def warn_of(doubts: Iterable[str]) -> None:
    """Warn of what may be meant and as a rule is not."""
    for doubt in doubts:
        warnings.warn(doubt, stacklevel=1 + _calls_to_outside(sys._getframe()))


def _calls_to_outside(frame: FrameType | None) -> int:
    """How many calls there are from a frame of this library to the line that called the library."""
    calls = 0
    while frame is not None and f"{frame.f_globals.get('__name__')}".startswith(_OF_THE_LIBRARY):
        calls, frame = calls + 1, frame.f_back
    return calls


def built(cfg: DictConfig, part: str) -> object:
    """What a part of a configuration describes.

    Raises:
        TwbalError: it cannot be made, as of a robot that cannot be reached.
    """
    try:
        return instantiate(cfg[part])
    except InstantiationException as error:
        if isinstance(error.__cause__, TwbalError):
            raise error.__cause__ from None
        raise
