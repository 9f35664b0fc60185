"""The robot as an environment of Gymnasium; importing this registers `twbal/TwoWheeled-v0`."""

from twbal.core.errors import ConfigError, install_advice

try:
    import gymnasium
except ImportError as error:
    raise ConfigError(f"An environment of Gymnasium needs gymnasium: {install_advice('rl')}.") from error

gymnasium.register("twbal/TwoWheeled-v0", entry_point="twbal.cli.environment_config:make")
