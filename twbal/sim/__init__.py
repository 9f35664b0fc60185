"""The simulated robot, in PyBullet."""
