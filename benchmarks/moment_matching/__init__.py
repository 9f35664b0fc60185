"""How long one expected long-term cost with its gradient takes, beside the peer and beside exact sums over pairs."""
