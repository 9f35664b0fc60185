"""Policies as C headers for the robot's own processor: written, checked, sized, and made smaller."""
