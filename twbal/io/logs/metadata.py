"""What a log says about its episode as a whole: a metadata record of text entries, written and read here."""

import zlib
from collections.abc import Mapping
from typing import NamedTuple

from twbal.core.episode import Episode, Estimated, Outcome, Provenance
from twbal.core.errors import LogError
from twbal.io.logs.topics import unit_of

SCHEMA_VERSION = 4
"""Newest that this twbal reads and writes. A log says the lowest version that tells all of it: 2 added `estimated`, 3
`references`, to which the states of such a log are relative, and 4 `headings`: the wheels were driven apart."""
METADATA_NAME = "twbal.episode"
CONFIG_NAME = "config.yaml"
_POSES, _REFERENCES, _HEADINGS = "/pose", "/reference", "/heading"


class Description(NamedTuple):
    """What the metadata record says.

    Attributes:
        channels: names of the state channels.
        control_period: [s].
        outcome: how the rollout ended.
        provenance: where the episode comes from; its configuration is an attachment, and is not in here.
        samples: T + 1.
        events: how many events were written.
        estimated: channels that no sensor measured.
        poses: whether the samples have true poses.
        references: whether they have the reference that was followed.
        headings: whether they have what the control of the heading knew and did.
    """

    channels: tuple[str, ...]
    control_period: float
    outcome: Outcome
    provenance: Provenance
    samples: int
    events: int
    estimated: tuple[Estimated, ...]
    poses: bool
    references: bool
    headings: bool


def metadata_of(episode: Episode) -> dict[str, str]:
    """The entries of the metadata record of `episode`."""
    source = episode.provenance
    entries = {
        "schema_version": str(_version(episode)),
        "robot": source.robot,
        "source": source.source,
        "parameter_hash": source.parameter_hash,
        "policy_hash": source.policy_hash,
        "seed": str(source.seed),
        "trial": str(source.trial),
        "control_period": repr(float(episode.control_period)),
        "channels": ",".join(episode.channels),
        "units": ",".join(unit_of(name) for name in episode.channels),
        "outcome": episode.outcome.value,
        "samples": str(len(episode) + 1),
        "events": str(len(episode.events)),
    }
    if episode.estimated:
        entries["estimated"] = ",".join(f"{channel}:{float(sd)!r}" for channel, sd in episode.estimated)
    if episode.poses is not None:  # of no other version: who does not know of poses loses nothing else
        entries["poses"] = _POSES
    if episode.references is not None:
        entries["references"] = _REFERENCES
    if episode.headings is not None:
        entries["headings"] = _HEADINGS
    # MCAP guards attachments and chunks, but no metadata, where the end of the file is lost.
    return {**entries, "checksum": checksum(entries)}


def _version(episode: Episode) -> int:
    if episode.headings is not None:
        return 4
    return 3 if episode.references is not None else 2 if episode.estimated else 1


def description_of(entries: Mapping[str, str]) -> Description:
    """What these entries say.

    Raises:
        LogError: another schema version, or entries that are damaged or cannot be right; the message names no file.
    """
    if entries.get("checksum") != checksum(entries):
        raise LogError("has a damaged metadata record (its checksum does not fit), so none of it can be trusted")
    version = entries.get("schema_version", "")
    if version not in map(str, range(1, SCHEMA_VERSION + 1)):
        raise LogError(
            f"is an episode log of schema version {version or 'unknown'}; this twbal reads versions up to "
            f"{SCHEMA_VERSION}. "
            "Read it with the version of twbal that wrote it, or a newer one"
        )
    try:
        return _parse(entries)
    except (KeyError, ValueError) as error:
        raise LogError(f"has a metadata record that cannot be right ({type(error).__name__}: {error})") from error


def _parse(entries: Mapping[str, str]) -> Description:
    return Description(
        channels=tuple(entries["channels"].split(",")) if entries["channels"] else (),
        control_period=float(entries["control_period"]),
        outcome=Outcome(entries["outcome"]),
        provenance=Provenance(
            robot=entries["robot"],
            source=entries["source"],
            parameter_hash=entries["parameter_hash"],
            policy_hash=entries["policy_hash"],
            seed=int(entries["seed"]),
            trial=int(entries["trial"]),
        ),
        samples=int(entries["samples"]),
        events=int(entries["events"]),
        poses=_has(_POSES, entries.get("poses", "")),
        references=_has(_REFERENCES, entries.get("references", "")),
        headings=_has(_HEADINGS, entries.get("headings", "")),
        estimated=tuple(_estimated(word) for word in entries.get("estimated", "").split(",") if word),
    )


def _has(topic: str, word: str) -> bool:
    if word not in ("", topic):
        raise ValueError(f"{word!r} where {topic!r} belongs")
    return bool(word)


def _estimated(word: str) -> Estimated:
    channel, _, sd = word.partition(":")
    return Estimated(channel, float(sd))


def checksum(entries: Mapping[str, str]) -> str:
    """CRC-32 of the entries, sorted by key, without the checksum itself."""
    text = "\n".join(f"{key}={entries[key]}" for key in sorted(entries) if key != "checksum")
    return f"{zlib.crc32(text.encode()):08x}"
