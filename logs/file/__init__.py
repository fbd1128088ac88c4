"""The file of a log: writing it, packing it, and reading it by topic and time."""
