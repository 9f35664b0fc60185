"""The simulated robot (PyBullet) and the effects that a data sheet leaves out."""
