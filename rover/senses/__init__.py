"""What the rover senses of the world."""
