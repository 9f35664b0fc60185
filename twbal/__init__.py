"""twbal: learn to balance a two-wheeled robot from a wrong simulator and very little real data.

The functions of this library are those of the commands, on values instead of files; docs/api.md has a tour. They are
loaded when they are first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from twbal.core.threads import default_to_one_thread

default_to_one_thread()  # before anything numeric is loaded: all modules of the library are imported after this one

if TYPE_CHECKING:
    from twbal.api.configured import setup as setup
    from twbal.api.diagnosing import diagnose as diagnose
    from twbal.api.driving import Evaluation as Evaluation
    from twbal.api.driving import evaluate as evaluate
    from twbal.api.driving import simulate as simulate
    from twbal.api.evaluating import evaluate_simulation as evaluate_simulation
    from twbal.api.files import (
        export_policy as export_policy,
    )
    from twbal.api.files import (
        load_model as load_model,
    )
    from twbal.api.files import (
        load_policy as load_policy,
    )
    from twbal.api.files import (
        read_episodes as read_episodes,
    )
    from twbal.api.files import (
        save_policy as save_policy,
    )
    from twbal.api.learning import LearningResult as LearningResult
    from twbal.api.learning import learn as learn
    from twbal.api.robots import connect as connect
    from twbal.api.robots import robot as robot

__version__ = "0.1.0"

_PLACES = {
    "setup": "configured",
    "diagnose": "diagnosing",
    "Evaluation": "driving",
    "evaluate": "driving",
    "simulate": "driving",
    "evaluate_simulation": "evaluating",
    "export_policy": "files",
    "load_model": "files",
    "load_policy": "files",
    "read_episodes": "files",
    "save_policy": "files",
    "LearningResult": "learning",
    "learn": "learning",
    "connect": "robots",
    "robot": "robots",
}
"""Module of `twbal.api` that each public name comes from."""

__all__ = ["__version__", *_PLACES]


def __getattr__(name: str) -> object:
    """A public name, loaded when it is first asked for (PEP 562)."""
    if name not in _PLACES:
        raise AttributeError(f"module 'twbal' has no attribute {name!r}; it has: {', '.join(_PLACES)}.")
    value: object = getattr(import_module(f"twbal.api.{_PLACES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_PLACES})
