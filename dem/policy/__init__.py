"""How the model acts: the Dynamic Policy Map, the policy path, and curiosity."""
