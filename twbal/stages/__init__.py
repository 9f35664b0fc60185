"""One file a stage: read, build, call, write. Only here and in `cli.py` is Hydra known."""
