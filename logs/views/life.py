"""Queries on what the operator wanted: the commands, and the script."""

from farside.control import CommandStage
from farside.logs.spans import (
    CommandLife,
    OperatorSpan,
)
from farside.logs.views.topics import TopicView
from farside.topics import (
    GROUND_COMMAND,
    GROUND_LIFE,
    GROUND_OPERATOR,
    ROVER_COMMAND,
    CommandEntry,
    CommandSent,
    LifeEntry,
)


class LifeView(TopicView):
    """The commands of a run, and its operator."""

    @property
    def commands(self) -> tuple[CommandLife, ...]:
        """Every command that the ground sent, in order, with its whole life on both sides.

        As ground, what it had heard of that life.
        """
        told = self.is_as_ground
        lives: dict[int, CommandLife] = {}
        topics = (GROUND_COMMAND, GROUND_LIFE, *(() if told else (ROVER_COMMAND,)))
        for t_s, message in self.together(*topics):
            match message:
                case CommandSent(number=number):
                    lives[number] = CommandLife.of(message, t_s)
                case CommandEntry(number=number) if number in lives:
                    lives[number] = lives[number].reach(message.stage, t_s, message.why)
                case LifeEntry(number=number) if number in lives:
                    lives[number] = lives[number].judge(message, t_s, told=told)
        return tuple(lives.values())

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
