"""Who decides at the ground."""
