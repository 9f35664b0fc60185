"""How scripts/follow_parameter.py follows a parameter."""
