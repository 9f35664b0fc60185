"""A robot behind a port: firmware, hidden effects, and the process that serves them."""
