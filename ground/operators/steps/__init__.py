"""The steps of an operator's work: driving, teaching, goals and their review."""
