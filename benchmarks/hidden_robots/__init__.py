"""Algorithm 1 on virtual robots of several families that hide what the data sheet does not say."""
