"""Drive the robot on the other end of a link by a policy and log what it does."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path

from hydra import compose
from hydra.utils import instantiate
from omegaconf import DictConfig

from twbal.algorithm.collection import explored
from twbal.algorithm.following import CourseRecord, floor_needed, followed
from twbal.algorithm.rollout import rollout
from twbal.algorithm.settings import RolloutSettings
from twbal.cli.artefacts import COURSE, driven_robot, episode_file, policy_files, read_logs
from twbal.cli.console import gently, next_command, print_result, run_folder, say
from twbal.cli.kept_episodes import INTERRUPTED, keep, keep_interrupted, what_is_kept
from twbal.cli.link_gate import HEED, SAME_ROBOT, heed_last_check, heeds
from twbal.cli.manifest import Manifest, StageWork, perform, read_manifest
from twbal.cli.policy_check import check_torque, keeps_its_place
from twbal.cli.policy_on_board import FOLDER, prepared_link
from twbal.cli.policy_origin import say_doubts_of_policy
from twbal.cli.robot_link import (
    commanded_from_here,
    in_time,
    robot_link,
    why_not_turned,
)
from twbal.cli.signals import stopped_once
from twbal.cli.trial_words import (
    floor_of_course,
    floor_of_excitation,
    floor_without_a_place,
    print_course,
    trial_in_words,
)
from twbal.cli.trials_at_once import (
    Tell,
    WhyStop,
    beside_each_other,
    go_on,
    one_at_a_time,
    robots_at_once,
    until,
)
from twbal.cli.typed_config import recorded, typed
from twbal.core.channels import Channels
from twbal.core.course import Course, HeadingCourse, standing_targets
from twbal.core.episode import Episode, Provenance, in_sentences
from twbal.core.errors import DataError
from twbal.core.feed_forward import FeedForward
from twbal.core.heading_control import HeadingControl
from twbal.core.json_records import read_record, write_record
from twbal.core.robot_parameters import RobotParameters
from twbal.core.yielding import yields_to_pushes
from twbal.diagnosis.usability import FEW_DATA, Amount, enough_for_diagnosis
from twbal.embedded.board_export import HEADER
from twbal.io.logs import read_episode
from twbal.link.frozen_sensors import FrozenSensors
from twbal.link.serial_plant import SerialPlant
from twbal.link.sheet_check import check_robot, check_sensors
from twbal.policies.excitation import Excitation
from twbal.policies.policy import Law, Policy, PolicyOfChannels
from twbal.policies.random import RandomPolicy
from twbal.virtual_robot.process import Launch, launch


def _silent(trial: Episode) -> None:
    """Tell nothing."""


NOT_RECORDED = ("policy.path", "workers", *SAME_ROBOT, HEED)
NOT_IN_EPISODES = ("policy.path", "workers", "link", HEED)  # the same robot may be reached by other ways


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    if cfg.course:
        say(floor_of_course(floor_needed(instantiate(cfg.course))))
    printed = set[int]()

    def tell(episode: Episode) -> None:
        printed.add(episode.provenance.trial)
        print(trial_in_words(episode), flush=True)

    manifest = run(cfg, out, tell=tell)
    for episode in (read_episode(out / made.path) for made in manifest.outputs if made.path.endswith(".mcap")):
        if episode.provenance.trial not in printed:
            print(f"{trial_in_words(episode)}, driven before")
    if (out / COURSE).is_file():
        print_course(read_record(CourseRecord, out / COURSE).trials)
    print_result(manifest, out, _following(cfg, out))


def _following(cfg: DictConfig, out: Path) -> str:
    """The next command: where the policy was searched on a model, its correction; else a diagnosis.

    Trials that are too short for one may still tell `identify` something, unless there is hardly anything of them.
    """
    for policy in policy_files(cfg.policy):
        models = _searched_on(policy)
        if models and models[0].is_file():
            return next_command("fit-diff-gp", {"dynamics": models[0], "episodes": out}, "robot", "state")
    usual, trials = compose("diagnose"), read_logs([out])
    if enough_for_diagnosis(trials, Amount(usual.min_length, usual.min_samples)):
        return next_command("diagnose", {"episodes": out}, "robot", "sim")
    if max(map(len, trials)) >= FEW_DATA.min_length:
        return next_command("identify", {"episodes": out}, "robot", "sim")
    return next_command("real-rollout", gently(cfg.policy.get("command_width")), "robot", "link")


def _searched_on(policy: Path) -> list[Path]:
    """The models that a policy was searched on, by the manifest beside it; none where it has none that can be read."""
    try:
        searched = read_manifest(policy.parent)
    except DataError:
        return []
    return [Path(model.path) for model in searched.inputs.get("dynamics", ())] if searched else []


def run(cfg: DictConfig, out: Path, launch: Launch = launch, advise: bool = True, tell: Tell = _silent) -> Manifest:
    """Drive the trials that `cfg` asks for and log them to `out`/episodes, unless they are there already.

    Args:
        cfg: of this stage.
        out: the run folder.
        launch: starts the virtual robot, where `cfg` asks for one.
        advise: whether a robot whose link was never checked is worth a sentence.
        tell: is called with each trial as soon as it is logged.
    """
    settings = typed(RolloutSettings, cfg)
    robot: RobotParameters = instantiate(cfg.robot)
    policy: Policy = instantiate(cfg.policy)
    if settings.yield_to_pushes is None and isinstance(policy, RandomPolicy | Excitation):
        settings = replace(settings, yield_to_pushes=False)  # a test signal is no push
    check_torque(policy, robot)
    say_doubts_of_policy(policy, policy_files(cfg.policy), robot)
    if isinstance(policy, Excitation):
        say(floor_of_excitation(policy, settings.steps * robot.control_period))
    law, policy = policy, explored(policy, settings, robot.torque_limit)
    provenance = driven_robot(robot, cfg.policy, settings.seed, recorded(cfg, NOT_IN_EPISODES))
    inputs = {"policy": policy_files(cfg.policy)}
    step = StageWork("real-rollout", out, recorded(cfg, NOT_RECORDED), inputs, settings.seed)
    channels, course = instantiate(cfg.state), instantiate(cfg.course) if cfg.course else None
    if course is not None:
        channels.index("position")  # raises where the policy cannot see how far it is off
    if isinstance(law, Law) and isinstance(law, PolicyOfChannels) and not keeps_its_place(law):
        steps = settings.steps if course is None else course.steps(robot.control_period)
        say(floor_without_a_place(law, steps * robot.control_period))

    before = read_manifest(out)
    cut_short = before is not None and not before.complete

    def drive() -> list[Path]:
        if cut_short:
            say(what_is_kept(out))
        link = prepared_link(cfg, robot, channels, policy, out / FOLDER, launch)
        open_link = partial(_checked_link, cfg, link, launch, robot, advise)
        missing = [trial for trial in settings.numbers if not episode_file(out / "episodes", trial).exists()]
        robots = 1 if course else robots_at_once(link, len(missing), int(cfg.workers))
        driven = partial(record, robot=robot, policy=policy, channels=channels, provenance=provenance, out=out)
        if robots == 1:
            logs = driven(open_link, settings=settings, course=course, tell=tell)
        else:
            with stopped_once(), ExitStack() as stack:  # here, as only the main thread hears Ctrl-C while one starts
                plants = [stack.enter_context(open_link()) for _ in range(robots)]
                tell_one = one_at_a_time(tell)
                logs = beside_each_other(
                    [
                        partial(driven, partial(nullcontext, plant), settings=part, tell=tell_one)
                        for plant, part in zip(plants, settings.parts(robots), strict=True)
                    ]
                )
        made = [*logs, *(out / FOLDER).glob(HEADER)]
        return made if course is None else [*made, *_judge(logs, course, robot, out)]

    return perform(step, drive)


@contextmanager
def _checked_link(
    cfg: DictConfig, link: DictConfig, launch: Launch, robot: RobotParameters, advise: bool
) -> Iterator[SerialPlant]:
    """The link, if nothing speaks against arming the robot."""
    with robot_link(link, launch) as plant:
        if heeds(cfg, cfg.link):
            heed_last_check(plant, robot, advise)
        yield plant


def _judge(logs: Sequence[Path], course: Course, robot: RobotParameters, out: Path) -> list[Path]:
    """Write and draw how the trials followed the course; returns the files."""
    from twbal.viz.canvas import save  # a second, and few rollouts draw anything
    from twbal.viz.following_figure import following_figure

    episodes = [read_episode(log) for log in logs]
    figures = [out / "figures" / f"{log.stem}.svg" for log in logs]
    for episode, figure in zip(episodes, figures, strict=True):
        save(following_figure(episode, figure.stem, robot.wheel_radius), figure)
    trials = tuple(followed(episode, course, robot.wheel_radius) for episode in episodes)
    write_record(out / COURSE, CourseRecord(trials))
    return [out / COURSE, *figures]


def record(
    open_link: Callable[[], AbstractContextManager[SerialPlant]],
    robot: RobotParameters,
    policy: Policy,
    channels: Channels,
    settings: RolloutSettings,
    provenance: Provenance,
    out: Path,
    course: Course | None = None,
    tell: Tell = _silent,
    why_stop: WhyStop = go_on,
) -> list[Path]:
    """Drive the trials whose logs are not there yet; returns the logs of all.

    A trial that the person, a lost link, a faulty policy or a trial beside it ended is logged to `out`/interrupted, and
    ends the stage.

    Args:
        open_link: opens the robot.
        robot: its data sheet.
        policy: that drives it.
        channels: the state.
        settings: which trials, and how long.
        provenance: of all trials but for their number.
        out: for the logs.
        course: that the robot is to follow, to whose end each trial lasts; None: it is to stay where it was put.
        tell: is called with each trial as soon as it is logged.
        why_stop: tells whether the trial that is driven is to end now, as the last one.

    Raises:
        LinkError: the robot cannot be reached, fell silent, or does not confirm that it has stopped.
        ConfigError: it is not the robot of the data sheet.
        DataError: the policy commanded what is no number, or an episode cannot be written.
        KeyboardInterrupt: the person pressed Ctrl-C, or the process was asked to end.
    """
    with stopped_once(), open_link() as plant, in_time(plant):
        check_robot(plant, robot)
        check_sensors(plant, channels.names)
        steps = settings.steps if course is None else course.steps(plant.control_period)
        headings = None if course is None else _heading_course(course, plant)
        targets = course or standing_targets(settings.yield_to_pushes, robot, channels.names)
        yields = yields_to_pushes(settings.yield_to_pushes, robot)
        for trial in settings.numbers:
            file = episode_file(out / "episodes", trial)
            if file.exists() or why_stop():
                continue
            its_own = replace(provenance, robot=plant.robot_name, trial=trial)
            heading = HeadingControl(robot, headings, plant.has_yaw_gyro) if headings else None
            watch = until(why_stop, FrozenSensors())
            drive = partial(rollout, plant, policy, channels, steps, settings.tilt_limit, its_own, targets, heading)
            episode = drive(watch=watch, feed_forward=FeedForward.of_robot(robot), yields=yields)
            with_line = replace(episode, events=tuple(sorted((*episode.events, *plant.events))))
            if episode.outcome in INTERRUPTED:
                keep_interrupted(with_line, out / "interrupted", why=in_sentences(episode.events))
            keep(file, with_line)
            tell(with_line)
    return [episode_file(out / "episodes", trial) for trial in settings.numbers]


def _heading_course(course: Course, plant: SerialPlant) -> HeadingCourse | None:
    """Where the heading is to go; None where nothing can control it, which is said."""
    if course.heading is None:
        if course.turns:
            say("course.control_heading=false: the turns of the course are left out")
        return None
    if not (why := why_not_turned(plant)):
        return course.heading
    left_out = "the turns of the course are left out" if course.turns else "nothing controls its heading"
    say(f"the robot {plant.robot_name} cannot be turned: {why}; {left_out}")
    return None


def check_robot_is_there(cfg: DictConfig) -> None:
    """Shake hands with a robot on a port, and leave it alone again, before work is done whose result is meant for it.

    A virtual robot of the run's own is started when it is needed.

    Args:
        cfg: of a stage that drives a robot later, with `link`, `robot` and `real_rollout`.

    Raises:
        LinkError: it cannot be reached.
        ConfigError: it is not the robot of the data sheet.
        CheckError: the last check of its link speaks against arming it.
    """
    if "port" in cfg.link:
        with stopped_once(), robot_link(commanded_from_here(cfg.link), launch) as plant:
            robot = instantiate(cfg.robot)
            check_robot(plant, robot)
            if heeds(cfg.real_rollout, cfg.link):
                heed_last_check(plant, robot)
