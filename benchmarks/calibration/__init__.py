"""How the probabilities of a diagnosis are corrected, and how well."""
