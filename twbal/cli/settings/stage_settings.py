"""Settings that a stage has for itself, by the stage's name."""

from collections.abc import Mapping

from twbal.cli.settings.kinds import (
    BASES,
    PATH,
    PATHS,
    PATHS_OR_NONE,
    Kind,
    ListOf,
    Number,
    OneOf,
    OrNull,
    Setting,
    SheetAnswer,
    Text,
    Whole,
    YesNo,
)
from twbal.cli.settings.link_settings import CLOCK, SEED
from twbal.cli.settings.robot_settings import CONTROL_PERIODS, PHYSICS_STEP, STEPS, TILT_LIMIT
from twbal.cli.settings.steering_settings import STEERING
from twbal.sheets.questions import QUESTIONS

_SHARE = Number(0.0, 1.0)
_ROUNDS = Whole(0, 1000)
_TRIALS = Whole(1, 100_000)
_PIXELS = Whole(16, 8192, "pixels")


def _common(key: str, kind: Kind, meaning: str) -> Setting:
    return Setting(key, kind, meaning, common=True)


_SEED = _common("seed", SEED, "seed of all that is drawn at random")
_FIRST_TRIAL = Setting("first_trial", Whole(0, 1_000_000_000), "number of the first, which draws start and noise")
_EXPLORATION = _common("exploration", _SHARE, "sd of noise on the command, per torque limit")
_WORKERS = Whole(0, 1024)
_YIELDS = Setting("yield_to_pushes", OrNull(YesNo()), "a pushed robot rolls on and brakes gently; null: by its sheet")
_HEED = Setting("heed_check", OrNull(YesNo()), "the last check-link counts; null: for a robot on a port")

STAGES: Mapping[str, tuple[Setting, ...]] = {
    "sim-collect": (
        _SEED,
        _common("rollouts", _TRIALS, "rollouts that are driven"),
        _FIRST_TRIAL,
        _common("steps", STEPS, "length of a rollout, at most"),
        _EXPLORATION,
        Setting("workers", _WORKERS, "processes; 0: one a core, where worth it"),
    ),
    "fit-sim-gp": (_SEED, _common("episodes", PATHS, "run folders, folders of logs, or logs")),
    "optimise-policy": (
        _SEED,
        _common("dynamics", PATHS, "model.pt, or several that one policy is to serve"),
        _common("initial_policies", PATHS_OR_NONE, "policy.pt of earlier iterations, oldest first"),
        Setting("residual_on", OrNull(PATH), "policy.pt of lqr that stays beneath; null: none"),
        Setting("known", OrNull(PATH), "run folder of identify; null: the robot by its sheet"),
        Setting("calibration_episodes", PATHS_OR_NONE, "real rollouts of the one policy in `initial_policies`"),
        Setting("optimise", YesNo(), "false: only ranks the policies in `initial_policies`"),
        Setting("with_margin", YesNo(), "search for robots that changed, too"),
        Setting("set_aside", ListOf(Whole(0, 1000), 0, 1000), "numbers of `initial_policies` that are no candidates"),
        Setting("workers", _WORKERS, "threads; 0: one a core"),
    ),
    "lqr": (
        _common("episodes", PATHS_OR_NONE, "the robot's; none: the data sheet's regulator"),
        _common("command_width", Number(1e-4, 1e4), "command that costs as a width does, per torque limit"),
    ),
    "train-agent": (
        _SEED,
        _common("steps", Whole(1, 1_000_000_000, CONTROL_PERIODS), "time that the agent drives to learn"),
        _common("trials", Whole(0, 100_000), "simulated trials of what comes of it"),
    ),
    "real-rollout": (
        _SEED,
        _common("trials", _TRIALS, "trials that are driven"),
        _FIRST_TRIAL,
        _common("steps", STEPS, "length of a trial, at most"),
        _EXPLORATION,
        Setting("exploration_steps", OrNull(Whole(0, 1_000_000, CONTROL_PERIODS)), "time that has noise; null: all"),
        _YIELDS,
        Setting("workers", _WORKERS, "virtual robots in lockstep that drive trials at a time; 0: one a core"),
        _HEED,
    ),
    "drive": (
        _SEED,
        Setting("trial", Whole(0, 1_000_000_000), "number of the drive, which draws start and noise"),
        _common("seconds", OrNull(Number(0.01, 1e6, "s")), "length; then to rest, and the drive ends; null: no limit"),
        _common("input", Text("keyboard, or path"), "keyboard, or a gamepad: /dev/input/js0, or its recorded events"),
        _common("view", OrNull(Text("window, file, or address")), "a live view: window, file, or a viewer's address"),
        _YIELDS,
        _HEED,
        Setting("pace", Number(0.01, 100.0), "simulated seconds in a second, of a virtual robot in lockstep"),
        *STEERING,
    ),
    "fit-diff-gp": (
        _SEED,
        _common("dynamics", BASES, "model.pt with f, or candidates; null: no f, g learns all"),
        _common("episodes", PATHS, "the robot's run folders, folders of logs, or logs"),
    ),
    "identify": (_common("episodes", PATHS, "the robot's run folders, folders of logs, or logs"),),
    "diagnose": (
        _common("episodes", PATHS, "the robot's run folders, folders of logs, or logs"),
        _common("test_episodes", PATHS_OR_NONE, "episodes that only measure the gap"),
        Setting("horizons", ListOf(Number(0.001, 100.0, "s"), 1, 100), "lengths of the rollouts that measure the gap"),
        Setting("held_out", Number(0.01, 0.9), "share of the data that nothing is fitted to"),
        Setting("starts", Whole(1, 100_000), "number of these rollouts"),
        Setting("bins", Whole(1, 1000), "bins of a quantity in the map of disagreement"),
        Setting("min_length", Whole(2, 1_000_000, CONTROL_PERIODS), "shortest episode that is used"),
        Setting("min_samples", Whole(2, 100_000_000, CONTROL_PERIODS), "shortest length of all episodes together"),
        Setting("max_yaw_rate", Number(0.001, 1e4, "rad/s"), "yaw rate beyond which instants do not count"),
        Setting("max_tilt", TILT_LIMIT, "tilt at which an episode is cut off"),
        Setting("next_experiment", YesNo(), "suggest an experiment where something stays open"),
        Setting("free_form", YesNo(), "look for a function of one variable in what remains"),
    ),
    "evaluate-sim": (
        _SEED,
        _common("sims", OrNull(PATHS), "simulations beside `sim`: files, run folders, or choices"),
        Setting("sims.*", PATH, "the same by name"),
        _common("episodes", PATHS, "the robot's run folders, folders of logs, or logs"),
        _common("horizons", ListOf(Number(0.001, 100.0, "s"), 1, 100), "how far predictions go"),
        Setting("spacing", Number(0.001, 1e4, "s"), "time from one start of a prediction to the next"),
        Setting("starts", Whole(1, 100_000), "predictions of a log, at most"),
        Setting("settling", Number(0.0, 1e4, "s"), "time that a filter has before the first start"),
        Setting("model_error", Number(1e-4, 100.0), "sd of torques that filters reckon with, per rms of the commands"),
        Setting("tilt_offset", Number(0.0, 1.0, "rad"), "sd of a constant that each log's tilt is off by; 0: none"),
        Setting("substeps", Whole(1, 1000), "physics steps of a control period"),
        Setting("blocks", Whole(1, 100_000), "blocks of a log that the bootstrap draws, at most"),
        Setting("min_block", Number(0.001, 1e4, "s"), "length of a block, at least"),
        Setting("max_yaw_rate", Number(0.001, 1e4, "rad/s"), "yaw rate beyond which instants do not count"),
        Setting("max_tilt", TILT_LIMIT, "tilt at which a log is cut off, and a simulated body lies"),
    ),
    "iterate": (
        _SEED,
        _common("updates", _ROUNDS, "updates of model and policy, each by a real rollout"),
        _common("trials", Whole(0, 100_000), "trials of each policy; nothing is learned from them"),
        _common("stop_when_solved", YesNo(), "no more updates once all trials succeed"),
        _common("improve", YesNo(), "one or two more updates after the first policy that solved it, for more margin"),
        Setting(
            "oscillation_limit",
            OrNull(Number(0.001, 3.0, "rad")),
            "swing of the tilt from which on a policy is improved once more",
        ),
        Setting("min_update_time", Number(0.0, 3600.0, "s"), "time that the rollouts of an update last together"),
        Setting("max_update_rollouts", Whole(1, 1000), "rollouts of an update, at most"),
        Setting("calibration_rollouts", Whole(0, 1000), "more rollouts of the policy that solved it"),
        Setting("calibration_steps", STEPS, "length of each of these"),
        Setting("sim_rounds", _ROUNDS, "rounds in which f learns from its own policy"),
        Setting("sim_round_rollouts", _TRIALS, "rollouts in each of these rounds"),
        Setting("sim_round_exploration", _SHARE, "sd of noise on their command, per torque limit"),
        Setting("base_by_evidence", YesNo(), "the base of g is chosen among several, with robust"),
        _common("diagnose", YesNo(), "what rollouts show to be missing enters the simulation"),
        Setting("search_retries", _ROUNDS, "searches anew where a policy falls in simulation"),
        Setting("initial_policy", OneOf(("simulation", "random", "lqr", "agent")), "where policy 0 comes from"),
        Setting("random_rollouts", _TRIALS, "rollouts on the robot, with initial_policy=random"),
        Setting("model_update", OneOf(("residual", "full", "linear")), "what real rollouts teach"),
        Setting("on_lqr", YesNo(), "a network on top of the regulator is searched"),
        Setting("known", OrNull(PATH), "run folder of identify on logs of this robot; only with robust"),
        Setting("trained_agent", OrNull(PATH), "run folder of train-agent, or policy.pt; null trains one"),
        Setting("method", Text("name"), "name of the method, for reports"),
    ),
    "import-log": (
        _common("files", PATHS, "logs: text, JSON, NumPy, MATLAB or Parquet"),
        _common("guess", YesNo(), "only proposes a mapping for each file"),
        _common("period", OrNull(Number(1e-4, 10.0, "s")), "control period of the episodes; null: the log's"),
        Setting("min_length", Whole(4, 1_000_000, "samples"), "shortest recording that is kept"),
    ),
    "plot": (
        _common("episode", PATH, "log to draw"),
        _common("compare_with", PATHS_OR_NONE, "other logs, to drive beside it in the film"),
        Setting("captions", ListOf(Text()), "names of the robots in the film; []: of files"),
        Setting("simulate", YesNo(), "the simulation drives beside it"),
        Setting("resync", Number(0.01, 1e4, "s"), "time after which the simulation starts from the data anew"),
        Setting("film", YesNo(), "false: plots alone"),
        Setting("seconds", Number(0.01, 1e4, "s"), "length of the film, at most"),
        Setting("frame_rate", Number(0.01, 50.0, "1/s"), "frames a second of the film"),
        Setting("width", _PIXELS, "width of the film"),
        Setting("height", _PIXELS, "height of the film"),
        Setting("rrd", YesNo(), "a recording for Rerun beside the figures"),
    ),
    "compare": (
        _SEED,
        _common("runs", PATHS, "folders of runs or sweeps of iterate; the first is the reference"),
        Setting("runs.*", PATH, "the same by name"),
        _common("robustness", YesNo(), "drive the policies on virtual robots that `perturbation` changes"),
    ),
    "regress": (
        _common("data", PATH, "folder of logs and models"),
        _common("baseline", OrNull(PATH), "null: baseline.json in that folder"),
        Setting("tolerances", OrNull(PATH), "null: tolerances.yaml in that folder"),
        _common("update", YesNo(), "what is measured becomes the baseline"),
    ),
    "export": (
        _common("episodes", PATHS, "run folders, folders of logs, or logs"),
        _common("format", OneOf(("csv", "parquet")), "format of the tables"),
    ),
    "export-policy": (
        _SEED,
        _common("target", OneOf(("header",)), "what is written: a C99 or C++ header"),
        _common("distil", OrNull(Whole(0, 10_000)), "basis functions that are left; null: all"),
        Setting("states", Whole(0, 10_000_000), "at which the compiled header is checked; 0: none"),
    ),
    "new-robot": (
        _common("name", Text("name"), "name of the robot, and of its file"),
        _common("folder", PATH, "folder of your own configuration, for --config-dir"),
        _common("answers", OrNull(PATH), "yaml file of answers; null: none"),
        Setting("replace", YesNo(), "a sheet that is there is written anew"),
        *(Setting(f"given.{key}", SheetAnswer(question.unit), question.what) for key, question in QUESTIONS.items()),
    ),
    "doctor": (
        Setting("sysfs", PATH, "where the kernel tells of USB adapters"),
        _common("timing", Number(0.05, 3600.0, "s"), "time for which wake-ups at 100 Hz are timed"),
    ),
    "check-link": (
        _common("exchanges", Whole(10, 100_000), "messages whose answers are timed"),
        _common("rest", Number(0.1, 3600.0, "s"), "time without torque, in which sensors and clock are watched"),
        _common("pulse", Number(0.001, 1.0), "torque of a pulse, per torque limit (the lower one, of robot and sheet)"),
        _common("pulse_time", Number(0.001, 0.3, "s"), "length of a pulse"),
        _common("by_hand", YesNo(), "a person leans the body and turns the wheels, too"),
        Setting("hand_time", Number(0.5, 3600.0, "s"), "time for each of these motions"),
        _HEED,
        Setting("write_sheet", YesNo(), "what was measured enters the sheet, or your copy of it"),
    ),
    "repair": (_common("logs", PATHS, "damaged logs, or folders that have some"),),
    "virtual-robot": (
        _common("seed", SEED, "which robot: what it hides, its starts and noise"),
        _common("clock", CLOCK, "clock; real_time streams as a robot does"),
        Setting(
            "physics_step",
            PHYSICS_STEP,
            "step of its integrator, at most; it divides the control period",
        ),
        Setting("self_stop_tilt", TILT_LIMIT, "tilt at which it stops itself"),
        Setting("watchdog", Number(0.001, 3600.0, "s"), "silence of the host at which it stops itself"),
        Setting("protocol", Whole(1, 2), "version of the link's protocol that it speaks"),
        Setting("held", YesNo(), "a hand holds it, wheels in the air, and moves it by keys"),
        Setting("firmware", OrNull(PATH), "program of firmware/ that runs in it; null: Python"),
        Setting("idle_timeout", Number(0.01, 1e7, "s"), "time without a host at which it ends"),
        Setting("parent", OrNull(Whole(1, 2**31)), "process it does not outlive; null: which started it"),
    ),
}

SECTIONS = {
    "sim_collect": "sim-collect",
    "fit_sim_gp": "fit-sim-gp",
    "optimise_policy": "optimise-policy",
    "lqr": "lqr",
    "train_agent": "train-agent",
    "real_rollout": "real-rollout",
    "fit_diff_gp": "fit-diff-gp",
    "recordings": "diagnose",
}
"""Keys under which one stage has the settings of another, by whose they are."""
