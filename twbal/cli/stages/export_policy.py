"""Write a policy as a C header for the robot's own processor, and say what it takes there."""

from dataclasses import dataclass
from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal import __version__
from twbal.cli.artefacts import POLICY, policy_files, policy_hash
from twbal.cli.console import print_made, print_result, run_folder, say
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.policy_check import check_torque
from twbal.cli.policy_origin import say_doubts_of_policy
from twbal.cli.recorded_period import drive_next
from twbal.cli.typed_config import recorded, typed
from twbal.core.errors import ConfigError
from twbal.core.json_records import read_record, write_record
from twbal.core.streams import Stream, generator
from twbal.embedded.board_export import OnBoard, export_to
from twbal.io.checkpoint import save_checkpoint

NOT_RECORDED = ("policy.path",)
ON_BOARD = "on_board.json"


@dataclass(frozen=True)
class Settings:
    """See conf/export_policy.yaml."""

    seed: int
    target: str
    distil: int | None
    states: int
    tilt_limit: float


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    manifest = run(cfg, out)
    on_board = read_record(OnBoard, out / ON_BOARD)
    if cfg.distil is not None and on_board.distillation is None:
        print(f"the policy has no more than {cfg.distil} basis functions with a weight: all are left")
    print(*_lines(on_board), sep="\n")
    made = out / POLICY if cfg.distil is not None else policy_files(cfg.policy)[0]
    try:
        check_torque(instantiate(cfg.policy), instantiate(cfg.robot))
    except ConfigError as error:
        print_made(manifest, out)
        say(f"real-rollout would refuse it: {error}")
    else:
        print_result(manifest, out, drive_next(made, cfg.robot.control_period))


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Write the policy that `cfg` names into `out` as C, unless it is there already."""
    settings = typed(Settings, cfg)
    robot, channels, policy = (instantiate(cfg[part]) for part in ("robot", "state", "policy"))
    say_doubts_of_policy(policy, policy_files(cfg.policy), robot)
    origin = f"Made by twbal {__version__} export-policy for {robot.name}; policy {policy_hash(cfg.policy)[:16]}."
    rng = generator(Stream.ON_BOARD, settings.seed)
    files = {"policy": policy_files(cfg.policy)}
    step = StageWork("export-policy", out, recorded(cfg, NOT_RECORDED), files, settings.seed)

    def make() -> list[Path]:
        made = export_to(
            out, policy, channels, robot, settings.tilt_limit, origin, rng, settings.distil, settings.states
        )
        if made.on_board.agreement is not None:
            say(f"a call of the compiled header takes {1e6 * made.seconds_per_call:.2f} µs on this machine")
        write_record(out / ON_BOARD, made.on_board)
        if settings.distil is None:
            return [*made.files, out / ON_BOARD]
        save_checkpoint(out / POLICY, "policy", made.policy.to_payload())
        return [*made.files, out / ON_BOARD, out / POLICY]

    return perform(step, make)


def _lines(on_board: OnBoard) -> list[str]:
    """What is said of an exported policy."""
    cost, found = on_board.distillation, on_board.agreement
    lines = []
    if cost is not None:
        lines.append(
            f"{cost.basis} of {cost.former_basis} basis functions are left: the command differs by "
            f"{100 * cost.rms_command:.2g} % of its limit (root mean square; at most {100 * cost.max_command:.2g} %), "
            f"the gain by {100 * cost.rms_gain:.2g} % of its largest"
        )
    if found is None:
        lines.append("not compiled here: there is no C compiler, or states=0; run policy_selftest.c before the robot")
    else:
        lines.append(
            f"equal to the policy at {found.states} states: off by at most {found.max_error:.2g} N·m "
            f"({100 * found.max_of_bound:.0f} % of what single precision explains), gain by "
            f"{100 * found.max_gain_error:.1g} % of the largest"
        )
    rows = [f"{n.board:<12}{n.flash:>9}{n.memory:>9}{n.cycles:>10}{n.microseconds:>10.0f}" for n in on_board.needs]
    lines += ["board           flash      RAM    cycles   µs/call   (estimates)", *rows]
    return lines + [
        f"{n.board}: too much {n.lacks}; half is for the rest of the firmware. Fewer basis functions: distil=<number>"
        for n in on_board.needs
        if not n.fits
    ]
