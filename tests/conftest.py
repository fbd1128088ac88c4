"""Fixtures for all tests: `pytester` runs the tests that documents show."""

pytest_plugins = ["pytester"]
