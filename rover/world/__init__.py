"""The true world: terrain and body."""
