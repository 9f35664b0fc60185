"""What policies that were learned once survive, by several methods on the same robots."""
