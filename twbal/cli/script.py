"""`commands.sh`, which does a run by hand, and the list of hashes that it must come to."""

from collections.abc import Mapping, Sequence
from pathlib import Path

SCRIPT, HASHES = "commands.sh", "artefacts.sha256"

_HEAD = f"""\
#!/bin/sh
# The stages of this run, one by one. To do them by hand into another folder, and compare what they make with this run:
#     sh {SCRIPT} [folder]
set -eu
here=$(cd "$(dirname "$0")" && pwd)
out=${{1:-"$here/by_hand"}}
OUT=$(printf %s "$out" | sed "s/'/\\\\\\\\'/g")  # as it stands in a text of Hydra's, between apostrophes
"""

_TAIL = f"""\
cd "$out" && sha256sum --check --quiet "$here/{HASHES}" && echo "The same hashes as in $here"
"""


def script(commands: Sequence[str], best: Path, kept_as: str) -> str:
    """The text of `commands.sh`.

    Args:
        commands: in order; `$OUT` in them stands for the run folder, as Hydra reads it.
        best: the best policy, within the run folder.
        kept_as: what its copy is called there.
    """
    copy = f'cp "$out/{best}" "$out/{kept_as}"'
    return "\n".join([_HEAD, *commands, copy, "", _TAIL])


def hash_list(hashes: Mapping[str, str]) -> str:
    """The text that `sha256sum --check` reads.

    Args:
        hashes: sha256 by path within the run folder.
    """
    return "".join(f"{sha256}  {path}\n" for path, sha256 in hashes.items())
