"""What recordings show of the effects that are hidden in a robot, where no search has to find them."""
