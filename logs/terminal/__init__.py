"""A log in the terminal: the screen, the map on it, and the replay."""
