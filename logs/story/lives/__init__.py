"""The stories of commands, proposals, events, goals and frames, and of their way over the link."""
