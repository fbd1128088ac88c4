"""How hypotheses are made, judged, differentiated and removed."""
