"""What must be right on a computer before it drives a robot."""
