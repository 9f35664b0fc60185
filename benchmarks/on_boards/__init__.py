"""Exported policies: whether the header is the policy, and what it takes on a small board, whole and distilled."""
