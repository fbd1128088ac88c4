"""Crews: the three nodes of a run, in one process or in a process each over Zenoh."""
