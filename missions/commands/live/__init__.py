"""Showing a run in Foxglove, Lichtblick and Rerun."""
