"""Faults of line, robot and host while a robot is driven, and whether each is ridden out or ends in good order."""
