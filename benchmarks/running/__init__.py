"""What twbal adds to what it stands on: to a bare PyBullet loop, to one core, to the start of Python."""
