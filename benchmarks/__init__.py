"""Benchmarks: what the README's tables are made from. Off by default; `make bench` runs them all."""
