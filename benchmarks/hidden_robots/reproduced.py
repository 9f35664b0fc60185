"""Runs the commands of finished benchmark runs by hand, and compares what they make with the runs.

    python -m benchmarks.hidden_robots.reproduced family=hard [recipe=default] [robots=3]

Each run of `twbal iterate` writes `commands.sh`, which does the same stage by stage into another folder, and ends by
comparing the sha256 of all artefacts. Here that is done for the first `robots` runs of a family that are done; a run
that was reproduced before is not done again. Raw results go to benchmarks/results/reproduced.json.
"""

import json
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.hidden_robots.__main__ import RECIPES, RESULTS, ROOT
from benchmarks.hidden_robots.families import FAMILIES
from benchmarks.settings import text_settings
from twbal.core.files import file_hash, write_atomically

_DEFAULTS = {"family": "", "recipe": "default", "robots": "3"}
_TARGET = RESULTS / "reproduced.json"
_LAST_WORDS = 300  # characters


def reproduced(run: Path) -> dict[str, Any]:
    """Whether the commands of a run make its artefacts again, to the bit, and how many artefacts there are.

    Args:
        run: run folder of `twbal iterate`; what is made again lies in its `by_hand`, and is removed if it is the same.
    """
    count = len((run / "artefacts.sha256").read_text().splitlines())
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    line = ["sh", str(run / "commands.sh"), str(run.absolute() / "by_hand")]
    made = subprocess.run(line, env={**os.environ, "PATH": path}, capture_output=True, text=True, check=False)
    if made.returncode == 0:
        shutil.rmtree(run / "by_hand")
        return {"artefacts": count, "same": True}
    return {"artefacts": count, "same": False, "said": (made.stdout + made.stderr)[-_LAST_WORDS:]}


def main(words: Sequence[str]) -> None:
    """Run with settings of the form key=value."""
    usage = (
        f"Settings are family ({', '.join(FAMILIES)}), recipe ({', '.join(RECIPES)}) and robots (how many); found "
        f"{shlex.join(words)}."
    )
    settings = text_settings(_DEFAULTS, words, usage)
    family, recipe = settings["family"], settings["recipe"]
    if family not in FAMILIES or recipe not in RECIPES:
        raise SystemExit(usage)
    runs = sorted(file.parent for file in (ROOT / family / recipe).glob("robot_*/result.json"))
    found: dict[str, Any] = json.loads(_TARGET.read_text()) if _TARGET.exists() else {}
    for run in runs[: int(settings["robots"])]:
        name = f"{family}/{recipe}/{run.name}"
        made = file_hash(run / "artefacts.sha256")
        if found.get(name, {}).get("run", made) != made:
            print(f"{name}: another run than the one that was compared before", flush=True)
        if found.get(name, {}).get("run") != made:
            found[name] = {**reproduced(run), "run": made}
            write_atomically(_TARGET, json.dumps(found, indent=1) + "\n")
        print(f"{name}: {'the same' if found[name]['same'] else 'NOT the same'}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
