"""Robot sheets of a person's own: what is asked to write one, how one is changed, and what was tried of the robot."""
