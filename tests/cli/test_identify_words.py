"""What `twbal identify` says of recordings that tell less than they seem to."""

from dataclasses import replace

import numpy as np
from falling import falls_at_once

from twbal.cli.stages.identify import doubts_of


def test_commands_beyond_the_torque_limit_are_told(paper):
    """Logs in per cent or of a stronger robot: the estimate takes what was cut for what acted."""
    usual = falls_at_once(paper, 12)
    beyond = replace(usual, commands=np.linspace(-3.0, 3.0, len(usual.commands)) * paper.torque_limit)
    for episode, expected in ((usual, 0), (beyond, 1)):
        said = [line for line in doubts_of([episode], ["log"], paper) if "are beyond the torque limit of" in line]
        assert len(said) == expected
