"""What becomes of what the operator gives: commands from the first word of them to their end."""
