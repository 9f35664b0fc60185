"""The robot as an environment of Gymnasium; importing this registers `twbal/TwoWheeled-v0`."""

from twbal.errors import ConfigError

try:
    import gymnasium
except ImportError as error:
    raise ConfigError("An environment of Gymnasium needs gymnasium: pip install 'twbal[rl]'.") from error

gymnasium.register("twbal/TwoWheeled-v0", entry_point="twbal.stages.environment:make")
