"""Jobs of a sweep on a Ray cluster that is already running: `hydra/launcher=ray_cluster hydra.launcher.address=...`.

Hydra's own Ray launcher only starts a cluster: on one that runs it passes `object_store_memory`, which Ray refuses.
"""

import logging
import os
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hydra.core.singleton import Singleton
from hydra.core.utils import JobReturn, JobStatus, configure_log, filter_overrides, run_job, setup_globals
from hydra.plugins.launcher import Launcher
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, open_dict

from twbal.cli.sweeps import FailedJobError
from twbal.core.errors import SweepError, install_advice
from twbal.core.threads import asked_threads

_PATIENCE = 10.0  # s
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Work:
    """One job as it travels to a node.

    Attributes:
        number: of the job within its sweep.
        overrides: of the job.
        context: what composes its configuration.
        task: what it runs.
        config: of the sweep.
        singletons: Hydra's state.
        folder: working directory of the sweep, which nodes must have, too.
    """

    number: int
    overrides: tuple[str, ...]
    context: HydraContext
    task: TaskFunction
    config: DictConfig
    singletons: dict[Any, Any]
    folder: str

    def run(self) -> JobReturn:
        """Run the job in this process; what fails in it is in what is returned."""
        os.chdir(self.folder)
        setup_globals()
        Singleton.set_state(self.singletons)
        config = self.context.config_loader.load_sweep_config(self.config, list(self.overrides))
        with open_dict(config):
            config.hydra.job.id = f"{config.hydra.job.name}_{self.number}"
            config.hydra.job.num = self.number
        return run_job(
            hydra_context=self.context,
            task_function=self.task,
            config=config,
            job_dir_key="hydra.sweep.dir",
            job_subdir_key="hydra.sweep.subdir",
        )


class RayJobs(Launcher):
    """Runs each job as one Ray task; `hydra_plugins/twbal_ray_cluster.py` makes it a plug-in of Hydra.

    A job that is lost with its process or its node is run again elsewhere: it finds in its folder what was done before,
    and ends at the same bytes. All nodes must see the sweep's folder by the same path.

    Args:
        address: of the cluster's head, as host:port; auto: RAY_ADDRESS, or the cluster that runs on this machine.
        num_cpus: that a job counts for; a node runs as many jobs at once as it has room for.
        max_retries: how often a job is run again that was lost with its process or node; -1: always.
    """

    def __init__(self, address: str, num_cpus: float, max_retries: int) -> None:
        self._address, self._num_cpus, self._max_retries = address, num_cpus, max_retries

    def setup(self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig) -> None:
        """Keep what the jobs are made of."""
        self._context, self._task, self._config = hydra_context, task_function, config

    def launch(self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int) -> Sequence[JobReturn]:
        """Run all jobs and wait for them; their results in the same order.

        Raises:
            SweepError: Ray is not installed, or there is no such cluster.
        """
        setup_globals()
        configure_log(self._config.hydra.hydra_logging, self._config.hydra.verbose)
        Path(str(self._config.hydra.sweep.dir)).mkdir(parents=True, exist_ok=True)
        ray = _joined(self._address)
        try:
            _log.info(f"Launching {len(job_overrides)} jobs on the Ray cluster {self._address}")
            return self._run(ray, job_overrides, initial_job_idx)
        finally:
            ray.shutdown()

    def _run(self, ray: Any, job_overrides: Sequence[Sequence[str]], first: int) -> list[JobReturn]:
        remote = ray.remote(num_cpus=self._num_cpus, max_retries=self._max_retries)(Work.run)
        singletons, waiting, results = Singleton.get_state(), {}, {}
        for number, overrides in enumerate(job_overrides, start=first):
            _log.info(f"\t#{number} : {' '.join(filter_overrides(overrides))}")
            work = Work(number, tuple(overrides), self._context, self._task, self._config, singletons, str(Path.cwd()))
            waiting[remote.options(name=f"twbal {number}").remote(work)] = work
        while waiting:
            # One by one as they end: what is here cannot be lost with a node any more.
            (ended,), _ = ray.wait(list(waiting), num_returns=1)
            work = waiting.pop(ended)
            results[work.number] = self._result(ray, ended, work)
        return [results[number] for number in sorted(results)]

    def _result(self, ray: Any, ended: Any, work: Work) -> JobReturn:
        try:
            result = ray.get(ended)
            assert isinstance(result, JobReturn)
            return result
        except ray.exceptions.RayError as error:  # lost too often, or failed where Hydra does not look
            said = f"{' '.join(work.overrides)}: {type(error).__name__}: {' '.join(str(error).split())}"
            failed = FailedJobError(said, str(self._config.hydra.sweep.dir))
            return JobReturn(overrides=list(work.overrides), status=JobStatus.FAILED, _return_value=failed)


def _joined(address: str) -> Any:
    """The module `ray`, connected to a cluster whose processes have as many threads as this one."""
    try:
        import ray
    except ImportError as error:
        raise SweepError(f"hydra/launcher=ray_cluster needs Ray: {install_advice('sweeps')}.") from error
    passed = {name: os.environ[name] for name in ("PYTHONPATH",) if name in os.environ}
    try:
        _reached(address)
        ray.init(
            address=address, runtime_env={"env_vars": {**asked_threads(), **passed}}, logging_level=logging.WARNING
        )
    except (ConnectionError, RuntimeError, ValueError, OSError) as error:
        what = " ".join(str(error).split())
        raise SweepError(
            f"There is no Ray cluster at {address!r} that can be joined ({type(error).__name__}: {what}). Start one "
            "with `ray start --head`, and give its address by hydra.launcher.address=host:port."
        ) from error
    return ray


def _reached(address: str) -> None:
    """Knock at host:port, where Ray itself would go on knocking for minutes.

    Raises:
        OSError: nobody answers.
    """
    host, _, port = address.rpartition(":")
    if host and port.isdecimal() and "//" not in host:
        socket.create_connection((host.strip("[]"), int(port)), _PATIENCE).close()
