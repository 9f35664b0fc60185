"""Algorithm 1 over the firmware's program for this computer, beside the same robots without it."""
