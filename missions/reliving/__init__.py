"""Living a run again from its log: to ask it, to prove it, and to see it go otherwise."""
