"""What a person at the ground is shown beside the log: what follows from all that is known."""
