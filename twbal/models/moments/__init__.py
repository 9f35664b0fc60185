"""Moments of a GP's prediction at a normally distributed input (eq. 5-8), and their derivatives."""
