"""Queries on a run, by subject; a `RunView` has them all."""

from farside.logs.views.run import RunView

__all__ = ["RunView"]
