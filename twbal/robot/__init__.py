"""What a two-wheeled robot is, in SI units, without any engine."""
