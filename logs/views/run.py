"""Queries on a run: modes, goals, commands, frames and outages."""

from pathlib import Path

from farside.logs.file.reading import LogFile
from farside.logs.views.goals import GoalView
from farside.logs.views.life import LifeView
from farside.logs.views.link import LinkView


class RunView(GoalView, LifeView, LinkView):
    """Queries on a run, answered from its log. All times are simulated seconds.

    A query reads what it is about through the log's index. Only the map, the goals and the counts
    of frames are kept once they were asked for: a run may be larger than memory.

    Args:
        log: the log.
    """

    @classmethod
    def of_log(cls, path: Path) -> "RunView":
        """A view of the run in a log.

        Raises:
            LogError: if the log cannot be read.
        """
        return RunView(LogFile(path))
