"""Direct-current motors behind gears: from the voltage that a log holds to the torque that twbal commands."""

from dataclasses import dataclass, fields

from twbal.core.errors import ConfigError


@dataclass(frozen=True)
class Motor:
    """Both motors of a robot together, as one.

    With a voltage U the wheels get the torque N K (U - N K ω) / R. The first part is the command; the second, the
    back-EMF, is viscous friction at the joints and belongs to the simulation: taken off with the measured speed, it
    would carry that speed's noise into the command, and its damping out of the model.

    Attributes:
        resistance: R, of the armature [Ω].
        torque_constant: K [N·m/A], which is that of the EMF too [V·s/rad].
        gear: N, turns of the rotor for one of the wheel.
        supply: largest voltage that the drive puts out [V]; requests beyond it are clipped.

    Raises:
        ConfigError: a value that no motor can have.
    """

    resistance: float
    torque_constant: float
    gear: float
    supply: float

    def __post_init__(self) -> None:
        for field in fields(self):
            if not 0 < getattr(self, field.name) < float("inf"):
                raise ConfigError(f"A motor's {field.name} must be positive; found {getattr(self, field.name)}.")

    @property
    def torque_per_volt(self) -> float:
        """Torque of both wheels at a standstill for 1 V [N·m/V]."""
        return self.gear * self.torque_constant / self.resistance
