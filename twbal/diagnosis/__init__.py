"""Find where simulation and measurement disagree, name the missing effect, and say how sure that is."""
