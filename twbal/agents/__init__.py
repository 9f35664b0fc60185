"""Model-free agents, which learn a policy by driving a simulated robot and without a model of it."""
