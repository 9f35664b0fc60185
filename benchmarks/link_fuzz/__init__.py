"""Noise into both decoders, and sessions with broken frames against a model of the robot's states."""
