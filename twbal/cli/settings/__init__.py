"""The table of settings: of each its kind, unit, range and meaning, from which checks, help and docs are made."""
