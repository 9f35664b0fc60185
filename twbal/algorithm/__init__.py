"""Algorithm 1 as a library: rollouts, collections of them, and what a run came to."""
