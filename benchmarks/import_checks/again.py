"""A log that a second call imports, renamed and mapped anew, or cut: what `twbal import-log` says to it."""

import io
import tempfile
from contextlib import redirect_stdout
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from benchmarks.import_checks.case import log_of
from benchmarks.import_checks.conventions import Written
from twbal.cli.main import main
from twbal.core.motor import Motor

NAMES = ("renamed", "cut", "another log")
"""What the second call imports; of the last one nothing must be said."""

_SAID = ("has been imported before", "rows in common with")
_OTHER = 500_000  # added to the seed, for another log
_LEAST, _MOST = 0.3, 0.7  # share of the rows that are left of one that is cut


def imported_again(seed: int, what: str) -> dict[str, Any]:
    """Import the log of a seed, and by a second call what `what` says; returns what the second one said."""
    ride, log = log_of(seed)
    rng = np.random.default_rng([seed, 3_000_000])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        _import(log, path, "first")
        second = log_of(seed + _OTHER)[1] if what == NAMES[2] else _cut(log, rng) if what == NAMES[1] else _mapped(log)
        told = [line.strip() for line in _import(second, path, "second").splitlines() if "WARNING" in line]
    said = [line.replace(f"{folder}/", "") for line in told if any(words in line for words in _SAID)]
    return {"seed": seed, "what": what, "rows": len(ride.tilt), "said": said}


def _cut(log: Written, rng: np.random.Generator) -> Written:
    count = len(next(iter(log.columns.values())))
    length = int(count * rng.uniform(_LEAST, _MOST))
    begin = int(rng.integers(0, count - length))
    return replace(log, columns={name: values[begin : begin + length] for name, values in log.columns.items()})


def _mapped(log: Written) -> Written:
    """With another sign of the tilt: the file is the same, and no imported row is."""
    return log.changed("tilt", scale=-log.quantities["tilt"].get("scale", 1.0))


def _import(log: Written, folder: Path, name: str) -> str:
    """What the command says to a log that is written as `name`.csv."""
    log.write(folder / f"{name}.csv")
    (folder / "conf" / "import").mkdir(parents=True, exist_ok=True)
    mapping = {
        "_target_": "twbal.io.importers.mapping.mapping",
        "quantities": {quantity: dict(source) for quantity, source in log.quantities.items()},
        "names": [],
        "rate": log.rate,
        "motor": None if log.motor is None else {"_target_": f"{Motor.__module__}.Motor", **asdict(log.motor)},
        "command_is_sample": False,
        "command_before_sample": log.comes_before,
        "skip": 0.0,
        "fill": 3,
    }
    (folder / "conf" / "import" / f"{name}.yaml").write_text(yaml.safe_dump(mapping, allow_unicode=True))
    words = [f"--config-dir={folder / 'conf'}", f"import={name}", f"files={folder / f'{name}.csv'}"]
    said = io.StringIO()
    with redirect_stdout(said):
        code = main(["import-log", *words, f"hydra.run.dir={folder / 'imports' / name}"])
    if code:
        raise SystemExit(f"The import of {name} ended with {code}:\n{said.getvalue()}")
    return said.getvalue()
