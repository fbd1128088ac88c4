"""Queries on a run, by subject; `run` has them all."""
