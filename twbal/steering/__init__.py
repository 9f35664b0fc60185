"""A person who steers a robot: keys and sticks, and what they ask for."""
