"""What led to a record: the table of causes, and the chain that it leads along."""

from farside.logs.story.causes.chain import Cause, causes, causes_of, outline

__all__ = ["Cause", "causes", "causes_of", "outline"]
