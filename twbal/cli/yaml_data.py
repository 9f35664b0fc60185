"""Yaml as data: mappings, lists and text, out of files that may come from anyone.

Nothing in such a file can name code, point to another part of it or ask for more than it holds: tags, anchors, aliases
and merge keys are refused, and so is a key that comes twice. How deep and how large a file may be is checked while it
is read, before a parser has anything to unfold.
"""

from pathlib import Path
from typing import Any, NamedTuple

import yaml

from twbal.core.errors import ConfigError
from twbal.core.files import read_bounded


class Bounds(NamedTuple):
    """How much a file may hold.

    Attributes:
        size: [bytes].
        depth: mappings and lists within each other.
        values: mappings, lists, keys and texts in all.
    """

    size: int = 64 * 1024
    depth: int = 8
    values: int = 2000


OF_A_RUN = Bounds(2**20, 32, 20_000)
"""Of the configuration of a run."""


def read_yaml(path: Path, bounds: Bounds = Bounds()) -> Any:  # noqa: B008 - a tuple, which nobody can change
    """What a yaml file says: dicts with text keys, lists, and text, also where it says numbers.

    Raises:
        ConfigError: the file cannot be read, is larger than `bounds`, or holds more than data; the message is one line.
        FileNotFoundError: it is not there.
    """
    try:
        text = read_bounded(path, bounds.size).decode("utf-8")
    except FileNotFoundError:
        raise
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path} is no text in UTF-8 ({error.reason} at byte {error.start}).") from error
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror or error}.") from error
    return yaml_of(text, path, bounds)


def yaml_of(text: str, path: Path, bounds: Bounds) -> Any:
    """What yaml text says, as `read_yaml` has it.

    Args:
        text: the yaml.
        path: of the file that it stands in.
        bounds: how much it may hold.

    Raises:
        ConfigError: it holds more than data, or more than `bounds`; the message is one line.
    """
    try:
        return _tree(text, bounds)
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # PyYAML turns odd escapes into characters unchecked
        raise ConfigError(f"{path} is no yaml that can be read: {' '.join(str(error).split())}.") from error
    except ConfigError as error:
        raise ConfigError(f"{path} {error}") from error


class _Unfinished(NamedTuple):
    """A mapping or a list that is being read, and the key whose value comes next (None where a key comes next)."""

    node: dict[str, Any] | list[Any]
    keys: list[str]

    def add(self, value: Any, line: int) -> None:
        if isinstance(self.node, list):
            self.node.append(value)
        elif self.keys:
            self.node[self.keys.pop()] = value
        elif not isinstance(value, str):
            raise ConfigError(f"has a key that is no text, in line {line}.")
        elif value == "<<":
            raise ConfigError(f"has a merge key (<<) in line {line}. Write the values out.")
        elif value in self.node:
            raise ConfigError(f"has {value[:40]!r} twice, in line {line}.")
        else:
            self.keys.append(value)


def _tree(text: str, bounds: Bounds) -> Any:
    """The tree that the parser's events describe, built without recursion."""
    whole = _Unfinished([], [])
    within = [whole]
    values = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        line = event.start_mark.line + 1
        _check_is_data(event, line)
        if isinstance(event, yaml.CollectionEndEvent):
            closed = within.pop()
            within[-1].add(closed.node, line)
        elif isinstance(event, yaml.NodeEvent):
            values += 1
            if values > bounds.values or len(within) > bounds.depth:
                most = f"at most {bounds.values} values within {bounds.depth} levels are read"
                raise ConfigError(f"holds too much: {most} (line {line}).")
            if isinstance(event, yaml.ScalarEvent):
                within[-1].add(event.value, line)
            else:
                is_mapping = isinstance(event, yaml.MappingStartEvent)
                within.append(_Unfinished({} if is_mapping else [], []))
    assert isinstance(whole.node, list)
    if len(whole.node) != 1:
        raise ConfigError("is empty." if not whole.node else "holds several documents; expected is one.")
    return whole.node[0]


def _check_is_data(event: yaml.Event, line: int) -> None:
    if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None) is not None:
        raise ConfigError(f"has an anchor or an alias (& or *) in line {line}. Write the values out.")
    if getattr(event, "tag", None) is not None:
        raise ConfigError(f"has the tag {str(event.tag)[:40]!r} in line {line}; only plain values are read.")
