"""How the tests run each command that is shown anywhere: `TABLE`, by the command's text.

A command of twbal runs in a scratch folder in which the files that commands name lie where they name them: a folder may
well be called `...` (`scratch.py`). `SMALL` makes its work small. What a reader fills in, the table fills in.
"""

from collections.abc import Mapping
from typing import NamedTuple

from small_run import OVERRIDES

from twbal.effects.library import library

MODEL, POLICY = "outputs/fit-sim-gp/.../model.pt", "outputs/optimise-policy/.../policy.pt"
RECORDED = "outputs/real-rollout/..."

_OTHERS = ",".join(sorted(set(library()) - {"dead_zone"}))
SMALL: Mapping[str, tuple[str, ...]] = {
    "iterate": (*OVERRIDES, "calibration_rollouts=0"),
    "sim-collect": ("rollouts=2", "steps=20"),
    "fit-sim-gp": ("model.fit_f.settings.fit.starts=1",),
    "fit-diff-gp": ("model.fit_g.settings.starts=1", "model.smoothing.rounds=1", "model.smoothing.iterations=2"),
    "optimise-policy": (
        *("search.long_horizon=8", "search.long_iterations=1"),
        *("search.horizon=8", "search.short_horizon=4", "search.iterations=1", "search.short_iterations=1"),
        *(
            "search.linearisation_amplitudes=[0.3]",
            "search.lqr_command_widths=[0.3]",
            "search.gain_scales=[1.0]",
            "search.restarts=1",
        ),
        *(
            "validation.robots=2",
            "validation.features=20",
            "parametrisation.basis=4",
            "success.duration=0.4",
            "success.settle_time=0.2",
            "success.place_time=0.2",
        ),
        *("robust.robots=4", "robust.designs=1", "robust.screening=2", "robust.finalists=1"),
        *("robust.improved=1", "robust.evaluations=4", "robust.improving=2"),
    ),
    "train-agent": (
        *(
            "steps=64",
            "trials=1",
            "success.duration=0.4",
            "success.settle_time=0.2",
            "success.place_time=0.2",
            "agent.hidden=[8]",
        ),
        *("agent.options.n_steps=32", "agent.options.batch_size=16"),
    ),
    "real-rollout": ("trials=1", "steps=10"),
    "diagnose": (
        *(
            "horizons=[0.06]",
            "starts=2",
            "bins=2",
            "min_length=15",
            "min_samples=90",
            "diagnosis.shortlist=1",
            "diagnosis.max_effects=1",
        ),
        *("diagnosis.substeps=4", f"diagnosis.exclude=[{_OTHERS}]"),
    ),
    "plot": ("seconds=0.2", "frame_rate=5", "width=64", "height=48"),
}


class Stage(NamedTuple):
    """A command of twbal.

    Attributes:
        fill: what stands in place of parts of its text, as far as they are in it.
        small: words besides; None: `SMALL` of its stage.
        slow: it runs among the slow tests only; the quick ones see whether its settings are all there.
        extra: module that it needs, of an extra of pyproject.toml.
        after: commands of the table that make what it reads.
    """

    fill: Mapping[str, str] = {}
    small: tuple[str, ...] | None = None
    slow: bool = False
    extra: str = ""
    after: tuple[str, ...] = ()


class Make(NamedTuple):
    """A target of the Makefile: make knows it, and what it would do."""


class Install(NamedTuple):
    """What pip installs is an extra of pyproject.toml, or what the environment of the tests has."""


class Benchmark(NamedTuple):
    """`python -m <module> <words>`, which takes hours: the module loads, and refuses settings that it does not know.

    Attributes:
        measures: it takes no settings, but skips what is measured: nothing is left to do where all results are there.
    """

    measures: bool = False


class Elsewhere(NamedTuple):
    """A command that another test runs, or that a program of others gives its meaning.

    Attributes:
        test: file of the tests, and a word in it that shows that it does.
        why: it is not run here.
    """

    test: tuple[str, str] | None
    why: str


How = Stage | Make | Install | Benchmark | Elsewhere

_RECORDS = {"<run folder>": RECORDED, "<policy.pt>": POLICY, "<model.pt>": MODEL}
_SERIAL = {f"link.port={shown}": "link.port={port}" for shown in ("/dev/ttyUSB0", "/dev/pts/5", "<path>", "...")}
_DRIVES = {**_RECORDS, **_SERIAL}
_SHORT_COURSE = ("trials=1", "course.segments=[{seconds:0.2,speed:0}]")
_STEERED = Elsewhere(("tests/cli/test_steering.py", "def drive("), "a person steers")
_ASKS = Elsewhere(("tests/cli/test_new_robot.py", '"new-robot", "name=my_robot"'), "a person answers")
_HELD = Elsewhere(("tests/firmware/test_held.py", 'main(["check-link"'), "a person moves the robot")
_PERL_ROBOT = "perl tests/link/conformance/robots/pendulum.pl clock={clock}"
_TRIED = Elsewhere(("tests/link/conformance/starting.py", "PERL_ROBOT = "), "a suite of tests, which tries a robot")
_SWEEP = {"<folder of a sweep>": "outputs/iterate/sweep_1", "sweep_2": "sweep_1"}
_IMPORTED = {"<run folder>": "imported", "robot=...": "robot=paper", "sim=...": "sim=nominal"}
_PAPER = (
    *(word for word in SMALL["iterate"] if not word.startswith("model.smoothing")),  # which it does without
    *("updates=0", "trials=1", "search.long_horizon=8", "search.long_iterations=1"),
    "hydra.run.dir=outputs/iterate/sweep_1/paper",
)
_SAC = (
    "steps=8",
    "trials=1",
    "success.duration=0.4",
    "success.settle_time=0.2",
    "success.place_time=0.2",
    "agent.hidden=[8]",
    "agent.options.batch_size=4",
)
_CHECK = Stage(slow=True)
_DIAGNOSE = "twbal diagnose episodes=outputs/real-rollout/... diagnosis.tolerances.data_sheet=0.15"
_GUESS = "twbal import-log guess=true files=ride.csv robot=..."
_IMPORT = "twbal import-log --config-dir=<run folder> import=my_log files=[a.csv,b.csv] robot=..."
_IMPORT_REGBOT = "twbal import-log import=regbot robot=regbot files=[test3a.txt,test4.txt]"
_MINE = {f"outputs/{stage}/...": f"outputs/{stage}/mine" for stage in ("real-rollout", "identify")}
_RECORD_MINE = (
    "twbal real-rollout --config-dir=my_conf robot=my_robot experiment=excite trials=1 link=serial "
    "link.port=/dev/ttyUSB0"
)
_IDENTIFY_MINE = "twbal identify --config-dir=my_conf robot=my_robot"
_IDENTIFY = "twbal identify episodes=outputs/real-rollout/..."
_COLLECT = "twbal sim-collect hydra.run.dir=outputs/sim"
_FIT = "twbal fit-sim-gp episodes=outputs/sim hydra.run.dir=outputs/f"
_MY_LQR = "twbal lqr --config-dir=my_conf robot=my_robot hydra.run.dir=outputs/my_lqr"
_NEW_LQR = "twbal lqr robot=<name> hydra.run.dir=outputs/new_lqr"
_BRAKED = (
    "twbal sim-collect policy=excite policy.command_width=0.1 start.tilt_mean=0 rollouts=3 steps=500 "
    "hydra.run.dir=braked +effect@sim.effects.sensor_noise=sensor_noise +effect@sim.effects.eddy_brake=eddy_brake"
)
_ON_MODEL = tuple(word for word in SMALL["optimise-policy"] if not word.startswith("robust."))  # with robust=none
_SMALL_DATA = "twbal sim-collect rollouts=6 hydra.run.dir=small/data"
_SMALL_MODEL = "twbal fit-sim-gp episodes=small/data hydra.run.dir=small/model"
_ONE_LEVEL = (
    *(
        f"perturbation.{axis}=[{level}]"
        for axis, level in (("model_error", 0.1), ("sensor_noise", 1.0), ("delay", 0.01))
    ),
    *(
        f"perturbation.{axis}=[{level}]"
        for axis, level in (("torque_noise", 0.1), ("motor_lag", 0.01), ("pushes", 9.0))
    ),
    *("robustness=true", "perturbation.trials=1", "perturbation.push_time=0.1"),
    *("success.duration=0.4", "success.settle_time=0.2", "success.place_time=0.2"),
)
_COMPARED = ("twbal iterate experiment=paper",)

_IMPORT_EV3 = "twbal import-log --config-dir=data/ev3 import=ev3 robot=ev3 files=datalog.json"
_EV3_RUN = {"outputs/import-log/...": "outputs/import-log/ev3"}
_DIAGNOSE_EV3 = (
    "twbal diagnose --config-dir=data/ev3 robot=ev3 sim=ev3 episodes=outputs/import-log/... diagnosis=real_logs "
    "diagnosis.tolerances.rough=0.3"
)

TABLE: Mapping[str, How] = {
    # docs/regbot.md
    "twbal diagnose episodes=outputs/import-log/... diagnosis=real_logs sim=regbot robot=regbot": Stage(
        {"outputs/import-log/...": "imported_regbot"},
        small=(*SMALL["diagnose"], "hydra.run.dir=outputs/diagnose/regbot"),
        slow=True,
        after=(_IMPORT_REGBOT,),
    ),
    # docs/ev3.md
    "twbal import-log guess=true files=datalog.json": Stage(),
    _IMPORT_EV3: Stage(small=("hydra.run.dir=outputs/import-log/ev3",)),
    _DIAGNOSE_EV3: Stage(
        _EV3_RUN, small=(*SMALL["diagnose"], "hydra.run.dir=outputs/diagnose/ev3"), slow=True, after=(_IMPORT_EV3,)
    ),
    # README
    "make run": Make(),
    "make test": Make(),
    ". .venv/bin/activate": Elsewhere(None, "Python's own"),
    "twbal iterate link.seed=3": Stage(slow=True),
    "twbal iterate experiment=paper": Stage(small=_PAPER, slow=True),
    "twbal iterate -m link.seed=1,2,3": Stage(slow=True),
    "twbal iterate method=pilco": Stage(slow=True),
    "twbal iterate link=serial link.port=/dev/ttyUSB0": Stage(_SERIAL, slow=True),
    _RECORD_MINE: Stage(_SERIAL, small=("steps=120", f"hydra.run.dir={_MINE['outputs/real-rollout/...']}")),
    f"{_IDENTIFY_MINE} episodes=outputs/real-rollout/...": Stage(
        _MINE, small=(f"hydra.run.dir={_MINE['outputs/identify/...']}",), after=(_RECORD_MINE,)
    ),
    (
        "twbal evaluate-sim --config-dir=my_conf robot=my_robot sims=[nominal,outputs/identify/.../identified.yaml] "
        "episodes=outputs/real-rollout/..."
    ): Stage(_MINE, small=("settling=0.1",), after=(f"{_IDENTIFY_MINE} episodes=outputs/real-rollout/...",)),
    (
        "twbal iterate --config-dir=my_conf robot=my_robot sim=outputs/identify/.../identified.yaml "
        "known=outputs/identify/... link=serial link.port=/dev/ttyUSB0"
    ): Stage({**_SERIAL, **_MINE}, slow=True, after=(f"{_IDENTIFY_MINE} episodes=outputs/real-rollout/...",)),
    (
        "twbal real-rollout --config-dir=my_conf robot=my_robot experiment=excite policy.command_width=0.1 "
        "link=serial link.port=/dev/ttyUSB0"
    ): Stage(_SERIAL, slow=True),
    (
        "twbal diagnose --config-dir=my_conf robot=my_robot episodes=outputs/real-rollout/... "
        "diagnosis.tolerances.data_sheet=0.15"
    ): Stage(
        _MINE, small=(*SMALL["diagnose"], "hydra.run.dir=outputs/diagnose/mine"), slow=True, after=(_RECORD_MINE,)
    ),
    "twbal real-rollout experiment=excite policy.command_width=0.1 link.seed=7": Stage(slow=True),
    _DIAGNOSE: Stage(small=(*SMALL["diagnose"], "hydra.run.dir=outputs/diagnose/..."), slow=True),
    "twbal iterate sim=outputs/identify/.../identified.yaml known=outputs/identify/... link.seed=7": Stage(
        slow=True, after=(_IDENTIFY,)
    ),
    "twbal iterate sim=outputs/diagnose/.../augmented.yaml link.seed=7": Stage(slow=True, after=(_DIAGNOSE,)),
    "twbal real-rollout policy.path=<policy.pt> link=serial link.port=/dev/ttyUSB0 steps=25": Stage(_DRIVES, slow=True),
    "twbal lqr --config-dir=my_conf robot=my_robot": Stage(),
    (
        "twbal real-rollout --config-dir=my_conf robot=my_robot policy.path=<policy.pt> link=serial "
        "link.port=/dev/ttyUSB0 steps=25"
    ): Stage(_DRIVES, slow=True),
    "python scripts/follow_parameter.py torque_limit": Elsewhere(
        ("tests/docs/test_follow_parameter.py", "follow_parameter"), "reads the code"
    ),
    "twbal <stage> --help": Stage({"<stage>": "sim-collect"}),
    "pip install -e '.[rl]'": Install(),
    "pip install -e '.[viewers]'": Install(),
    "make test-slow": Make(),
    "make bench": Make(),
    "make bench-hidden": Make(),
    "python -m benchmarks.methods": Benchmark(),
    "python scripts/readme.py tables": Elsewhere(("tests/docs/test_links.py", "scripts/readme.py"), "writes pages"),
    # CONTRIBUTING
    "git clone <this repository> twbal": Elsewhere(None, "git's own"),
    "cd twbal": Elsewhere(None, "the shell's own"),
    "make .venv/.installed": Make(),
    "make lint": Make(),
    ".venv/bin/twbal regress": _CHECK,
    ".venv/bin/pre-commit install": Install(),
    "twbal regress update=true": _CHECK,
    _BRAKED: Stage(
        {"eddy_brake": "dead_zone"}, small=("rollouts=1", "steps=120"), slow=True
    ),  # the example is in no library
    "twbal diagnose episodes=braked diagnosis.max_effects=1": Stage(slow=True, after=(_BRAKED,)),
    _SMALL_DATA: Stage(),
    _SMALL_MODEL: Stage(slow=True, after=(_SMALL_DATA,)),
    "twbal optimise-policy dynamics=small/model/model.pt robust=none search.restarts=1 search.iterations=3 "
    "search.long_iterations=0": Stage(small=_ON_MODEL, slow=True, after=(_SMALL_DATA, _SMALL_MODEL)),
    _NEW_LQR: Stage({"<name>": "balboa"}),
    "twbal sim-collect robot=<name> policy=saved policy.path=outputs/new_lqr/policy.pt rollouts=2": Stage(
        {"<name>": "balboa"}, after=(_NEW_LQR,)
    ),
    "twbal iterate robot=<name> robust=none ensemble=none updates=1 trials=2 sim_collect.rollouts=6 search.restarts=1 "
    "search.iterations=3 search.long_iterations=0": Stage({"<name>": "balboa"}, slow=True),
    "python -m pytest tests/link/conformance --robot=/dev/ttyUSB0": _TRIED,
    f"python -m pytest tests/link/conformance --robot='{_PERL_ROBOT}'": _TRIED,
    "python scripts/effects.py": Elsewhere(("tests/docs/test_effects_page.py", "page()"), "writes a page"),
    "python scripts/settings.py": Elsewhere(("tests/docs/test_settings_page.py", '["page"]()'), "writes a page"),
    "python scripts/protocol.py": Elsewhere(("tests/link/test_header.py", 'SCRIPT["header"]()'), "writes files"),
    "python scripts/robots.py": Elsewhere(("tests/docs/test_robots_page.py", 'written["page"]()'), "writes a page"),
    "pip freeze": Elsewhere(None, "pip's own"),
    # docs
    "python -m benchmarks.hidden_robots family=hard": Benchmark(),
    "python -m benchmarks.hidden_robots family=hard first_seed=810": Benchmark(),
    "python -m benchmarks.hidden_robots family=hard recipe=identified": Benchmark(),
    "python -m benchmarks.hidden_robots.reached": Benchmark(),
    "python -m benchmarks.hidden_robots.ahead": Benchmark(),
    "python -m benchmarks.calibration": Benchmark(),
    "python -m benchmarks.hidden_robots family=moderate recipe=pilco": Benchmark(),
    "python -m benchmarks.hidden_robots.reproduced family=hard": Elsewhere(
        ("tests/benchmarks/test_reproduced.py", "reproduced(run)"), "runs all commands of finished runs"
    ),
    "python -m benchmarks.hidden_robots.prediction": Elsewhere(
        ("tests/benchmarks/test_prediction.py", "main("), "reads results"
    ),
    "twbal iterate seed=<robot> link.seed=<robot> updates=6": Stage({"<robot>": "6012"}, slow=True),
    "python -m benchmarks.driving": Benchmark(),
    "python -m benchmarks.robustness": Benchmark(),
    "python -m benchmarks.whole_run": Benchmark(),
    "python -m benchmarks.link_faults robot=virtual clock=real_time times=10": Benchmark(),
    "python -m benchmarks.import_checks": Benchmark(),
    "python -m benchmarks.latency": Benchmark(),
    "python -m benchmarks.latency.steering cases=view_none,view_recording,view_stalled": Benchmark(),
    "python -m benchmarks.latency.steering": Benchmark(),
    "python -m benchmarks.hidden_effects all": Benchmark(),
    "real-rollout experiment=excite": Stage(),
    "real-rollout experiment=excite trials=1": Stage(),
    "python -m benchmarks.hidden_effects again": Benchmark(),
    "python -m benchmarks.effects_shown": Benchmark(),
    "python -m benchmarks.other_robots all": Benchmark(),
    'python -m benchmarks.other_robots power "strata=single 1/8,single 1/4" seeds=2010-2021': Benchmark(),
    "python -m benchmarks.other_robots all strata=lost,clean,foreign seeds=1126-1134": Benchmark(),
    'python -m benchmarks.other_robots all "strata=sensors clean,sensors 1,sensors 1/4" seeds=2031-2046': Benchmark(),
    "python -m benchmarks.what_next": Benchmark(),
    "python -m benchmarks.agreement": Benchmark(),
    "python -m benchmarks.free_form": Benchmark(),
    "python -m benchmarks.mending": Benchmark(),
    "twbal iterate diagnose=true": Stage(slow=True),
    "twbal sim-collect +effect@sim.effects.dead_zone=dead_zone sim.effects.dead_zone.width=0.5": Stage(),
    "sh commands.sh other_folder": Elsewhere(("tests/cli/test_iterate_again.py", "commands.sh"), "runs all again"),
    "sha256sum --check": Elsewhere(("twbal/cli/script.py", "sha256sum --check"), "the last line of commands.sh"),
    _MY_LQR: Stage(),
    (
        "twbal sim-collect --config-dir=my_conf robot=my_robot policy=saved policy.path=outputs/my_lqr/policy.pt "
        "rollouts=2"
    ): Stage(after=(_MY_LQR,)),
    "twbal real-rollout --config-dir=my_conf robot=my_robot policy.path=outputs/my_lqr/policy.pt steps=500": Stage(
        slow=True, after=(_MY_LQR,)
    ),
    _GUESS: Stage({"robot=...": "robot=paper"}, small=("hydra.run.dir=guessed",)),
    _IMPORT: Stage(
        {"<run folder>": "guessed", "robot=...": "robot=paper"},
        small=("hydra.run.dir=imported",),
        slow=True,
        after=(_GUESS,),
    ),
    "twbal diagnose episodes=<run folder> diagnosis=real_logs sim=regbot robot=regbot robot.control_period=0.03": Stage(
        {"<run folder>": "imported_regbot", "0.03": "0.015"}, slow=True, after=(_IMPORT_REGBOT,)
    ),
    "twbal plot episode=<log>": Stage({"<log>": "before.mcap"}),
    "twbal export episodes=<run folder> format=csv": Stage(_RECORDS),
    "rerun mcap convert ride.mcap -o ride.rrd": Elsewhere(
        ("tests/cli/test_logs_in_and_out.py", '"mcap", "convert"'), "Rerun's"
    ),
    "rerun ride.rrd": Elsewhere(None, "opens a window"),
    "twbal check-link robot=esp32 link=serial link.port=/dev/ttyUSB0": _HELD,
    "twbal check-link robot=esp32 link=serial link.port=<path>": _HELD,
    "twbal virtual-robot robot=esp32 held=true clock=real_time firmware=firmware/build/robot_posix": Elsewhere(
        ("tests/firmware/test_held.py", '"held=true", "clock=real_time"'), "it needs the firmware built"
    ),
    "twbal virtual-robot held=true clock=real_time": Stage(),
    "twbal real-rollout policy.path=<policy.pt> link=serial link.port=/dev/ttyUSB0 link.on_board=true": Elsewhere(
        ("tests/firmware/test_driven_by_the_host.py", "on_board=True"), "it needs the firmware with a policy in it"
    ),
    "make -C firmware": Elsewhere(("tests/firmware/building.py", 'make("all")'), "it compiles"),
    "make -C firmware test": Elsewhere(("tests/firmware/test_build.py", 'make("test")'), "it compiles for seconds"),
    "make -C firmware avr": Elsewhere(("tests/firmware/test_build.py", 'make("avr"'), "it compiles"),
    "make -C firmware avr sizes": Elsewhere(("tests/firmware/test_build.py", 'make("sizes"'), "it compiles"),
    "make -C firmware POLICY=<run folder>": Elsewhere(
        ("tests/firmware/test_build.py", "def test_another_policy_or_none_builds_the_program_anew"), "it compiles"
    ),
    "make -C firmware BUILD=build/second": Elsewhere(("tests/firmware/building.py", "BUILD={"), "it compiles"),
    "twbal real-rollout policy.path=<policy.pt> link=firmware": Elsewhere(
        ("tests/cli/test_policy_on_board.py", '"link=firmware"'), "it needs the firmware built"
    ),
    "twbal iterate link=firmware": Elsewhere(
        ("tests/firmware/test_algorithm_over_it.py", '"link=firmware"'), "it needs the firmware built"
    ),
    "twbal iterate link=firmware link.on_board=true": Elsewhere(
        ("tests/firmware/test_algorithm_over_it.py", '"link.on_board=true"'), "it compiles the firmware"
    ),
    (
        "twbal iterate link=firmware link.on_board=true link.program=firmware/build/second/robot_posix "
        "'link.deploy=make -s -C firmware POLICY=$POLICY_FOLDER BUILD=build/second'"
    ): Elsewhere(
        ("tests/firmware/test_algorithm_over_it.py", "BUILD={build} POLICY=$POLICY_FOLDER"), "it compiles the firmware"
    ),
    (
        "twbal real-rollout policy.path=<policy.pt> link=serial link.port=/dev/ttyUSB0 link.on_board=true "
        '\'link.deploy=PLATFORMIO_BUILD_FLAGS="-DTWBAL_WITH_POLICY -I$POLICY_FOLDER" '
        "pio run -d firmware -e esp32 -t upload'"
    ): Elsewhere(("tests/cli/test_policy_on_board.py", "put_on_board(wanted, opens(flash, FLASH)"), "PlatformIO's"),
    "python -m benchmarks.on_firmware": Benchmark(),
    "python -m benchmarks.on_boards": Benchmark(),
    "python -m benchmarks.on_boards.agreement": Benchmark(),
    "python -m benchmarks.on_boards.distilling": Benchmark(),
    "python -m benchmarks.link_fuzz": Benchmark(),
    "twbal export-policy policy.path=<policy.pt> target=header": Stage(_RECORDS, small=("states=100",)),
    "twbal export-policy policy.path=<policy.pt> distil=8": Stage(_RECORDS, small=("distil=2", "states=100")),
    "twbal repair logs=<log or folder>": Stage({"<log or folder>": f"{RECORDED}/episodes"}),
    "twbal virtual-robot seed=3 clock=real_time": Stage(slow=True),
    "twbal real-rollout policy.path=<policy.pt> link=serial link.port=/dev/pts/5 link.confirm_placed=null": Stage(
        _DRIVES
    ),
    "twbal real-rollout policy.path=<policy.pt> link=serial link.port=/dev/ttyUSB0 link.baud_rate=921600": Stage(
        _DRIVES
    ),
    "twbal iterate method=...": Stage({"...": "f_alone"}, slow=True),
    "fit-diff-gp dynamics=null": Stage({"dynamics=null": f"dynamics=null episodes={RECORDED}"}),
    "optimise-policy residual_on=<policy.pt>": Stage(
        {"residual_on=<policy.pt>": f"residual_on=outputs/lqr/.../policy.pt dynamics={MODEL}"},
        after=("twbal lqr",),
    ),
    "python -m benchmarks.moment_matching": Benchmark(measures=True),
    "python -m benchmarks.fitting": Benchmark(measures=True),
    "python -m benchmarks.running": Benchmark(measures=True),
    "python -m benchmarks.validation": Benchmark(measures=True),
    "twbal --help": Stage(),
    "ray start --head --port=6399 --num-cpus=1 --block": Elsewhere(
        ("tests/cli/test_launchers.py", "ray.scripts.scripts"), "Ray's"
    ),
    "ray start --address=127.0.0.1:6399 --num-cpus=1 --block": Elsewhere(
        ("tests/cli/test_launchers.py", "--address"), "Ray's"
    ),
    "twbal iterate -m link.seed=0,1,2,3 hydra/launcher=ray_cluster hydra.launcher.address=127.0.0.1:6399": Elsewhere(
        ("tests/cli/test_launchers.py", "hydra/launcher=ray_cluster"), "needs a Ray cluster"
    ),
    _COLLECT: Stage(small=("rollouts=4", "steps=15")),
    _FIT: Stage(after=(_COLLECT,)),
    (
        "twbal optimise-policy dynamics=outputs/f/model.pt search.iterations=10 -m hydra/sweeper=optuna "
        "hydra.sweeper.sampler.seed=1 hydra.sweeper.n_trials=6 hydra.sweeper.n_jobs=1 "
        "'parametrisation.basis=range(5,31,5)' 'parametrisation.weight_sd=interval(0.02,0.2)' "
        "hydra.sweep.dir=outputs/shape"
    ): Stage(
        small=(
            *(word for word in SMALL["optimise-policy"] if "parametrisation" not in word),
            "hydra.sweeper.n_trials=2",
        ),
        slow=True,
        extra="hydra_plugins.hydra_optuna_sweeper",
        after=(_COLLECT, _FIT),
    ),
    "twbal iterate -m link.seed=0,1,2 search.horizon=60,100": Stage({"60,100": "8,9"}, slow=True),
    "pip install -e '.[sweeps]'": Install(),
    "twbal compare runs=<folder of a sweep>": Stage(
        {"<folder of a sweep>": "outputs/iterate/sweep_1"}, slow=True, after=_COMPARED
    ),
    # help of the stages
    "twbal regress": _CHECK,
    "twbal regress data=my_robot baseline=my_robot/baseline.json update=true": _CHECK,
    "twbal compare 'runs={default:outputs/iterate/sweep_1,paper:outputs/iterate/sweep_2}'": Stage(
        _SWEEP, slow=True, after=_COMPARED
    ),
    "twbal compare 'runs={default:outputs/iterate/sweep_1,pilco:outputs/iterate/sweep_2}' robustness=true": Stage(
        _SWEEP, small=_ONE_LEVEL, slow=True, after=_COMPARED
    ),
    "twbal compare 'runs={mine:policy.pt,other:old/policy.pt}' robustness=true link.seed=3": Stage(
        {"mine:policy.pt": f"mine:{POLICY}", "old/policy.pt": "lqr/policy.pt"}, small=_ONE_LEVEL
    ),
    "twbal sim-collect sim=<run folder>/augmented.yaml": Stage(
        {"<run folder>": "outputs/diagnose/..."}, after=(_DIAGNOSE,)
    ),
    "twbal diagnose episodes=outputs/real-rollout/...": Stage(slow=True),
    "twbal diagnose episodes=[run_1,run_2] robot=regbot": Stage(slow=True),
    "twbal export episodes=outputs/real-rollout/... format=csv": Stage(),
    "twbal optimise-policy dynamics=<run folder>/model.pt": Stage({"<run folder>/model.pt": MODEL}),
    "twbal fit-diff-gp dynamics=outputs/fit-sim-gp/.../model.pt episodes=outputs/real-rollout/...": Stage(),
    "twbal fit-diff-gp dynamics=[runs/f/model.pt,runs/identified_f/model.pt] episodes=outputs/real-rollout/...": Stage(
        {"runs/f/model.pt": MODEL, "runs/identified_f/model.pt": MODEL}
    ),
    "fit-diff-gp dynamics=[a/model.pt,b/model.pt,null]": Stage(
        {"a/model.pt": MODEL, "b/model.pt,null]": f"{MODEL},null] episodes={RECORDED}"}, slow=True
    ),
    "twbal evaluate-sim sims=[outputs/diagnose/.../augmented.yaml] episodes=outputs/real-rollout/...": Stage(
        small=("horizons=[0.04]", "settling=0.1"), after=(_DIAGNOSE,)
    ),
    "twbal evaluate-sim 'sims={first:a.yaml,second:b.yaml}' episodes=[run_1,run_2]": Stage(
        {"a.yaml": "nominal", "b.yaml": "regbot"}, small=("horizons=[0.04]", "settling=0.1", "robot=regbot")
    ),
    "twbal evaluate-sim sims=[...] episodes=[...]": Stage(
        {"sims=[...]": "sims=[nominal]", "episodes=[...]": "episodes=[run_1]"},
        small=("horizons=[0.04]", "settling=0.1", "robot=regbot"),
        slow=True,
    ),
    "twbal sim-collect sim=<the best of them>": Stage({"<the best of them>": "nominal"}),
    "twbal real-rollout experiment=drive policy.path=<policy.pt>": Stage(_DRIVES, small=_SHORT_COURSE),
    "twbal real-rollout experiment=drive course=turns policy.path=<policy.pt>": Stage(
        _DRIVES, small=_SHORT_COURSE, slow=True
    ),
    "twbal real-rollout experiment=drive course=square policy.path=<policy.pt>": Stage(
        _DRIVES, small=_SHORT_COURSE, slow=True
    ),
    "twbal real-rollout --config-dir=my_conf robot=my_robot experiment=drive policy.path=<best_policy.pt>": Stage(
        {"<best_policy.pt>": POLICY}, small=_SHORT_COURSE, slow=True
    ),
    "twbal real-rollout experiment=drive policy.path=...": Stage({"...": POLICY}, small=_SHORT_COURSE),
    (
        "twbal real-rollout course=forth_and_back policy.path=<policy.pt> "
        "'course.segments=[{seconds:3,speed:0},{seconds:8,speed:0.3},{position:0}]'"
    ): Stage(_DRIVES, slow=True),
    "twbal drive policy.path=<policy.pt>": _STEERED,
    "twbal drive policy.path=<policy.pt> link=serial link.port=/dev/ttyUSB0": _STEERED,
    "twbal drive policy.path=<policy.pt> input=/dev/input/js0": _STEERED,
    "twbal drive policy.path=<policy.pt> view=window": _STEERED,
    _IDENTIFY: Stage(small=("hydra.run.dir=outputs/identify/...",), slow=True),
    "twbal identify episodes=<run folder>": Stage({"<run folder>": "outputs/real-rollout/..."}, slow=True),
    "twbal iterate sim=<run folder>/identified.yaml known=<run folder>": Stage(
        {"<run folder>": "outputs/identify/..."}, slow=True, after=(_IDENTIFY,)
    ),
    "twbal fit-sim-gp episodes=outputs/sim-collect/2026-11-20_10-00-00-000000": Stage(),
    "twbal fit-sim-gp episodes=[run1,run2] model=exact": Stage(small=("model.fit_f.settings.starts=1",)),
    "twbal diagnose episodes=<run folder> diagnosis=real_logs robot=... sim=...": Stage(
        _IMPORTED, slow=True, after=(_IMPORT,)
    ),
    _IMPORT_REGBOT: Stage(small=("hydra.run.dir=imported_regbot",)),
    "twbal import-log guess=true files=log.csv": Stage(),
    "twbal real-rollout policy.path=<run folder>/best_policy.pt": Stage(
        {"<run folder>/best_policy.pt": POLICY}, slow=True
    ),
    "twbal iterate": Stage(slow=True),
    "twbal iterate link.seed=3 updates=6": Stage(slow=True),
    "twbal real-rollout policy.path=<run folder>/policy.pt": Stage({"<run folder>/policy.pt": POLICY}, slow=True),
    "twbal lqr": Stage(small=("hydra.run.dir=outputs/lqr/...",)),
    "twbal lqr episodes=outputs/real-rollout/... command_width=0.3": Stage(),
    "twbal optimise-policy dynamics=outputs/fit-sim-gp/.../model.pt": Stage(),
    "twbal optimise-policy dynamics=[outputs/fit-sim-gp/.../model.pt,outputs/fit-sim-gp/.../model.pt]": Stage(),
    "twbal optimise-policy dynamics=outputs/fit-diff-gp/.../model.pt initial_policies=[runs/1/policy.pt]": Stage(
        {"runs/1/policy.pt": POLICY}
    ),
    "twbal fit-diff-gp dynamics=<model.pt> episodes=<run folder>": Stage(_RECORDS),
    "twbal real-rollout policy.path=outputs/optimise-policy/.../policy.pt link=serial link.port=/dev/ttyUSB0": Stage(
        _SERIAL
    ),
    "twbal real-rollout policy.path=... link=virtual trials=10 steps=500": Stage({"...": POLICY}, slow=True),
    "twbal real-rollout experiment=excite": Stage(),
    "twbal plot episode=<run folder>/episodes/...": Stage({"<run folder>/episodes/...": "before.mcap"}),
    "twbal plot episode=<run folder>/episodes/trial_000.mcap": Stage(
        {"<run folder>/episodes/trial_000.mcap": "before.mcap"}
    ),
    "twbal repair logs=outputs/real-rollout/.../episodes": Stage(),
    "twbal plot episode=outputs/real-rollout/.../episodes/trial_000.mcap": Stage(),
    "twbal plot episode=before.mcap compare_with=[after.mcap] simulate=false": Stage(),
    "twbal fit-sim-gp episodes=<run folder>": Stage({"<run folder>": "outputs/sim"}, after=(_COLLECT,)),
    "twbal sim-collect rollouts=40 seed=1": Stage(),
    "twbal sim-collect robot=regbot policy.amplitude=0.5": Stage(),
    "twbal train-agent seed=1": Stage(slow=True, extra="stable_baselines3"),
    "twbal train-agent agent=sac steps=40000": Stage(small=_SAC, slow=True, extra="stable_baselines3"),
    "twbal train-agent robot=regbot sim=regbot": Stage(slow=True, extra="stable_baselines3"),
    "twbal real-rollout policy.path=<policy.pt> link=serial link.port=<path> link.confirm_placed=null": Stage(_DRIVES),
    "twbal virtual-robot robot=regbot faults=none": Stage(slow=True),
    "twbal new-robot name=my_robot": _ASKS,
    "twbal lqr --config-dir=<folder> robot=<name>": Stage({"<folder>": "my_conf", "<name>": "my_robot"}),
    "twbal new-robot name=my_robot 'given.body_mass=1090 g' given.body_inertia_pitch=swing given.swing_period=0.62": (
        _ASKS
    ),
    "twbal new-robot name=my_robot answers=answers.yaml": _ASKS,
    # messages
    # A short stall of a busy computer is no "problem" of the median over a second.
    "twbal doctor": Stage(small=("timing=1",)),
    "twbal doctor link=serial link.port=/dev/ttyUSB0": Stage(_SERIAL, small=("timing=1",)),
    "twbal check-link link=serial link.port=/dev/ttyUSB0": Stage(
        _SERIAL, small=("exchanges=10", "rest=0.2", "pulse=0.5")
    ),
    "twbal check-link --config-dir=my_conf robot=my_robot link=serial link.port=/dev/ttyUSB0": Stage(
        _SERIAL, small=("exchanges=10", "rest=0.2", "pulse=0.5")
    ),
    "twbal check-link link.clock=real_time pulse=0.4": Stage(slow=True),
    "twbal import-log guess=true": Stage({"guess=true": "guess=true files=log.csv"}),
}
