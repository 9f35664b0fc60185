"""What a free-form effect draws of functions that are hidden in robots of another engine."""
