"""Everything that can go wrong, as one tree.

    TwbalError
    ├── ConfigError         a setting that cannot be right
    ├── DataError           a sample or an episode that cannot be used
    │   └── LogError        a log file that cannot be read
    ├── CheckpointError     a model or policy file that cannot be read
    ├── FitError            a model that cannot be learned from these samples
    ├── SearchError         a policy search that found nothing finite
    ├── SweepError          jobs of a sweep that failed, or that cannot be started
    ├── RegressionError     logged data of which twbal makes something else than before
    ├── CheckError          something on the computer or the robot that is not fit to drive
    └── LinkError           the robot cannot be reached, or does not answer
        ├── ProtocolError   it answers in another language
        └── LinkLostError   it fell silent in the middle of a rollout
            └── MotorsOnError   it does not confirm that its motors are off

A message says what was found, what was expected and what to try.
"""


class TwbalError(Exception):
    """Base of every error that twbal raises on purpose; the command line prints it without a traceback."""


class ConfigError(TwbalError):
    """A setting that cannot be right."""


class DataError(TwbalError):
    """A sample or an episode that cannot be used."""


class LogError(DataError):
    """A log file that cannot be read."""


class CheckpointError(TwbalError):
    """A model or policy file that cannot be read."""


class FitError(TwbalError):
    """A model that cannot be learned from these samples."""


class SearchError(TwbalError):
    """A policy search that found nothing finite."""


class SweepError(TwbalError):
    """Jobs of a sweep that failed, or that cannot be started."""


class RegressionError(TwbalError):
    """Logged data of which twbal makes something else than before."""


class CheckError(TwbalError):
    """Something on the computer or the robot that is not fit to drive."""


class LinkError(TwbalError):
    """The robot cannot be reached, or does not answer."""


class ProtocolError(LinkError):
    """The robot answers in another language, or another version of ours."""


class LinkLostError(LinkError):
    """The robot fell silent in the middle of a rollout."""


class MotorsOnError(LinkLostError):
    """The robot does not confirm that its motors are off: somebody has to switch it off by hand."""


def install_advice(extra: str) -> str:
    """The command that installs an extra of `pyproject.toml`: twbal is not on the package index.

    Args:
        extra: its name.
    """
    return f"pip install -e '.[{extra}]' (in the checkout of twbal)"


def printable(text: str) -> str:
    """`text` of others as a terminal may show it: control characters, which could move its cursor, become �."""
    return "".join(character if character.isprintable() else "\N{REPLACEMENT CHARACTER}" for character in text)
