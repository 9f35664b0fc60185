"""Policies: from the state to the command."""
