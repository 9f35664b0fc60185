"""twbal: learn to balance a two-wheeled robot from a wrong simulator and very little real data."""

__version__ = "0.1.0"
