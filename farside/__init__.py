"""Farside simulates rover missions over delayed, lossy links.

The packages, from the bottom up: `dem` (the learning controller, on its own), `link` (what
crosses, and what carries it), `rover`, `ground` and `logs` (which do not know each other), and
`missions` (which brings them together).
"""
