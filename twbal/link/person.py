"""The person beside a real robot."""

import sys

from twbal.core.errors import LinkError


def confirm_placed(trial: int) -> None:
    """Ask the person at the terminal to place the robot at its start, and wait for Enter.

    Args:
        trial: number of the rollout that is about to begin.

    Raises:
        LinkError: nobody is at the terminal.
    """
    try:
        if not sys.stdin.isatty():
            raise EOFError  # a pipe may say Enter before anyone stands beside the robot
        input(f"Trial {trial}: place the robot at its start, step back, and press Enter (Ctrl-C ends the run). ")
    except EOFError as error:
        print()  # the error begins a line of its own
        raise LinkError(
            "The robot has to be placed by a person, but this program has no terminal to ask at. Run it in a terminal, "
            "or set link.confirm_placed=null for a robot that places itself."
        ) from error
