"""What is compiled while setting up is what the first commands run."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from twbal.cli import warm
from twbal.core.errors import TwbalError

FIRST_COMMANDS = (
    ("sim-collect", "rollouts=2", "steps=30", "hydra.run.dir=simulated"),
    ("fit-sim-gp", "episodes=simulated", "model.fit_f.settings.fit.starts=1", "hydra.run.dir=model"),
    ("real-rollout", "experiment=excite", "trials=1", "steps=120", "link.seed=3", "hydra.run.dir=recorded"),
    ("identify", "episodes=recorded", "hydra.run.dir=identified"),
)


@pytest.mark.slow
def test_the_first_commands_compile_nothing_more(tmp_path):
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}

    def run(*words: str) -> set[Path]:
        """Run Python in a process of its own; returns the machine code that is kept after that."""
        subprocess.run([sys.executable, *words], cwd=tmp_path, env=environment, check=True, capture_output=True)
        return set((tmp_path / "cache").rglob("*.nbc"))

    compiled = run("-m", "twbal.cli.warm")
    assert len(compiled) > 50
    for command in FIRST_COMMANDS:
        assert run("-m", "twbal", *command) == compiled, command


def test_a_command_that_fails_is_said(monkeypatch):
    monkeypatch.setattr(warm, "twbal", lambda words: 1)
    with pytest.raises(TwbalError, match="twbal real-rollout"):
        warm.compile_robot_and_diagnosis()
