"""What the check sends when, and how it arrives."""
