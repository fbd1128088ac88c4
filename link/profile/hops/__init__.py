"""Ways between two ends by other nodes: the contacts, how frames are routed, what both ends plan."""
