"""Algorithm 1 on 20 virtual robots that hide what the data sheet does not say."""
