"""What is tried on a robot with its wheels off the ground, before its first rollout."""
