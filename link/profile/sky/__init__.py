"""Where the other end is: positions, light times and conjunctions of bodies and spacecraft."""
