"""Methods beside each other on the same hidden robots."""
