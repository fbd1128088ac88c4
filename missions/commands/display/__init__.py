"""What commands show in a terminal: progress while they work, and a summary at the end."""
