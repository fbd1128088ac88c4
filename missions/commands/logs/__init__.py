"""The commands that read a log."""
