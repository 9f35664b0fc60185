"""A row of the table of settings."""

from typing import NamedTuple

from twbal.cli.settings.kinds import Kind


class Setting(NamedTuple):
    """What is known of one setting.

    Attributes:
        key: dotted, as on the command line; `*` stands for a name that is free.
        kind: which values it can have, and their unit.
        meaning: in a few words, without the unit.
        common: whether it is one of those that are changed most.
    """

    key: str
    kind: Kind
    meaning: str
    common: bool = False
