"""What a link is: its configuration, presets, contact plans, light times and schedule."""
