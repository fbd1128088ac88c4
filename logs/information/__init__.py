"""What a log tells at a glance: of its run, or of what the ground knew."""
