"""`manifest.json`: what made a run folder, and whether it is done, so that no work is done twice or half."""

import hashlib
import json
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import metadata
from pathlib import Path

import yaml

from twbal import __version__
from twbal.cli.settings.nested_settings import flattened
from twbal.core.errors import ConfigError, DataError
from twbal.core.files import alone_in, file_hash
from twbal.core.json_records import read_record, write_record
from twbal.effects.library import outside_digest

MANIFEST = "manifest.json"
_LISTED = 3  # files that are named one by one
PACKAGES = (
    *("torch", "gpytorch", "pybullet", "numpy", "scipy", "numba", "mcap", "protobuf", "hydra-core", "omegaconf"),
    *("gymnasium", "stable-baselines3"),
)


@dataclass(frozen=True)
class StageWork:
    """One piece of work, and all that decides its result.

    Attributes:
        stage: that does it.
        out: folder for what it makes.
        settings: the resolved configuration as far as it bears on the result, as yaml text.
        inputs: the files it reads, by what they are ("episodes", "model"), in the order in which they are read.
        seed: of its randomness.
    """

    stage: str
    out: Path
    settings: str
    inputs: Mapping[str, Sequence[Path]]
    seed: int


@dataclass(frozen=True)
class FileRecord:
    """A file as it was.

    Attributes:
        path: inputs: as it was given; outputs: within the run folder.
        sha256: of its content.
    """

    path: str
    sha256: str


@dataclass(frozen=True)
class Manifest:
    """What `manifest.json` says.

    Attributes:
        stage: that did the work.
        complete: whether it came to its end.
        fingerprint: sha256 over stage, twbal's version and source code, settings, seed and the content of the inputs;
            not over paths.
        seed: of its randomness.
        settings: as in `StageWork`.
        inputs: by what they are.
        outputs: what was made.
        versions: of Python, twbal and the packages that numbers depend on.
        started: date and time, UTC.
        wall_s: how long it took [s]; of the last go, where it was resumed.
    """

    stage: str
    complete: bool
    fingerprint: str
    seed: int
    settings: str
    inputs: Mapping[str, tuple[FileRecord, ...]]
    outputs: tuple[FileRecord, ...]
    versions: Mapping[str, str]
    started: str
    wall_s: float


def perform(step: StageWork, work: Callable[[], Sequence[Path]]) -> Manifest:
    """Do `work`, unless the manifest in the step's folder says that it is done already.

    A second process with the same folder waits for the first, and then finds the work done. The manifest is written
    before the work (not complete) and after it (complete). A process killed in between leaves
    the first one: the next go does the work again in the same folder, and may use what lies there, as it is of the
    same settings and inputs.

    Args:
        step: what decides the result.
        work: makes the outputs in `step.out` and returns their paths.

    Raises:
        ConfigError: the folder holds what other settings or inputs made. (Nothing, where they failed at once.)
        DataError: an input cannot be read.
    """
    inputs = _inputs_of(step)
    fingerprint = _fingerprint(step, inputs)
    done = _done_before(step, inputs, fingerprint)
    if done is not None:
        return done
    with alone_in(step.out):
        return _done_before(step, inputs, fingerprint) or _do(step, inputs, fingerprint, work)


def perform_anew(step: StageWork, work: Callable[[], Sequence[Path]]) -> Manifest:
    """Do `work`, also where it was done before; what lies in the step's folder must be of the same stage.

    Args: as of `perform`.

    Raises:
        ConfigError: the folder holds the work of another stage, or files of nobody's.
        DataError: an input cannot be read.
    """
    inputs = _inputs_of(step)
    with alone_in(step.out):
        before = read_manifest(step.out)
        if before is None:
            _refuse_files_of_others(step.out)
        elif before.stage != step.stage:
            raise ConfigError(_other_work(step, inputs, before))
        return _do(step, inputs, _fingerprint(step, inputs), work)


def _done_before(step: StageWork, inputs: Mapping[str, tuple[FileRecord, ...]], fingerprint: str) -> Manifest | None:
    """The manifest in the step's folder, if it says that the work is done."""
    before = read_manifest(step.out)
    if before is None:
        _refuse_files_of_others(step.out)
        return None
    if before.fingerprint != fingerprint and (before.complete or lying_in(step.out)):
        raise ConfigError(_other_work(step, inputs, before))
    return before if before.complete and _outputs_are_whole(step.out, before) else None


def _do(
    step: StageWork,
    inputs: Mapping[str, tuple[FileRecord, ...]],
    fingerprint: str,
    work: Callable[[], Sequence[Path]],
) -> Manifest:
    started = now_utc()
    clock = time.monotonic()

    def note(outputs: Sequence[Path], complete: bool) -> Manifest:
        made = tuple(FileRecord(path.relative_to(step.out).as_posix(), file_hash(path)) for path in outputs)
        wall_s = round(time.monotonic() - clock, 3)
        manifest = Manifest(
            step.stage, complete, fingerprint, step.seed, step.settings, inputs, made, versions(), started, wall_s
        )
        write_record(step.out / MANIFEST, manifest)
        return manifest

    note([], complete=False)
    return note(work(), complete=True)


def now_utc() -> str:
    """Date and time as manifests note them; later ones are greater."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())


def read_manifest(folder: Path) -> Manifest | None:
    """The manifest of a run folder; None where there is none.

    Raises:
        DataError: it cannot be understood.
    """
    path = folder / MANIFEST
    try:
        return read_record(Manifest, path)
    except FileNotFoundError:
        return None
    except DataError as error:
        raise DataError(
            f"{path} is no manifest of this version of twbal ({error}) Choose another run folder by hydra.run.dir=..."
        ) from error


def reopen(step: StageWork, may_go_on: Callable[[Manifest], bool]) -> None:
    """Make the folder of earlier work that of other work, which goes on with what lies there.

    The old manifest is replaced at once by one of work that is not complete, so that a process killed in between loses
    nothing.

    Args:
        step: the other work.
        may_go_on: whether what lies there, by its manifest, is true of the other work, too. It is asked where both are
            of the same stage, code and inputs.

    Raises:
        DataError: an input or the manifest cannot be read.
    """
    if read_manifest(step.out) is None:
        return
    with alone_in(step.out):
        before, inputs = read_manifest(step.out), _inputs_of(step)
        if before is None:
            return
        same = replace(step, settings=before.settings, seed=before.seed)
        if before.fingerprint == _fingerprint(same, inputs) and may_go_on(before):
            fingerprint = _fingerprint(step, inputs)
            now = replace(before, complete=False, fingerprint=fingerprint, settings=step.settings, outputs=())
            write_record(step.out / MANIFEST, now)


def versions() -> dict[str, str]:
    """Versions of Python, twbal and the packages that numbers depend on; a package that is not there is left out."""
    return dict(_versions())


@cache
def _versions() -> dict[str, str]:
    """The same, looked up once: each takes a few milliseconds, and they do not change while a process runs."""
    found = {"python": platform.python_version(), "twbal": __version__}
    for package in PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return found


def _inputs_of(step: StageWork) -> dict[str, tuple[FileRecord, ...]]:
    return {
        name: tuple(FileRecord(str(path), file_hash(path)) for path in paths) for name, paths in step.inputs.items()
    }


def _fingerprint(step: StageWork, inputs: Mapping[str, tuple[FileRecord, ...]]) -> str:
    hashes = {name: [record.sha256 for record in records] for name, records in inputs.items()}
    what = [step.stage, __version__, _source_hash(), step.settings, step.seed, hashes]
    return hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()


@cache
def _source_hash() -> str:
    """sha256 over the source code of twbal and of effects from outside: what other code made is not taken for ours."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        digest.update(f"{path.relative_to(package).as_posix()} {path.stat().st_size}\n".encode())
        digest.update(path.read_bytes())
    digest.update(outside_digest().encode())
    return digest.hexdigest()


def lying_in(folder: Path) -> list[str]:
    """Files in a folder but for what work that failed at once leaves: manifests, and what Hydra and sweeps write."""
    inside = (path.relative_to(folder) for path in sorted(folder.rglob("*")) if path.is_file())
    return [
        path.as_posix()
        for path in inside
        if not (path.name == MANIFEST or path.suffix == ".log" or any(p.startswith(".") for p in path.parts))
    ]


def _refuse_files_of_others(folder: Path) -> None:
    """Refuse a folder without a manifest that has files: a stage would write over them, or take them for its own.

    Raises:
        ConfigError: it has some.
    """
    files = lying_in(folder)
    if files:
        more = f" and {len(files) - _LISTED} more" if len(files) > _LISTED else ""
        raise ConfigError(
            f"Folder {folder} has no {MANIFEST}, but files that could be written over: {', '.join(files[:_LISTED])}"
            f"{more}. Choose a new folder by hydra.run.dir=..., or move them away."
        )


def _outputs_are_whole(folder: Path, manifest: Manifest) -> bool:
    return all(
        (folder / made.path).is_file() and file_hash(folder / made.path) == made.sha256 for made in manifest.outputs
    )


def _as_overrides(settings: str) -> list[str]:
    """Settings as they are given on a command line, by their dotted keys."""
    tree = yaml.load(settings, yaml.BaseLoader)  # all values as text
    if not isinstance(tree, Mapping):
        return []
    values = {key: f"[{','.join(map(str, v))}]" if isinstance(v, list) else v for key, v in flattened(tree)}
    return [f"{key}={value}" for key, value in values.items()]


def _other_work(step: StageWork, inputs: Mapping[str, tuple[FileRecord, ...]], before: Manifest) -> str:
    """Why `before` is not a manifest of `step`."""
    if before.stage != step.stage:
        what = f"stage {before.stage}"
    elif before.seed != step.seed:
        what = f"seed {before.seed}"
    elif before.settings != step.settings:
        old, new = set(_as_overrides(before.settings)), _as_overrides(step.settings)
        changed = [setting for setting in new if setting not in old]
        what = f"other settings (now new: {', '.join(changed[:3]) or 'some are gone'})"
    elif inputs != before.inputs:
        what = "other inputs"
    else:
        what = f"another version of twbal ({before.versions.get('twbal')}, or of its source code)"
    return (
        f"Folder {step.out} holds the work of {what}, which is kept. Choose another one by hydra.run.dir=..., or for a "
        "sweep by hydra.sweep.dir=..."
    )
