"""Settings of how a diagnosis names effects."""

from twbal.cli.settings.kinds import ListOf, Number, Setting, Text, Whole, YesNo

_EFFECTS = ListOf(Text("name of an effect"), most=1000)
_SCORE = Number(0.0, 1e6)
_SHARE = Number(0.0, 10.0)
_DEVIATIONS = Number(0.0, 1000.0)

DIAGNOSIS = (
    Setting("diagnosis.tolerances.data_sheet", Number(1e-6, 10.0), "sd of each factor on a data-sheet value"),
    Setting("diagnosis.tolerances.rough", Number(1e-6, 10.0), "that of a value of which hardly anything is known"),
    Setting("diagnosis.tolerances.imu_timing", Number(1e-9, 1.0, "s"), "sd by which the IMU may be late"),
    Setting("diagnosis.tolerances.angle_timing", Number(1e-9, 1.0, "s"), "sd of angles read before or after rates"),
    Setting("diagnosis.tolerances.tilt_offset", Number(0.0, 1.5, "rad"), "sd of each recording's tilt; 0: no offset"),
    Setting("diagnosis.tolerances.battery", Number(0.0, 1.0), "sd of each recording's torque; 0: no difference"),
    Setting(
        "diagnosis.tolerances.floor_slope", Number(0.0, 0.5, "rad"), "sd of each recording's slope; 0: no difference"
    ),
    Setting("diagnosis.tolerances.effects", Number(1e-6, 10.0), "sd of sizes of effects that the simulation has"),
    Setting(
        "diagnosis.thresholds.false_alarm_probability",
        Number(1e-3, 0.5),
        "that chance makes the best effect worth its penalty",
    ),
    Setting(
        "diagnosis.thresholds.min_gain_share", _SHARE, "least gain of one more effect, as a share of the gain so far"
    ),
    Setting("diagnosis.thresholds.min_effect_size", _SHARE, "least size of an effect, as a share of its start values"),
    Setting(
        "diagnosis.thresholds.max_autocorrelation", _SCORE, "residual autocorrelation above which nothing is named"
    ),
    Setting(
        "diagnosis.thresholds.max_discrepancy", _DEVIATIONS, "model discrepancy from which something is missing [sd]"
    ),
    Setting(
        "diagnosis.thresholds.min_reported_shift", _DEVIATIONS, "deviation of a data-sheet value that is reported [sd]"
    ),
    Setting(
        "diagnosis.thresholds.max_tolerance_statistic", _SCORE, "gain beyond the tolerances from which the sheet is off"
    ),
    Setting("diagnosis.thresholds.max_shift", _DEVIATIONS, "deviation from which the verdict is unknown [sd]"),
    Setting(
        "diagnosis.thresholds.max_size_difference", _SHARE, "largest difference of a size between halves of the data"
    ),
    Setting("diagnosis.thresholds.form_error", _SHARE, "share of an effect's size that widens intervals"),
    Setting("diagnosis.thresholds.equivalence_margin", _SCORE, "score within which a rival is an equivalent"),
    Setting("diagnosis.substeps", Whole(1, 10_000), "physics steps of a control period, at most"),
    Setting("diagnosis.shortlist", Whole(1, 1000), "number of candidates that are fitted in each round"),
    Setting("diagnosis.exclude", _EFFECTS, "effects that are known not to be there", common=True),
    Setting("diagnosis.include", _EFFECTS, "effects that are weighed only where asked"),
    Setting("diagnosis.max_effects", Whole(1, 100), "number of effects that are named, at most", common=True),
    Setting("diagnosis.tempered_search", YesNo(), "two other searches where a doubt is left"),
    Setting("diagnosis.prior", Number(1e-6, 0.999999), "probability of an effect before anything was recorded"),
    Setting(
        "diagnosis.temperature",
        Number(0.001, 1e6),
        "factor on the gains that chance makes; the least scores follow from it",
    ),
    Setting("diagnosis.least_temperature", Number(0.001, 1e6), "least temperature of the probabilities"),
    Setting("diagnosis.misfit_share", Number(0.0, 1.0), "share of the best set's gain that is their temperature"),
    Setting("diagnosis.blocks", Whole(2, 100_000), "blocks of the data, for intervals"),
)
