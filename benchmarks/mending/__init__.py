"""Whether a simulation that is mended by what a diagnosis names leaves less for g to learn."""
