"""What a data sheet leaves out: one file an effect."""
