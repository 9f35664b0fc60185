"""Settings of the cost, of policies and their search, of success, and of model-free agents."""

from twbal.cli.settings.kinds import ListOf, Number, OneOf, OrNull, Part, Setting, Whole, YesNo
from twbal.cli.settings.robot_settings import (
    CHANNELS,
    CONTROL_PERIOD,
    CONTROL_PERIODS,
    STATE_NAMES,
    TORQUE_LIMIT,
    UPRIGHT,
)

_ITERATIONS = Whole(1, 100_000)
_HORIZON = Whole(1, 100_000, CONTROL_PERIODS)
_FACTOR = Number(0.001, 100.0)
_SHARES = ListOf(_FACTOR, 1, 100)
_RELIABILITY = ListOf(Number(-20.0, 20.0), 2, 2)
_TIME = Number(0.001, 3600.0, "s")
_DEVIATION = 1e-6, 1e6  # in a channel's unit: only what must be a slip is refused

COST = (
    Setting("cost.channels", STATE_NAMES, "channels that the cost sees"),
    *(
        Setting(f"cost.widths.{name}", Number(*_DEVIATION, unit), "deviation that costs 0.39 of 1 a step")
        for name, unit in CHANNELS.items()
    ),
    Setting("cost.command_width", OrNull(Number(1e-4, 1e4)), "the same of the last command, per torque limit"),
    Setting("cost.command_change_width", OrNull(Number(1e-4, 1e4)), "the same of its change, per torque limit"),
    Setting("cost.torque_limit", TORQUE_LIMIT, "largest command"),
)

PARAMETRISATION = (
    Setting("parametrisation.basis", Whole(1, 10_000), "number of radial basis functions"),
    Setting("parametrisation.linear", YesNo(), "the policy has a linear part too"),
    *(
        Setting(
            f"parametrisation.scale.{name}", Number(*_DEVIATION, unit), "usual deviation: scale of centres and lengths"
        )
        for name, unit in CHANNELS.items()
    ),
    Setting("parametrisation.command_scale", Number(1e-4, 1e4), "the same of past commands, per torque limit"),
    Setting("parametrisation.weight_sd", Number(0.0, 100.0), "sd of the weights where a search starts"),
)

SEARCH = (
    Setting("search.horizon", _HORIZON, "horizon H, over which costs are summed", common=True),
    Setting("search.short_horizon", _HORIZON, "horizon of the first part of each search"),
    Setting("search.iterations", _ITERATIONS, "L-BFGS iterations over the horizon, at most"),
    Setting("search.short_iterations", _ITERATIONS, "L-BFGS iterations over the short horizon, at most"),
    Setting("search.restarts", Whole(0, 1000), "how many starts are searched; 0 only ranks earlier policies"),
    Setting("search.long_horizon", _HORIZON, "horizon where policies drift off"),
    Setting("search.long_iterations", Whole(0, 100_000), "L-BFGS iterations over the long horizon, at most"),
    Setting("search.min_success_rate", Number(0.0, 1.0), "share of the sampled robots that must balance"),
    Setting("search.linearisation_amplitudes", _SHARES, "commands for the model's slopes, per torque limit"),
    Setting("search.lqr_command_widths", _SHARES, "command widths of the first regulators, likewise"),
    Setting("search.gain_scales", _SHARES, "strengths at which earlier policies are tried"),
    Setting("search.weight_penalty", Number(0.0, 1e6), "penalty of the squared weights"),
    Setting("search.particles", Whole(0, 1_000_000), "particles for costs; 0: moment matching"),
    Setting("search.tolerance", Number(1e-15, 1.0), "tolerance of the series of moment matching"),
    Setting("search.degrees", ListOf(Whole(1, 20), 0, 20), "degrees of these series; []: sums over pairs"),
)

RULE = (
    Setting("tilt_limit", UPRIGHT, "tilt that ends a rollout or a trial"),
    Setting("success.tilt_limit", UPRIGHT, "tilt never passed in a trial"),
    Setting("success.settled_tilt_limit", UPRIGHT, "largest tilt once the robot has settled"),
    Setting("success.duration", _TIME, "length of a trial", common=True),
    Setting("success.settle_time", Number(0.0, 3600.0, "s"), "time by which it must have settled"),
    Setting("success.place_time", Number(0.0, 3600.0, "s"), "time by which it must be back where it was put"),
    Setting("success.place_radii", OrNull(Number(0.001, 1e4)), "largest distance from there, per wheel radius"),
    Setting("success.command_change", OrNull(Number(1e-4, 2.0)), "largest change of the command, per torque limit"),
    Setting("success.heading_limit", OrNull(Number(1e-4, 7.0, "rad")), "largest error of a controlled heading"),
    Setting("success.control_period", CONTROL_PERIOD, "time for which each command is held"),
    Setting("success.wheel_radius", Number(0.001, 10.0, "m"), "radius that turns wheel angles into distances"),
    Setting("success.torque_limit", TORQUE_LIMIT, "largest command"),
)

ROBUST = (
    Setting("robust", Part(), "policies for robots of the parameter distribution; none: on models alone"),
    Setting("robust.robots", Whole(1, 100_000), "sampled robots that a policy must hold"),
    Setting("robust.designs", Whole(1, 1000), "sampled robots that regulators are designed for"),
    Setting("robust.screening", Whole(1, 100_000), "sampled robots on which all regulators are driven"),
    Setting("robust.finalists", Whole(1, 10_000), "regulators that are driven on all sampled robots"),
    *(
        Setting(f"robust.width_scales.{name}", _FACTOR, "factor on its width in regulators")
        for name in ("speed", "position_integral")
    ),
    Setting("robust.position_scales", _SHARES, "more factors on the widths of position and its integral"),
    Setting("robust.change_scales", _SHARES, "factors on the width of changes of the command"),
    Setting("robust.command_widths", _SHARES, "command widths of the regulators, per torque limit"),
    Setting(
        "robust.compensations",
        ListOf(Number(0.0, 2.0), 1, 100),
        "shares of dead zone and friction that are compensated",
    ),
    Setting("robust.compensation_tilt", Number(0.0, 0.5, "rad"), "tilt over which the command jumps"),
    Setting("robust.improved", Whole(0, 1000), "regulators that are improved by direct search"),
    Setting("robust.evaluations", Whole(1, 100_000), "evaluations of each direct search, at most"),
    Setting("robust.improving", Whole(1, 100_000), "sampled robots on which they are improved"),
    Setting("robust.enough", Number(0.0, 4.0), "mean share of the limits in use up to which none is improved"),
    Setting("robust.doubt", Number(0.0, 100.0), "factor on the standard deviations of the parameter distribution"),
    Setting("robust.margin.doubt", Number(0.0, 100.0), "sd added to their parameters, as a share of the sheet's"),
    Setting(
        "robust.margin.delay", Number(0.0, 10.0, CONTROL_PERIODS), "time by which their commands are later, at most"
    ),
    Setting("robust.margin.noise", Number(0.0, 100.0), "factor on the noise of their sensors"),
    Setting("robust.margin.push", Number(0.0, 100.0, "N·s/kg"), "impulse on every other of them, at the start"),
    Setting("robust.margin.push_duration", Number(0.001, 2.0, "s"), "length of that push"),
    Setting("robust.reliability_sheet", _RELIABILITY, "[a, b] of the correction before the robot was driven"),
    Setting("robust.reliability_rollouts", _RELIABILITY, "the same where rollouts tell of the robot"),
)

VALIDATION = (
    Setting("validation.robots", Whole(1, 100_000), "sampled robots that a policy must balance"),
    Setting("validation.features", Whole(1, 100_000), "random features of each sampled g"),
    Setting("validation.success", Part(), "when a rollout of them counts as a success"),
)

AGENT = (
    Setting("agent.algorithm", OneOf(("PPO", "SAC")), "algorithm of Stable-Baselines3"),
    Setting("agent.hidden", ListOf(Whole(1, 100_000), 0, 100), "widths of the layers of the networks"),
    Setting("agent.activation", OneOf(("tanh", "relu")), "activation of the networks"),
    *(
        Setting(f"agent.scales.{name}", Number(*_DEVIATION, unit), "what the networks see as 1")
        for name, unit in CHANNELS.items()
    ),
    Setting("agent.options", Part(), "options of the algorithm, under its own names"),
    Setting("agent.options.learning_rate", Number(1e-10, 10.0), "learning rate of the networks"),
    Setting("agent.options.gamma", Number(0.0, 1.0), "discount factor of a control period"),
    Setting("agent.options.batch_size", Whole(1, 10_000_000), "samples of a gradient step"),
    Setting("agent.options.n_steps", Whole(1, 10_000_000, CONTROL_PERIODS), "length of an update (PPO)"),
    Setting("agent.options.n_epochs", Whole(1, 10_000), "passes over the data of an update (PPO)"),
    Setting("agent.options.buffer_size", Whole(1, 100_000_000, CONTROL_PERIODS), "length of the memory (SAC)"),
    Setting(
        "agent.options.learning_starts", Whole(0, 100_000_000, CONTROL_PERIODS), "time before the first update (SAC)"
    ),
)
