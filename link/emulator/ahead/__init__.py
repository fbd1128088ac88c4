"""How far ahead a link is known, and looking farther while messages pass."""
