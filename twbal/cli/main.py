"""The command line: takes the stage off the arguments and hands the rest to Hydra.

Nothing heavy is imported before a stage is chosen, so that `twbal --help` answers at once, and Ctrl-C while libraries
load ends a command as it does later.
"""

import difflib
import gc
import io
import os
import sys
import traceback
from collections.abc import Sequence

from twbal import __version__
from twbal.cli.signals import end_at_next_interrupt, interruptible
from twbal.core.errors import TwbalError

STAGES = {
    "iterate": "learn to balance a robot, from simulation to improved policy (Algorithm 1): runs the next stages",
    "sim-collect": "drive the simulated robot, at random or by a policy, and record episodes",
    "fit-sim-gp": "learn f, a model of the simulation, from its episodes",
    "optimise-policy": "search a policy on a model",
    "real-rollout": "drive the robot on a link by a policy, and record episodes",
    "identify": "estimate parameters of a robot from its episodes, with standard deviations",
    "fit-diff-gp": "learn g, the difference between robot and f, from episodes of the robot",
    "drive": "steer the robot on a link in real time, by keys or a gamepad",
    "diagnose": "name the effect that the simulation lacks, from episodes of the robot, and add it",
    "evaluate-sim": "compare how well simulations predict logs of a robot",
    "new-robot": "ask for the values of a robot of your own, and write its sheet",
    "doctor": "check this computer before a robot is driven",
    "check-link": "check a robot on its link, wheels off the ground, before its first rollout",
    "virtual-robot": "start a simulated robot behind a virtual serial port; no hardware is needed",
    "lqr": "make a linear-quadratic regulator, of the data sheet or of episodes",
    "train-agent": "train a model-free agent in simulation, as a baseline",
    "import-log": "convert logs of any robot into episodes",
    "repair": "save the readable samples of damaged episode logs",
    "plot": "draw an episode: its channels over time, and a film of the robot",
    "export": "write episodes as CSV or Parquet",
    "export-policy": "write a policy as a C header for the robot's own processor, and check it",
    "compare": "compare runs and sweeps of iterate",
    "regress": "recompute numbers from logged data and compare them with a baseline (regression test)",
}

USAGE = """usage: twbal <stage> [key=value ...] [Hydra flags]

Learn to balance a two-wheeled robot from an imperfect simulation and very little real data.
Begin with `twbal iterate`: it learns to balance a virtual robot in a few minutes, without hardware.

stages:
{stages}

  twbal <stage> --help        what a stage does, reads and writes; examples, the next command, all settings
  twbal <stage> --cfg job     the settings alone, as it would run with them
  twbal <stage> -m key=1,2,3  a sweep: one run for each value
  twbal --version
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit code.

    0: done; 1: failed; 2: misused; 130: stopped by Ctrl-C; 141: nobody reads the output any more.

    Args:
        arguments: what follows `twbal`; None takes them from the process.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    _stand_in_for_closed_streams()
    _write_any_letter()
    try:
        with interruptible():
            code = _answer(words)
            sys.stdout.flush()
        if arguments is None:
            end_at_next_interrupt()
            gc.freeze()  # at its end Python would look through all that was loaded, for up to a second
    except BrokenPipeError:  # who read our output, such as `head`, has gone
        _drop_output()
        return 141
    except OSError as error:  # such as a disk that is full, or a file in the place of the run folder
        _trace(error)
        what, advice = "write the output", "Is there room on the disk?"
        if isinstance(error, FileNotFoundError) and error.filename is None:
            what, advice = "find the working directory", "Was it removed? Change into one that is there."
        elif error.filename is not None:
            what, advice = f"use {error.filename}", "Is a file where a folder belongs, or may you not write there?"
        print(f"twbal: error: Cannot {what}: {error.strerror or error}. {advice}", file=sys.stderr)
        _drop_output()
        return 1
    return code


def _stand_in_for_closed_streams() -> None:
    """Let the null device be what is closed of standard input, output and errors.

    The file that is opened next, such as the port of a robot, would have its number, and get what is printed there.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115, it lasts as long as the process


def _write_any_letter() -> None:
    """Let a letter that the output cannot have, such as ° in a locale without it, be written as an escape.

    Python would raise an error, in the midst of a stage.
    """
    for stream in (sys.stdout, sys.stderr):
        if not isinstance(stream, io.TextIOWrapper):
            continue
        if (stream.encoding, stream.errors) != ("utf-8", "surrogateescape"):  # which writes every path as it is
            stream.reconfigure(errors="backslashreplace")


def _answer(words: list[str]) -> int:
    """Do what the words ask for."""
    if words and words[0] in ("-sc", "--shell-completion"):
        return _complete(words)
    if not words or words[0] in ("-h", "--help", "help"):
        print(usage(), end="", file=sys.stdout if words else sys.stderr)
        return 0 if words else 2
    if words[0] in ("-V", "--version"):
        print(f"twbal {__version__}")
        return 0
    if words[0] not in STAGES:
        print(f"twbal: error: {_unknown_stage(words[0])}", file=sys.stderr)
        return 2
    return _run(words[0], words[1:])


def usage() -> str:
    """What `twbal --help` prints."""
    width = max(map(len, STAGES))
    return USAGE.format(stages="\n".join(f"  {name:{width}}  {what}" for name, what in STAGES.items()))


def _unknown_stage(word: str) -> str:
    from twbal.cli.settings import renamed

    if word.replace("_", "-") in renamed.STAGES:
        return f"no stage {word!r} any more: it is called {renamed.STAGES[word.replace('_', '-')]!r} now."
    near = difflib.get_close_matches(word.replace("_", "-"), STAGES, n=1)
    guess = f" (did you mean {near[0]!r}?)" if near else ""
    return f"no stage {word!r}{guess}. The stages are: {', '.join(STAGES)}."


def _run(stage: str, words: list[str], program: str | None = None) -> int:
    gc.disable()  # while libraries load, which makes many objects and drops few: a twentieth of a short command
    try:
        from twbal.core.threads import default_to_one_thread

        default_to_one_thread()  # before anything numeric is loaded
        from twbal.cli.launch import run_stage

        run_stage(stage, words, program or f"twbal {stage}")
    except KeyboardInterrupt:
        end_at_next_interrupt()
        print("twbal: stopped", file=sys.stderr)
        return 130
    except SystemExit as end:  # argparse and Hydra's own flags end this way
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    except TwbalError as error:
        _trace(error)
        print(f"twbal: error: {error}", file=sys.stderr)
        return 1
    finally:
        gc.enable()
    return 0


def _trace(error: Exception) -> None:
    """Print where an error came from, where that is asked for."""
    if "1" in (os.environ.get("TWBAL_DEBUG"), os.environ.get("HYDRA_FULL_ERROR")):
        traceback.print_exception(error)


def _drop_output() -> None:
    """Throw away what cannot be printed: at its end Python would try again, and complain."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complete(words: list[str]) -> int:
    """Answer the shell's completion script, which knows nothing of stages."""
    line = os.environ.get("COMP_LINE", "").split(" ")
    if not any(word.startswith("query=") for word in words):
        return _run("iterate", words, program="twbal")
    if len(line) > 2 and line[1] in STAGES:
        os.environ["COMP_LINE"] = " ".join(["twbal", *line[2:]])
        return _run(line[1], words, program="twbal")
    print(" ".join(STAGES))
    return 0


if __name__ == "__main__":
    sys.exit(main())
