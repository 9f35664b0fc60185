"""How long a log of a million rows takes to come in, and an episode log to be read.

`python -m benchmarks.running.logs '<settings>'`. The import is that of a CSV of 1 kHz with all quantities, as a person
sees it from start to end. Reading is timed beside the bare decoding of the same messages, in memory already, by
protobuf.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pandas
from mcap.records import Message
from mcap.stream_reader import StreamReader

from twbal.io.logs import read_episode
from twbal.io.logs.layout import layout_of


def write_log(path: Path, rows: int) -> None:
    """A robot that sways, with noise of its sensors."""
    t, noise = 1e-3 * np.arange(rows), np.random.default_rng(0).standard_normal((rows, 6))
    columns = {
        "time": t.round(4),
        "tilt": (0.05 * np.sin(2 * t) + 0.002 * noise[:, 0]).round(5),
        "tilt_rate": (0.1 * np.cos(2 * t) + 0.02 * noise[:, 1]).round(4),
        "acceleration": noise[:, 2].round(3),
        "yaw_rate": (0.01 * noise[:, 3]).round(4),
        "wheel_angle": np.sin(t).round(5),
        "wheel_rate": (np.cos(t) + 0.1 * noise[:, 4]).round(4),
        "command": np.sin(3 * t).round(4),
    }
    pandas.DataFrame(columns).to_csv(path, index=False)


def bare_decode(path: Path) -> float:
    """CPU seconds in which protobuf decodes the messages of a log."""
    episode = read_episode(path)
    kinds = {topic.id: topic.message_class for topic in layout_of(episode.channels).topics}
    with path.open("rb") as stream:
        messages = [(r.channel_id, r.data) for r in StreamReader(stream).records if isinstance(r, Message)]
    began = time.process_time()
    for channel, data in messages:
        kinds[channel].FromString(data)
    return time.process_time() - began


def run(rows: int, repeats: int) -> dict[str, Any]:
    """Medians."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "log.csv"
        write_log(log, rows)
        seconds, cpu, memory = [], [], []
        for k in range(repeats):
            out = Path(folder) / f"out_{k}"
            command = [sys.executable, "-m", "twbal", "import-log", f"files={log}", f"hydra.run.dir={out}"]
            began = time.monotonic()
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
            _, status, used = os.wait4(process.pid, 0)
            if status:
                raise SystemExit("The import failed.")
            seconds.append(time.monotonic() - began)
            cpu.append(used.ru_utime + used.ru_stime)
            memory.append(used.ru_maxrss / 1024)
        episode = out / "episodes" / "log.mcap"
        shares = []
        for _ in range(repeats):
            began = time.process_time()
            read_episode(episode)
            shares.append((time.process_time() - began) / bare_decode(episode))
        return {
            "import_s": median(seconds),
            "import_cpu_s": median(cpu),
            "import_memory_mb": max(memory),
            "read_over_bare_decode": median(shares),
        }


if __name__ == "__main__":
    print(json.dumps(run(**json.loads(sys.argv[1]))))
