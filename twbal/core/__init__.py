"""What all parts share: the interface of a robot, its parameters, episodes, costs, errors and files."""
