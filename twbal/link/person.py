"""The person beside a real robot."""

import sys
import termios
from contextlib import suppress

from twbal.core.errors import LinkError


def confirm_placed(trial: int) -> None:
    """Ask the person at the terminal to place the robot at its start, and wait for Enter.

    Args:
        trial: number of the rollout that is about to begin.

    Raises:
        LinkError: nobody is at the terminal.
    """
    _ask(
        f"Trial {trial}: hold the robot at its start, and press Enter: it drives at once (Ctrl-C ends the run). ",
        "placed",
    )


def confirm_lifted() -> None:
    """Ask the person at the terminal to hold the robot with its wheels in the air, and wait for Enter.

    Raises:
        LinkError: nobody is at the terminal.
    """
    question = "Hold or clamp the robot still, upright, with its wheels OFF THE GROUND: they will turn. Press Enter "
    _ask(f"{question}(Ctrl-C ends it). ", "lifted")


def ask_for_motion(what: str) -> None:
    """Ask the person at the terminal to move the robot by hand once Enter is pressed, and wait for that.

    Args:
        what: is to be done, as a sentence.

    Raises:
        LinkError: nobody is at the terminal.
    """
    _ask(f"{what}. Press Enter. ", "moved")


def ask_again(found: str) -> bool:
    """Ask the person at the terminal whether a motion by hand, that came to a problem, is to be made once more.

    Args:
        found: what it came to, as a line.
    """
    _forget_what_was_typed()
    try:
        return input(f"  {found}\nEnter to do it once more, n and Enter to go on: ").strip().lower() not in ("n", "no")
    except EOFError:
        print()
        return False


def _ask(question: str, what: str) -> None:
    """Ask, and wait for Enter; `what` has to be done to the robot."""
    if sys.stdin is None or not sys.stdin.isatty():  # a pipe may say Enter before anyone stands beside the robot
        raise LinkError(
            f"The robot has to be {what} by a person, but this program has no terminal to ask at. Run it in a "
            "terminal, or set link.confirm_placed=null for a robot that places itself."
        )
    _forget_what_was_typed()
    try:
        input(question)
    except EOFError as error:
        print()  # the error begins a line of its own
        raise LinkError(
            f"The robot has to be {what} by a person, but the terminal has ended (Ctrl-D, or it was closed). Give the "
            "same command again and press Enter; or set link.confirm_placed=null for a robot that places itself."
        ) from error


def _forget_what_was_typed() -> None:
    """Discard what was typed before a question: Enter pressed in the rollout before must not arm the next one."""
    with suppress(AttributeError, OSError, ValueError, termios.error):  # no file of a terminal is behind it
        termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)
