"""How long a policy's validation on long rollouts of f + g takes."""
