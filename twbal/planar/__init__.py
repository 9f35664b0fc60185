"""The planar (analytical) model: a robot that only drives straight ahead, by its equations of motion."""
