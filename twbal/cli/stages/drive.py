"""Steer the robot on the other end of a link in real time, by keys or a gamepad."""

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, TextIO

from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.algorithm.rollout import rollout
from twbal.cli.artefacts import driven_robot, episode_file, policy_files
from twbal.cli.console import next_command, print_result, run_folder, say
from twbal.cli.kept_episodes import INTERRUPTED, keep, keep_interrupted
from twbal.cli.link_gate import HEED, SAME_ROBOT, heed_last_check, heeds
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.policy_check import check_torque
from twbal.cli.policy_on_board import FOLDER, prepared_link
from twbal.cli.policy_origin import say_doubts_of_policy
from twbal.cli.robot_link import in_time, robot_link, why_not_turned
from twbal.cli.signals import never_suspended, on_hang_up, stopped_once
from twbal.cli.trial_words import end_in_words
from twbal.cli.typed_config import recorded, typed
from twbal.core.channels import Channels
from twbal.core.episode import Episode, Event, Outcome, Provenance
from twbal.core.feed_forward import FeedForward
from twbal.core.heading_control import HeadingControl
from twbal.core.plant import Observation
from twbal.core.robot_parameters import RobotParameters
from twbal.core.yielding import yields_to_pushes
from twbal.io.logs import read_episode
from twbal.link.frozen_sensors import FrozenSensors
from twbal.link.protocol import Clock
from twbal.link.serial_plant import SerialPlant
from twbal.link.sheet_check import check_robot, check_sensors
from twbal.policies.policy import Policy
from twbal.steering.gamepad import gamepad
from twbal.steering.joystick import Layout
from twbal.steering.keyboard import Keyboard, without_halting_keys
from twbal.steering.limits import SteeringLimits
from twbal.steering.pace import Pace
from twbal.steering.source import TERMINAL, Source
from twbal.steering.status import Display, StatusLine
from twbal.steering.steered import Moment, SteeredCourse
from twbal.virtual_robot.process import Launch, launch
from twbal.viz.canvas import save
from twbal.viz.following_figure import following_figure
from twbal.viz.live.sample import Sampler
from twbal.viz.live.view import FILE, LiveView, check_target, view_command

NOT_RECORDED = ("policy.path", *SAME_ROBOT, HEED, "input", "view")
NOT_IN_EPISODES = ("policy.path", "link", HEED)
KEYBOARD = "keyboard"
_RESTS = 0.2  # of the speed limit, below which a robot counts as at rest
KEY_HELP = "w s faster slower | a d left right | Enter as it is | space rest | q rest and end | x motors off"


@dataclass(frozen=True)
class DriveSettings:
    """How long is driven, and from where; see conf/drive.yaml."""

    seed: int
    trial: int
    seconds: float | None
    tilt_limit: float
    input: str
    view: str | None
    pace: float
    yield_to_pushes: bool | None


class Steered(NamedTuple):
    """What is driven, and by what.

    Attributes:
        robot: its data sheet.
        policy: that drives it.
        channels: the state.
        limits: of the references.
    """

    robot: RobotParameters
    policy: Policy
    channels: Channels
    limits: SteeringLimits


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    driven = list[Path]()
    manifest = run(cfg, out, tell=driven.append)
    log = next(out / made.path for made in manifest.outputs if made.path.endswith(".mcap"))
    episode = read_episode(log)
    before = "" if driven else ", driven before; without hydra.run.dir, or with another one, it drives again"
    print(f"{end_in_words(episode)}{before}")
    for event in episode.events:
        print(f"  {event.time:7.2f} s  {event.text}")
    print_result(manifest, out, next_command("plot", {"episode": log}, "robot", "sim"))


def run(
    cfg: DictConfig, out: Path, launch: Launch = launch, tell: Callable[[Path], None] = lambda log: None
) -> Manifest:
    """Have a person drive, and log it to `out`/episodes, unless that is done there already.

    Args:
        cfg: of this stage.
        out: the run folder.
        launch: starts the virtual robot, where `cfg` asks for one.
        tell: is given the log where the robot is driven now.
    """
    settings = typed(DriveSettings, cfg)
    driven = Steered(*(instantiate(cfg[part]) for part in ("robot", "policy", "state", "steering")))
    check_torque(driven.policy, driven.robot)
    say_doubts_of_policy(driven.policy, policy_files(cfg.policy), driven.robot)
    driven.channels.index("position")  # raises where the policy cannot see how far it is off
    provenance = driven_robot(driven.robot, cfg.policy, settings.seed, recorded(cfg, NOT_IN_EPISODES))
    layout: Layout = instantiate(cfg.gamepad)
    inputs = {"policy": policy_files(cfg.policy)}
    step = StageWork("drive", out, recorded(cfg, NOT_RECORDED), inputs, settings.seed)
    if settings.view is not None:
        check_target(settings.view)

    recording = out / "view" / f"trial_{settings.trial:03d}.rrd"

    def drive() -> list[Path]:
        log = episode_file(out / "episodes", settings.trial)
        if not log.exists():  # else only the figure is missing: it was broken off after the drive
            log = now()
            tell(log)
        figure = out / "figures" / f"{log.stem}.svg"
        save(following_figure(read_episode(log), figure.stem, driven.robot.wheel_radius), figure)
        return [log, figure, *([recording] if recording.exists() else [])]

    def now() -> Path:
        link = prepared_link(cfg, driven.robot, driven.channels, driven.policy, out / FOLDER, launch)
        with (
            stopped_once(),
            _live_view(settings.view, driven.robot, recording) as view,
            _source(settings.input, layout) as source,
            robot_link(link, launch) as plant,
        ):
            check_robot(plant, driven.robot)
            check_sensors(plant, driven.channels.names)
            if heeds(cfg, cfg.link):
                heed_last_check(plant, driven.robot)
            with in_time(plant):
                named = replace(provenance, robot=plant.robot_name)
                return _record(plant, source, driven, settings, named, out, view)

    return perform(step, drive)


@contextmanager
def _live_view(target: str | None, robot: RobotParameters, recording: Path) -> Iterator[LiveView | None]:
    """What draws the drive, ready before the robot is armed; what a person should know of it is said at its end."""
    if target is None:
        yield None
        return
    if target == FILE:
        recording.parent.mkdir(parents=True, exist_ok=True)
    say("the live view starts")
    with LiveView(view_command(robot, recording if target == FILE else target)) as view:
        try:
            yield view
        finally:
            if words := view.close():
                say(words)


@contextmanager
def _source(asked: str, layout: Layout) -> Iterator[Source]:
    """Where keys or sticks come from; a terminal that is closed ends the drive in good order, and none halts it."""
    with ExitStack() as stack:
        source: Source
        if asked == KEYBOARD:
            source = stack.enter_context(Keyboard())
        else:
            source = stack.enter_context(gamepad(Path(asked), layout))
            stack.enter_context(without_halting_keys())
            stack.enter_context(never_suspended())
        stack.enter_context(on_hang_up(lambda: source.lose(TERMINAL)))
        shown = [stream for stream in (sys.stdout, sys.stderr) if stream.isatty()]
        stack.callback(_let_go_of_lost_terminal, source, shown)
        yield source


def _let_go_of_lost_terminal(source: Source, shown: Sequence[TextIO]) -> None:
    """What is printed later on streams that showed it there goes nowhere, instead of being an error."""
    if source.lost and source.name == TERMINAL:
        with open(os.devnull, "w") as nowhere:
            for stream in shown:
                os.dup2(nowhere.fileno(), stream.fileno())


def _record(
    plant: SerialPlant,
    source: Source,
    driven: Steered,
    settings: DriveSettings,
    provenance: Provenance,
    out: Path,
    view: LiveView | None,
) -> Path:
    """Drive, and log it; returns the log.

    Raises:
        LinkLostError: the robot fell silent.
        DataError: the policy commanded what is no number, or the episode cannot be written.
        KeyboardInterrupt: the person pressed Ctrl-C.
    """
    log = episode_file(out / "episodes", settings.trial)
    with closing(Display()) as display:
        course = _course(plant, source, driven, settings, display, view)
        heading = None
        if driven.limits.control_heading and not (why := why_not_turned(plant)):
            heading = HeadingControl(driven.robot, course.headings, plant.has_yaw_gyro)
        elif driven.limits.control_heading:
            say(f"the robot {plant.robot_name} cannot be turned: {why}; keys for turns do nothing")
        if settings.input == KEYBOARD:
            say(KEY_HELP)
        frozen = FrozenSensors()
        episode = rollout(
            *(plant, driven.policy, driven.channels, sys.maxsize, settings.tilt_limit, provenance, course, heading),
            watch=lambda *seen: frozen(*seen) or course.watch(*seen),
            feed_forward=FeedForward.of_robot(driven.robot),
            yields=yields_to_pushes(settings.yield_to_pushes, driven.robot),
        )
    why = episode.events[-1].text if episode.events else ""
    events = (*episode.events, *plant.events, *course.events, *_drives_on(episode, driven))
    episode = replace(episode, events=tuple(sorted(events, key=lambda event: event.time)))
    by_key = course.steering.stopped and episode.outcome is Outcome.STOPPED
    if episode.outcome in INTERRUPTED and not by_key:
        keep_interrupted(episode, out / "interrupted", why)
    keep(log, episode)
    return log


def _drives_on(episode: Episode, driven: Steered) -> list[Event]:
    """A robot that its policy does not hold is not at rest when its reference is."""
    last = Observation(*episode.observations[-1].tolist())
    speed = driven.robot.wheel_radius * (last.wheel_rate + last.tilt_rate)
    if episode.outcome is not Outcome.COMPLETED or abs(speed) <= _RESTS * driven.limits.driving.speed:
        return []
    return [Event(last.time, f"the robot itself still drives at {speed:+.2f} m/s: the policy does not hold it")]


def _course(
    plant: SerialPlant,
    source: Source,
    driven: Steered,
    settings: DriveSettings,
    display: Display,
    view: LiveView | None,
) -> SteeredCourse:
    """A robot that waits for its host is driven as fast as the clock of the person goes."""
    status = StatusLine(driven.limits, driven.robot.wheel_radius, display.write)
    pace = Pace(settings.pace)
    sampler = Sampler(driven.robot.wheel_radius)

    def wait(time: float) -> None:
        if plant.clock is Clock.LOCKSTEP:
            pace.wait(time)

    def show(moment: Moment) -> None:
        status.show(moment)
        if view is not None:
            asked = moment.asked.speed * driven.limits.driving.speed
            view.show(sampler.sample(moment.seen, moment.reference, moment.heading, moment.command, asked))

    return SteeredCourse(driven.limits, source, settings.seconds, wait, show)
