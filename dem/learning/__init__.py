"""How hypotheses are created, tested, differentiated and removed."""
