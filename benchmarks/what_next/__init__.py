"""Whether the experiment that a diagnosis suggests decides more often than a repetition of the one before."""
