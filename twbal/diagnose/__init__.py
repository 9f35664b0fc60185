"""Find where simulation and measurement disagree, name the missing effect, add it, and show that the gap shrinks."""
