"""What every simulation of a robot has in common, whatever integrates it."""
