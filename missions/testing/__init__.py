"""The pytest plugin, for missions in other people's tests."""
