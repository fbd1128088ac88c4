"""Orders from outside a run: those of a log, and those that a program gives at set times."""
