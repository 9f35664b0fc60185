"""The command line: stages under Hydra, their files and their settings. Only here is Hydra known."""
