"""The person's place at the ground: the screen, and the page, terminal and stick that show it.

It talks to a run only through its watcher and its orders, and is shown what the ground knows.
"""
