"""Whether what twbal makes of logged data is still what it made before."""
