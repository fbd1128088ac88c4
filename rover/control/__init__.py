"""Shared control on board: who drives, what is proposed, and the cycle of the controller."""
