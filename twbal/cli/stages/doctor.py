"""Look at everything on this computer that must be right before a robot is driven."""

import os
from dataclasses import dataclass
from pathlib import Path

from omegaconf import DictConfig

from twbal.cli.conf_folder import conf_folder
from twbal.cli.doctor.packages import kernels_check, package_checks, pinned_versions
from twbal.cli.doctor.ports import port_checks
from twbal.cli.doctor.timing import (
    clock_check,
    lateness,
    lateness_check,
    line_check,
    load_check,
    priority_check,
    sleep_check,
)
from twbal.cli.typed_config import typed
from twbal.core.check import Check, check_lines, problems
from twbal.core.errors import CheckError


@dataclass(frozen=True)
class Settings:
    """See conf/doctor.yaml."""

    sysfs: str
    timing: float


def main(cfg: DictConfig) -> None:
    """Print a line for each thing; writes nothing.

    Raises:
        CheckError: something is a problem.
    """
    checks = look(typed(Settings, cfg), cfg.link.get("port"))
    print(*check_lines(checks), sep="\n")
    if wrong := problems(checks):
        raise CheckError(
            f"This computer is not ready to drive a robot: {', '.join(wrong)}. The lines above say what to do."
        )


def look(settings: Settings, port: str | None) -> list[Check]:
    """All checks, in the order in which one would mend them.

    Args:
        settings: of this stage.
        port: of the robot; None: a virtual one.
    """
    from twbal.core import compiled  # here, as it loads the compiler

    pins = pinned_versions(conf_folder().parent / "constraints.txt")
    return [
        *package_checks(pins),
        kernels_check(Path(os.environ.get("NUMBA_CACHE_DIR") or compiled.cache_folder())),
        *port_checks(port, Path(settings.sysfs)),
        priority_check(),
        sleep_check(),
        line_check(),
        load_check(len(os.sched_getaffinity(0)), os.getloadavg()[0]),
        clock_check(),
        lateness_check(lateness(settings.timing)),
    ]
