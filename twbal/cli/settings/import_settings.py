"""Settings of mappings, which say what the columns of a foreign log mean."""

from twbal.cli.settings.kinds import Either, ListOf, Number, OrNull, Part, Setting, Text, Whole, YesNo

_COLUMN = Either(Text("name"), Whole(1, 100_000), "name or number")
_COLUMNS = Either(_COLUMN, ListOf(_COLUMN, least=1), "column or [column,...]")
_SCALE = Number(-1e12, 1e12)
_SCALES = Either(_SCALE, ListOf(_SCALE, least=1), _SCALE.range)  # a list has one scale for each column

IMPORT = (
    Setting("import.quantities.*", OrNull(_COLUMNS), "column, by name or by number from 1 on; null: none"),
    Setting("import.quantities.*.from", _COLUMNS, "column, or columns whose mean is taken"),
    Setting("import.quantities.*.unit", Text("unit"), "unit of the column"),
    Setting("import.quantities.*.scale", _SCALES, "factor on the column; -1 turns its sign"),
    Setting("import.quantities.*.offset", Number(-1e12, 1e12), "offset that is added, in SI units"),
    Setting("import.quantities.*.wraps", OrNull(Number(1e-9, 1e12)), "range after which the column jumps back"),
    Setting("import.names", ListOf(Text("name")), "names of all columns, where files have no header"),
    Setting("import.rate", OrNull(Number(0.1, 1e6, "Hz")), "rate of the samples, where there is no time"),
    Setting("import.motor", OrNull(Part()), "motor that makes torque of a voltage; null: none"),
    Setting("import.motor.resistance", Number(1e-6, 1e6, "ohm"), "resistance of both motors as one"),
    Setting("import.motor.torque_constant", Number(1e-9, 1e4, "N·m/A"), "torque constant of both motors as one"),
    Setting("import.motor.gear", Number(1e-3, 1e5), "turns of the rotor for one of the wheel"),
    Setting("import.motor.supply", Number(0.01, 1e4, "V"), "largest voltage of the drive"),
    Setting("import.command_is_sample", YesNo(), "the command is an instant of a faster loop"),
    Setting("import.command_before_sample", YesNo(), "a row's command acted before its sample"),
    Setting("import.skip", Number(0.0, 1e6, "s"), "time left out at the beginning of each recording"),
    Setting("import.fill", Whole(0, 10_000, "samples"), "samples in a row that may be missing"),
)
