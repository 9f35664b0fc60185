"""Models of the robot's dynamics, learned from episodes: f from simulation, g from what f leaves of the robot."""
