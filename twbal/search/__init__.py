"""Policy search: the expected long-term cost on f + g, where to start, how to descend, and what to think of the result."""
