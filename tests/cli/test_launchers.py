"""Sweeps over processes, a queue and a Ray cluster of two nodes come to the bytes that one process comes to."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest
from omegaconf import OmegaConf
from small_run import OVERRIDES, listed_hashes

from twbal.algorithm.summary import read_summary
from twbal.cli.manifest import read_manifest

ROOT = Path(__file__).resolve().parents[2]
JOBS = 3
SWEEP = [sys.executable, "-m", "twbal", "iterate", *OVERRIDES, "-m", f"link.seed={','.join(map(str, range(JOBS)))}"]
RAY = [sys.executable, "-m", "ray.scripts.scripts", "start", "--block", "--num-cpus=1"]
PATIENCE = 180  # seconds for what takes some ten on an idle machine
pytestmark = pytest.mark.slow


def environment():
    clean = {name: value for name, value in os.environ.items() if name not in ("HYDRA_FULL_ERROR", "RAY_ADDRESS")}
    return {**clean, "PYTHONPATH": str(ROOT), "RAY_USAGE_STATS_ENABLED": "0"}


def sweep(folder, *words):
    """Run a sweep of small runs of Algorithm 1 to its end."""
    done = subprocess.run(
        [*SWEEP, f"hydra.sweep.dir={folder}", *words], env=environment(), capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr


def hashes(folder):
    """sha256 of every artefact of every job; each job says that it is complete."""
    jobs = sorted(path.parent for path in folder.glob("*/artefacts.sha256"))
    assert len(jobs) == JOBS
    assert all(read_manifest(job).complete for job in jobs)
    return {job.name: listed_hashes(job) for job in jobs}


@pytest.fixture(scope="module")
def one_process(tmp_path_factory):
    """Hashes of the sweep in one process."""
    folder = tmp_path_factory.mktemp("one_process") / "sweep"
    sweep(folder)
    return hashes(folder)


@pytest.mark.parametrize(
    ("plugin", "words"),
    [
        ("hydra_joblib_launcher", ["hydra/launcher=joblib", "hydra.launcher.n_jobs=2"]),
        ("hydra_submitit_launcher", ["hydra/launcher=submitit_local"]),
    ],
)
def test_processes_elsewhere_make_the_same_files(one_process, tmp_path, plugin, words):
    pytest.importorskip(f"hydra_plugins.{plugin}")
    sweep(tmp_path / "sweep", *words)
    assert hashes(tmp_path / "sweep") == one_process


def test_optuna_gets_the_cost_of_a_run_and_resumes(tmp_path):
    pytest.importorskip("hydra_plugins.hydra_optuna_sweeper")
    words = [
        *(sys.executable, "-m", "twbal", "iterate", *OVERRIDES, "-m", "hydra/sweeper=optuna"),
        *("hydra.sweeper.sampler.seed=1", "hydra.sweeper.n_trials=3", "hydra.sweeper.n_jobs=1"),
        *("real_rollout.exploration=interval(0.02,0.2)", "hydra.sweep.dir=sweep"),
    ]
    found, stamps = [], []
    for _ in range(2):
        done = subprocess.run(words, env=environment(), cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        found.append(OmegaConf.load(tmp_path / "sweep" / "optimization_results.yaml"))
        stamps.append({path: path.stat().st_mtime_ns for path in (tmp_path / "sweep").glob("*/summary.json")})
    assert len(stamps[0]) == 3
    assert stamps[0] == stamps[1]
    assert found[0] == found[1]
    assert found[0].best_value == min(read_summary(path).best.real_cost for path in stamps[0])


# A Ray cluster of two nodes on this machine, each with room for one job


class Node:
    """`ray start`, and all processes that it starts."""

    def __init__(self, folder, *words):
        self._said = (folder / f"said_{len(list(folder.iterdir()))}").open("w")
        self._process = subprocess.Popen(
            [*RAY, "--object-store-memory=100000000", *words],
            env=environment(),
            stdout=self._said,
            stderr=self._said,
            start_new_session=True,
        )

    def processes(self):
        """Process ids, parents first."""
        found = [self._process.pid]
        for pid in found:
            found += children().get(pid, [])
        return found

    def jobs(self):
        """Ids of processes that run a job at this moment."""
        return [pid for pid in self.processes() if command_line(pid).startswith("ray::twbal")]

    def kill(self):
        """All at once, as a power cut would."""
        for pid in self.processes():
            send(pid, signal.SIGKILL)
        self._process.wait()
        self._said.close()


def send(pid, number):
    try:
        os.kill(pid, number)
    except ProcessLookupError:
        return


def children():
    """Process ids by parent."""
    found = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(path.read_text().rpartition(")")[2].split()[1])
        except (OSError, ValueError):
            continue
        found.setdefault(parent, []).append(int(path.parent.name))
    return found


def command_line(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_text()
    except OSError:
        return ""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def eventually(condition):
    """What `condition` comes to once that is true."""
    began = time.monotonic()
    while not (found := condition()):
        assert time.monotonic() - began < PATIENCE
        time.sleep(0.05)
    return found


def alive_nodes(address):
    code = f"import ray; ray.init('{address}', log_to_driver=False); print(sum(n['Alive'] for n in ray.nodes()))"
    done = subprocess.run([sys.executable, "-c", code], env=environment(), capture_output=True, text=True)
    return done.stdout.strip()


@pytest.fixture
def cluster():
    """Address and nodes, the head first."""
    pytest.importorskip("ray")
    folder = Path(tempfile.mkdtemp(prefix="ray_"))  # short: sockets lie in it
    port = free_port()
    address = f"127.0.0.1:{port}"
    nodes = [Node(folder, "--head", f"--port={port}", "--include-dashboard=false", f"--temp-dir={folder}")]
    try:
        eventually(lambda: alive_nodes(address) == "1")
        nodes.append(Node(folder, f"--address={address}"))
        eventually(lambda: alive_nodes(address) == "2")
        yield address, nodes
    finally:
        for node in reversed(nodes):
            node.kill()
        shutil.rmtree(folder, ignore_errors=True)


def start_on_ray(folder, address):
    words = [*SWEEP, "hydra/launcher=ray_cluster", f"hydra.launcher.address={address}", f"hydra.sweep.dir={folder}"]
    verbose = {**environment(), "RAY_DEDUP_LOGS": "0"}
    return subprocess.Popen(words, env=verbose, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def ended_well(process):
    said = all_said(process)
    assert process.returncode == 0, said
    return said


def all_said(process):
    try:
        return process.communicate(timeout=PATIENCE)[0]
    finally:
        process.kill()


def has_begun(folder):
    """Whether jobs on both nodes are in the middle of their work."""
    return len(list(folder.glob("*/simulation/0_model/model.pt"))) >= 2


def test_a_ray_cluster_of_two_nodes_makes_the_same_files(cluster, one_process, tmp_path):
    address, nodes = cluster
    process = start_on_ray(tmp_path / "sweep", address)
    eventually(lambda: all(node.jobs() for node in nodes))
    assert "is there already" not in ended_well(process)
    assert hashes(tmp_path / "sweep") == one_process


def test_a_killed_worker_loses_no_result(cluster, one_process, tmp_path):
    address, nodes = cluster
    process = start_on_ray(tmp_path / "sweep", address)
    eventually(lambda: has_begun(tmp_path / "sweep"))
    (victim,) = nodes[0].jobs()
    os.kill(victim, signal.SIGKILL)
    assert "is there already" in ended_well(process)  # as the job that was lost says where it goes on
    assert hashes(tmp_path / "sweep") == one_process


def test_a_killed_node_loses_no_result(cluster, one_process, tmp_path):
    address, nodes = cluster
    process = start_on_ray(tmp_path / "sweep", address)
    eventually(lambda: has_begun(tmp_path / "sweep"))
    assert nodes[1].jobs()
    nodes[1].kill()
    assert "is there already" in ended_well(process)
    assert hashes(tmp_path / "sweep") == one_process
    assert alive_nodes(address) == "1"


def test_no_cluster_at_an_address_is_one_clear_error(tmp_path):
    pytest.importorskip("ray")
    process = start_on_ray(tmp_path / "sweep", f"127.0.0.1:{free_port()}")
    said = all_said(process)
    assert process.returncode == 1
    assert said.splitlines()[-1].startswith("twbal: error: There is no Ray cluster at '127.0.0.1:")
