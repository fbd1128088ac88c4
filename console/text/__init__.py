"""The operator's place in a terminal: the screen of a session, and its keys."""
