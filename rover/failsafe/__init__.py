"""The failsafe: what it looks at, and what it makes of that."""
