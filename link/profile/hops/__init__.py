"""Ways by other nodes: the contacts, and how frames are routed over them."""
