"""Policy search: the expected long-term cost on f + g, where to start, how to descend, and how to judge the result."""
