"""What a person at the ground is shown, in words and shapes: one for the page and the terminal."""
