"""The robot as an environment of Gymnasium; importing this registers `twbal/TwoWheeled-v0`, if Gymnasium is there."""

from contextlib import suppress

with suppress(ImportError):  # what an agent is, says `agent.py` without it
    import gymnasium

    gymnasium.register("twbal/TwoWheeled-v0", entry_point="twbal.cli.environment_config:make")
