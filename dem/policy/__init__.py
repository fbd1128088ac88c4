"""From hypotheses to what to do: the Dynamic Policy Map, its paths, and curiosity."""
