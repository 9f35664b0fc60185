"""Settings of a person's steering."""

from twbal.cli.settings.kinds import Number, Setting, Whole, YesNo
from twbal.cli.settings.robot_settings import COURSE

_SHARE = Number(0.01, 1.0)
_BUTTON = Whole(0, 255)
_NOT_STEERED = ("course", "course.segments")

STEERING = (
    Setting("steering.speed_step", _SHARE, "change of the speed by a key, per speed limit", common=True),
    Setting("steering.turn", _SHARE, "yaw rate while a key asks for a turn, per limit", common=True),
    Setting("steering.input_timeout", Number(0.05, 60.0, "s"), "time without a key before the reference ramps to rest"),
    Setting("steering.stick_timeout", Number(0.05, 60.0, "s"), "time without an event of the gamepad before it does"),
    Setting("steering.hold", YesNo(), "keeps the asked speed when no key is pressed", common=True),
    *(row._replace(key=row.key.replace("course", "steering", 1)) for row in COURSE if row.key not in _NOT_STEERED),
    Setting("gamepad.speed_axis", _BUTTON, "axis for the speed"),
    Setting("gamepad.turn_axis", _BUTTON, "axis for turns"),
    Setting("gamepad.rest_button", _BUTTON, "button that brings the robot to rest"),
    Setting("gamepad.stop_button", _BUTTON, "button that switches the motors off"),
    Setting("gamepad.end_button", _BUTTON, "button that brings the robot to rest, and ends the drive"),
)
