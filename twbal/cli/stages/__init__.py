"""One file a stage: read, build, call, write."""
