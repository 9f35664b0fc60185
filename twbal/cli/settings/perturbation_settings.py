"""Settings of what a virtual robot is changed by, to see what policies survive."""

from twbal.cli.settings.kinds import ListOf, Number, Setting, Whole
from twbal.cli.settings.robot_settings import SENSORS


def _levels(low: float, high: float, unit: str = "") -> ListOf:
    return ListOf(Number(low, high, unit), 1, 20)


PERTURBATION = (
    Setting("perturbation.model_error", _levels(1e-3, 0.95), "share by which mass, its height and torque gain are off"),
    Setting("perturbation.sensor_noise", _levels(1e-3, 1e4), "noise added to the sensors', times `perturbation.noise`"),
    Setting("perturbation.torque_noise", _levels(1e-4, 10.0), "sd of a random torque, per torque limit"),
    Setting("perturbation.motor_lag", _levels(1e-4, 10.0, "s"), "added to the motors' time constant"),
    Setting("perturbation.delay", _levels(1e-4, 10.0, "s"), "added to the delay of the command"),
    Setting("perturbation.pushes", _levels(1e-3, 1e5, "N·s"), "impulse for a body of 10 kg, in proportion to the mass"),
    *(
        Setting(f"perturbation.noise.{name}", Number(0.0, 1e4, unit), "sd of noise that `sensor_noise` multiplies")
        for name, unit in SENSORS.items()
    ),
    Setting("perturbation.push_time", Number(0.0, 3600.0, "s"), "when a push begins"),
    Setting("perturbation.push_duration", Number(0.001, 100.0, "s"), "length of a push"),
    Setting("perturbation.trials", Whole(1, 100_000), "trials of each level on each robot"),
    Setting("perturbation.first_trial", Whole(0, 1_000_000_000), "number of the first, which draws start and noise"),
)
