"""Follow a parameter through the code, and draw the layers of docs/architecture.md with the routes of five of them.

    python scripts/follow_parameter.py torque_limit              # every command through which it goes
    python scripts/follow_parameter.py tilt_limit sim_collect    # one of them, stop by stop
    python scripts/follow_parameter.py Channels                  # a class: all objects of it
    python scripts/follow_parameter.py diagnosis.settings        # a module: all objects of its classes
    python scripts/follow_parameter.py --draw                    # docs/pictures/architecture.svg

How it counts. A walk begins at `run` of a command (a module of cli/stages/), and goes through statements and calls in
the order in which they are evaluated, into every function of twbal that gets the value, or an object that has it. A
*stop* is a place where the value is read or passed on by name: a variable or parameter of that name, a field of that
name, or whatever it is called where it was handed over as it is (`f(torque_limit)` makes it `limit` in `def
f(limit)`). A place through which only a larger object goes untouched (a data sheet, a configuration) is no stop, nor
are the methods of an object that is followed, which are the object itself; and what is computed from the value is
another value. A module counts as visited where it has a stop. A *return* is a stop on a higher layer than the stop
before it. A function is entered once for the same hands; types come from annotations.

What it does not see: values that Hydra puts into an object which a yaml file describes, values behind `**`, and what a
command line hands to another command.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from parameter_walk.code import Code, layers
from parameter_walk.picture import picture
from parameter_walk.walk import walks

ROOT = Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs" / "pictures" / "architecture.svg"
PARAMETERS = {
    "torque_limit": "torque limit",
    "tilt_limit": "tilt limit",
    "Channels": "state channels",
    "Episode": "episodes",
    "diagnosis.settings": "settings of the diagnosis",
}
"""What is followed, and what it is called in the picture."""


def report(code: Code, what: str, command: str) -> Iterator[str]:
    """Modules visited and returns, command by command; of one command each stop."""
    levels = layers(ROOT)
    for name, walk in walks(code, what).items():
        if command in ("", name):
            yield f"{what} in {name}: {len(walk.modules)} modules, {walk.returns(levels)} returns to a higher layer"
            counts = Counter(stop.module for stop in walk.stops)
            yield "  " + ", ".join(f"{module} ({counts[module]})" for module in walk.modules)
        if command == name:
            yield from (f"    {stop.module}:{stop.line} {stop.function}" for stop in walk.stops)


def main() -> None:
    """Follow what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument(
        "parameter", nargs="?", help="name of a parameter, or of a class; all of the picture if left out"
    )
    parser.add_argument("command", nargs="?", default="", help="one command, stop by stop: sim_collect, diagnose, ...")
    parser.add_argument("--draw", action="store_true", help=f"write {PICTURE.relative_to(ROOT)}")
    args = parser.parse_args()
    code = Code(ROOT / "twbal")
    if args.draw:
        PICTURE.write_text(picture(code, layers(ROOT), PARAMETERS))
    else:
        for what in [args.parameter] if args.parameter else PARAMETERS:
            print("\n".join(report(code, what, args.command)))


if __name__ == "__main__":
    main()
