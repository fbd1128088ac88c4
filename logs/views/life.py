"""Queries on what the operator wanted: the commands, and the script."""

from farside.control import CommandStage
from farside.logs.spans import (
    OperatorSpan,
)
from farside.logs.views.topics import TopicView
from farside.topics import (
    GROUND_COMMAND,
    GROUND_OPERATOR,
    ROVER_COMMAND,
    CommandEntry,
    CommandSent,
)


class LifeView(TopicView):
    """The commands of a run, and its operator."""

    @property
    def commands_sent(self) -> tuple[tuple[float, CommandSent], ...]:
        """Every command that the ground sent, with its log time."""
        return self.entries(GROUND_COMMAND)

    @property
    def commands_taken(self) -> tuple[tuple[float, CommandEntry], ...]:
        """Every command that the rover received, obeyed or not, with its log time."""
        return tuple(
            (t_s, entry) for t_s, entry in self.command_stages if entry.stage is CommandStage.TAKEN
        )

    @property
    def command_stages(self) -> tuple[tuple[float, CommandEntry], ...]:
        """Every stage of every command on board, with its log time."""
        return self.entries(ROVER_COMMAND)

    @property
    def operator(self) -> OperatorSpan | None:
        """Where the operator got to, `None` if there was no script."""
        last = self._last(GROUND_OPERATOR)
        if last is None:
            return None
        t_s, operator = last
        return OperatorSpan(t_s, operator.step, operator.of, operator.waiting_for, operator.left)
