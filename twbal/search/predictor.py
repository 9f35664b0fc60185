"""What rollouts are predicted by."""

from enum import StrEnum


class Predictor(StrEnum):
    """What a rollout is predicted by."""

    MODEL = "model"
    """f + g, or f or g alone, by moment matching or particles."""
    ROBOTS = "sampled robots"
    """Planar robots with parameters drawn from their distribution, by Monte Carlo."""
