"""Foxglove's WebSocket server with its play bar."""

from collections.abc import Iterable
from threading import Lock
from typing import NamedTuple, Self

from foxglove import Channel, Context, Schema, start_server
from foxglove.websocket import (
    Capability,
    ChannelView,
    Client,
    PlaybackCommand,
    PlaybackControlRequest,
    PlaybackState,
    PlaybackStatus,
    ServerListener,
)

from farside.logs.file.schemas import topic_schema
from farside.logs.foxglove.names import PICTURES
from farside.logs.live.playbar import MOST_AT_ONCE, BarState, PlayBar, Status
from farside.topics import TOPICS

TICK_S = 1 / 30
"""Wall time between two ticks: smooth to the eye (project default)."""

_TOLD_EVERY_S = 1.0  # so that whoever has just connected sees the play bar as it is
_BACKLOG = 16 * MOST_AT_ONCE

_STATUS = {
    Status.PLAYING: PlaybackStatus.Playing,
    Status.PAUSED: PlaybackStatus.Paused,
    Status.BUFFERING: PlaybackStatus.Buffering,
    Status.ENDED: PlaybackStatus.Ended,
}


class ServerError(Exception):
    """The server cannot listen where it was told to."""


class Offered(NamedTuple):
    """A channel that viewers may subscribe to.

    Attributes:
        topic: its name.
        encoding: of its messages, as MCAP names it.
        schema_name, schema_encoding, schema: of its messages.
    """

    topic: str
    encoding: str
    schema_name: str
    schema_encoding: str
    schema: bytes


def offered(*, as_ground: bool = False) -> list[Offered]:
    """The channels of a run: every topic and picture, or only what the ground knew."""
    own = [
        Offered(
            name, "json", f"farside.{topic.kind.__name__}", "jsonschema", topic_schema(topic.kind)
        )
        for name, topic in TOPICS.items()
    ]
    pictures = [
        Offered(name, "protobuf", picture.schema_name, "protobuf", picture.schema())
        for name, picture in PICTURES.items()
    ]
    return [
        channel
        for channel in (*own, *pictures)
        if not as_ground or channel.topic.startswith("/ground/")
    ]


class LiveServer(ServerListener):
    """Serves a play bar to viewers. A context manager that ends the server on exit.

    A viewer that cannot keep up loses the oldest of 16,000 messages that wait for it.

    Args:
        bar: what is played, and where it is.
        channels: what viewers may subscribe to.
        end_ns: end of the play bar.
        name: of the server, which viewers show.
        host, port: where to listen; with port 0 the system chooses one.

    Raises:
        ServerError: if it cannot listen there.
    """

    def __init__(
        self,
        bar: PlayBar,
        channels: Iterable[Offered],
        *,
        end_ns: int,
        name: str,
        host: str = "127.0.0.1",
        port: int = 8765,
    ) -> None:
        self._bar = bar
        # Requests come in on threads of the server's. What is sent in a tick is sent before the
        # next request is answered.
        self._lock = Lock()
        self._since_told_s = 0.0
        self._time_ns: int | None = None
        self._context = context = Context()  # neither the server nor a channel keeps it
        self._channels = {
            channel.topic: Channel(
                channel.topic,
                message_encoding=channel.encoding,
                schema=Schema(
                    name=channel.schema_name,
                    encoding=channel.schema_encoding,
                    data=channel.schema,
                ),
                context=context,
            )
            for channel in channels
        }
        try:
            self._server = start_server(
                name=name,
                host=host,
                port=port,
                capabilities=[Capability.Time, Capability.PlaybackControl],
                server_listener=self,
                context=context,
                playback_time_range=(0, end_ns),
                message_backlog_size=_BACKLOG,
            )
        except (RuntimeError, UnicodeError) as error:
            reason = str(error).removeprefix("FoxgloveError: Failed to bind port: ")
            raise ServerError(f"cannot listen on {host} port {port}: {reason}") from error

    @property
    def port(self) -> int:
        """The port that it listens on."""
        return self._server.port

    @property
    def app_url(self) -> str:
        """The address that opens Foxglove in a browser of this machine, connected."""
        return self._server.app_url() or ""

    @property
    def wants_more(self) -> bool:
        """See `PlayBar.wants_more`."""
        with self._lock:
            return self._bar.wants_more

    def tick(self, wall_s: float) -> None:
        """Let wall time pass, and send what is due.

        Args:
            wall_s: seconds since the last call.

        Raises:
            LogError: if the log is damaged or missing.
        """
        with self._lock:
            tick = self._bar.advance(wall_s)
            self._since_told_s += wall_s
            if tick.state is not None or self._since_told_s >= _TOLD_EVERY_S:
                self._since_told_s = 0.0
                self._server.broadcast_playback_state(_told(tick.state or self._bar.state))
            for record in tick.records:
                self._channels[record.topic].log(record.payload, log_time=record.log_time_ns)
            if tick.time_ns != self._time_ns or tick.state is not None:
                self._time_ns = tick.time_ns
                self._server.broadcast_time(tick.time_ns)

    def finish(self) -> None:
        """See `PlayBar.finish`."""
        with self._lock:
            self._bar.finish()

    def stop(self) -> None:
        """End the server."""
        self._server.stop()

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:  # noqa: ARG002
        """See `ServerListener`."""
        with self._lock:
            self._bar.subscribe(channel.topic)

    def on_playback_control_request(
        self, playback_control_request: PlaybackControlRequest
    ) -> PlaybackState:
        """See `ServerListener`."""
        request = playback_control_request
        with self._lock:
            state = self._bar.request(
                playing=request.playback_command == PlaybackCommand.Play,
                speed=request.playback_speed,
                seek_ns=request.seek_time,
            )
        return _told(state, request.request_id)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


def _told(state: BarState, request_id: str | None = None) -> PlaybackState:
    return PlaybackState(
        _STATUS[state.status], state.time_ns, state.speed, state.did_seek, request_id
    )
