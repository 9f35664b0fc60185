"""Episodes on disk: one MCAP file each, which viewers open and which survives a cut. See docs/formats.md."""

from twbal.io.logs.reader import Recovered, read_control_period, read_episode, read_episodes, recover_episode
from twbal.io.logs.writer import write_episode

__all__ = ["Recovered", "read_control_period", "read_episode", "read_episodes", "recover_episode", "write_episode"]
