"""Ways between two ends by other nodes: contacts, how frames are routed, what both ends plan."""
