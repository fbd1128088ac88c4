"""Missions in other people's tests: the pytest plugin."""
