"""Draw an episode: its channels over time, and a film of the robot, with others or with the simulation beside it."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import cast

import numpy as np
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from twbal.cli.artefacts import paths_in
from twbal.cli.console import chosen_overrides, print_result, run_folder
from twbal.cli.manifest import Manifest, StageWork, perform
from twbal.cli.typed_config import members, recorded, typed
from twbal.core.episode import Episode
from twbal.core.errors import ConfigError, LogError
from twbal.core.files import one_within
from twbal.core.gaussian import Array
from twbal.core.palette import GOOD, PREDICTED, REAL
from twbal.core.plant import Observation
from twbal.core.robot_parameters import RobotParameters
from twbal.core.robot_sheet import VALUES
from twbal.core.start_pose import InitialState
from twbal.effects.effect import Effect
from twbal.io.logs import read_episode
from twbal.io.recorded_sheet import recorded_robot
from twbal.sim.film import Role, film
from twbal.sim.replay import ReplayStart, replay
from twbal.sim.restart_state import RestartState
from twbal.viz.animation import write_film
from twbal.viz.canvas import save
from twbal.viz.episode_figures import Stretch, courses_figure
from twbal.viz.following_figure import following_figure
from twbal.viz.live.sample import samples_of
from twbal.viz.live.shape import Shape
from twbal.viz.live.view import check_installed

NOT_RECORDED = ("episode", "compare_with")
_RECORDED_AT_ONCE = 50  # control periods; the way behind the robot is drawn once for these
_FRAMES_A_LINE = 25  # lines of progress: a film of 10 s takes a minute or more
_COLOURS = (REAL, PREDICTED, GOOD)
_MOTION = [Observation._fields.index(name) for name in ("tilt", "tilt_rate", "wheel_angle", "wheel_rate")]
_POSE = [Observation._fields.index(name) for name in ("tilt", "wheel_angle")]


@dataclass(frozen=True)
class Settings:
    """See conf/plot.yaml."""

    captions: list[str]
    simulate: bool
    resync: float
    film: bool
    seconds: float
    frame_rate: float
    width: int
    height: int
    rrd: bool


def main(cfg: DictConfig) -> None:
    """Run the stage in Hydra's run folder."""
    out = run_folder()
    for path in (Path(cfg.episode), *paths_in(cfg.compare_with)):
        if path.is_dir():
            raise LogError(f"{path} is a folder; expected is an episode log{one_within(path, '.mcap')}.")
    if not chosen_overrides("robot"):
        cfg = _with_recorded_robot(cfg)
    print_result(run(cfg, out), out, f"look at the files in {out}")


def _with_recorded_robot(cfg: DictConfig) -> DictConfig:
    """The configuration with the robot that the log was recorded with, if the log says it."""
    robot = recorded_robot(read_episode(Path(cfg.episode)).provenance)
    if robot is None or robot == instantiate(cfg.robot):
        return cfg
    print(f"  the robot is the one that the log was recorded with, {robot.name!r}", flush=True)
    return cast(DictConfig, OmegaConf.merge(cfg, {"robot": {name: getattr(robot, name) for name in ("name", *VALUES)}}))


def run(cfg: DictConfig, out: Path) -> Manifest:
    """Draw what `cfg` names into `out`, unless that is done there already."""
    settings = typed(Settings, cfg)
    files = [Path(cfg.episode), *paths_in(cfg.compare_with)]
    if len(files) + settings.simulate > len(_COLOURS):
        raise ConfigError(f"A film has room for {len(_COLOURS)} robots; found are {len(files) + settings.simulate}.")
    if settings.rrd:
        check_installed()
    robot: RobotParameters = instantiate(cfg.robot)
    effects: Sequence[Effect] = members(cfg.sim.effects)
    step = StageWork("plot", out, recorded(cfg, NOT_RECORDED), {"episode": files}, 0)
    return perform(step, lambda: _draw(files, robot, effects, float(cfg.sim.physics_step), settings, out))


def _draw(
    files: Sequence[Path],
    robot: RobotParameters,
    effects: Sequence[Effect],
    physics_step: float,
    settings: Settings,
    out: Path,
) -> list[Path]:
    episodes = [read_episode(file) for file in files]
    first = episodes[0]
    shows_robot = settings.simulate or settings.film or settings.rrd or first.references is not None
    if shows_robot and abs(first.control_period - robot.control_period) > 1e-6:
        raise ConfigError(
            f"{files[0]} has a control period of {first.control_period} s, robot {robot.name!r} one of "
            f"{robot.control_period} s. Choose the robot by robot=..., or draw its channels alone by "
            "simulate=false film=false."
        )
    pieces: list[Stretch] = []
    if settings.simulate:
        print("  simulating what the episode shows", flush=True)
        pieces = _simulated(first, robot, effects, physics_step, settings.resync)
    made = [out / "figures" / "courses.svg"]
    save(courses_figure(first, files[0].stem, pieces), made[0])
    if first.references is not None:
        made.append(out / "figures" / "following.svg")
        save(following_figure(first, files[0].stem, robot.wheel_radius), made[-1])
    if settings.film:
        names = [caption or file.stem for caption, file in zip_longest(settings.captions[: len(files)], files)]
        tracks = [(episode.observations[:, 0], _poses(episode.observations, robot)) for episode in episodes]
        if pieces:
            names.append("simulated")
            tracks.append(_joined(pieces, robot))
        made.append(out / "film.gif")
        _film(robot, names, tracks, settings, made[-1])
    if settings.rrd:
        made.append(out / "episode.rrd")
        _record(first, robot, made[-1])
    return made


def _simulated(
    episode: Episode, robot: RobotParameters, effects: Sequence[Effect], physics_step: float, resync: float
) -> list[Stretch]:
    """The simulation under the recorded commands, put back onto the measured motion every `resync` seconds."""
    steps = max(1, round(resync / episode.control_period))
    starts, commands = [], []
    tilt, tilt_rate, wheel_angle, wheel_rate = episode.observations[:, _MOTION].T
    motion = np.column_stack([tilt, tilt_rate, robot.wheel_radius * (tilt_rate + wheel_rate)])
    begins = range(0, len(episode) - steps + 1, steps)
    for t in begins:
        starts.append(
            ReplayStart(
                initial=InitialState(*motion[t].tolist()),
                restart=RestartState(float(wheel_angle[t])),
                past_commands=episode.commands[:t],
                past_motion=motion[:t],
            )
        )
        commands.append(episode.commands[t : t + steps])
    if not starts:
        return []
    found = replay(robot, effects, physics_step, starts, np.array(commands))
    times = episode.observations[:, 0]
    return [Stretch(times[t : t + steps + 1], course) for t, course in zip(begins, found, strict=True)]


def _record(episode: Episode, robot: RobotParameters, path: Path) -> None:
    """The episode as a live view shows a drive."""
    from twbal.viz.live.scene import save as recording  # of an extra

    path.parent.mkdir(parents=True, exist_ok=True)
    scene, stream = recording(Shape.of(robot), path)
    for event in episode.events:
        scene.tell(event.time, event.text)
    samples = samples_of(episode, robot.wheel_radius)
    for start in range(0, len(samples), _RECORDED_AT_ONCE):
        scene.draw(samples[start : start + _RECORDED_AT_ONCE])
    stream.disconnect()


def _poses(observations: Array, robot: RobotParameters) -> Array:
    """Position of the axle, tilt and wheel angle, (T + 1, 3)."""
    tilt, wheel = observations[:, _POSE].T
    return np.column_stack([robot.wheel_radius * (wheel + tilt - wheel[0] - tilt[0]), tilt, wheel])


def _joined(pieces: Sequence[Stretch], robot: RobotParameters) -> tuple[Array, Array]:
    """Pieces of a course as one, each up to where the next begins."""
    time = np.concatenate([piece.time[:-1] for piece in pieces])
    return time, _poses(np.concatenate([piece.observations[:-1] for piece in pieces]), robot)


def _film(
    robot: RobotParameters, names: Sequence[str], tracks: Sequence[tuple[Array, Array]], settings: Settings, path: Path
) -> None:
    """A robot whose track has ended stays as it lies."""
    end, each = min(max(float(time[-1]) for time, _ in tracks), settings.seconds), 1.0 / settings.frame_rate
    times = np.arange(0.0, max(end, each), each)
    cast = [
        Role(poses[np.minimum(np.searchsorted(time, times), len(time) - 1)], colour.parts)
        for (time, poses), colour in zip(tracks, _COLOURS, strict=False)
    ]
    drawn = []
    for frame in film(robot, cast, settings.width, settings.height):
        drawn.append(frame)
        if len(drawn) % _FRAMES_A_LINE == 0 or len(drawn) == len(times):
            print(f"  {len(drawn)} of {len(times)} frames of the film are drawn", flush=True)
    who = ", ".join(f"{name} ({colour})" for name, colour in zip(names, ("orange", "blue", "green"), strict=False))
    write_film(path, drawn, each, [f"{time:4.1f} s   {who}" for time in times])
