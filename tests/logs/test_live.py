"""A log served to Foxglove: what an app gets over the WebSocket, and what its play bar does."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from foxglove_app import FoxgloveApp, Message, State, Time

from farside.logs import LogFile
from farside.logs.live.feeds import LogFeed
from farside.logs.live.playbar import PlayBar
from farside.logs.live.server import LiveServer, ServerError, offered
from farside.logs.playing import Player
from farside.node import to_ns
from farside.topics import TOPICS, TRUTH_POSE

END_S = 10


@pytest.fixture
def log(run: Any, path: Path) -> LogFile:
    """A log with a pose at every full second, which the ground hears of a second later."""
    run.start().goal(2, "at:A")
    for t_s in range(1, END_S):
        run.stand(t_s, "at:D").hear(t_s + 1, "at:D", since_s=t_s)
    return LogFile(run.log(path))


@contextmanager
def _serving(
    log: LogFile, *, speed: float = 1.0, as_ground: bool = False
) -> Iterator[tuple[LiveServer, FoxgloveApp]]:
    """A server whose wall time passes as the test says, and an app connected to it."""
    feed = LogFeed(log.as_ground() if as_ground else log)
    bar = PlayBar(Player(feed, speed=speed), feed, feed.end_ns)
    with (
        LiveServer(
            bar, offered(as_ground=as_ground), end_ns=feed.end_ns, name="a run", port=0
        ) as server,
        FoxgloveApp(server.port) as app,
    ):
        yield server, app


def _subscribe(server: LiveServer, app: FoxgloveApp, *topics: str, playing: bool = True) -> None:
    """Subscribe to topics with a message, and take in the last one of each."""
    app.subscribe(*topics)
    app.ask(play=playing)  # what is answered came behind the subscriptions
    server.tick(0)
    app.until(lambda: {message.topic for message in app.messages} >= set(topics))


def _poses_until(app: FoxgloveApp, last_s: float, since: int = 0) -> list[float]:
    """Log times of the poses that come up to one; what comes, comes in the order it was sent."""

    def poses_s() -> list[float]:
        return [
            message.time_ns / 1e9
            for message in app.messages[since:]
            if message.topic == "/truth/pose"
        ]

    app.until(lambda: last_s in poses_s())
    return poses_s()


def test_the_app_sees_every_topic_with_its_schema_and_a_play_bar_of_the_whole_log(
    log: LogFile,
) -> None:
    with _serving(log) as (_, app):
        app.until(lambda: len(app.channels) == len(offered()))
        assert {"time", "playbackControl"} <= set(app.info["capabilities"])
        assert app.info["dataEndTime"] == {"sec": END_S, "nsec": 0}
        assert app.channels.keys() > TOPICS.keys()
        pose = app.channels["/truth/pose"]
        assert (pose["encoding"], pose["schemaEncoding"]) == ("json", "jsonschema")
        assert "x_m" in json.loads(pose["schema"])["properties"]


def test_messages_come_when_they_are_due_and_as_they_were_recorded(log: LogFile) -> None:
    with _serving(log) as (server, app):
        _subscribe(server, app, "/truth/yard", "/truth/pose")
        server.tick(1.5)
        server.tick(1.0)
        app.until(lambda: Time(to_ns(2.5)) in app.got)
        assert _poses_until(app, 2) == [0, 1, 2]
        recorded = {record.log_time_ns: record.payload for record in log.records([TRUTH_POSE])}
        poses = [message for message in app.messages if message.topic == "/truth/pose"]
        assert all(pose.payload == recorded[pose.time_ns] for pose in poses)


def test_pause_stops_and_play_goes_on_at_the_speed_that_is_asked_for(log: LogFile) -> None:
    with _serving(log) as (server, app):
        _subscribe(server, app, "/truth/pose")
        assert app.ask(play=False) == State("paused", 0, 1.0, did_seek=False, request="request 2")
        server.tick(9.0)
        assert app.ask(play=True, speed=2.0).status == "playing"
        server.tick(1.0)
        assert _poses_until(app, 2) == [0, 1, 2]
        app.until(lambda: Time(to_ns(2)) in app.got)
        assert Time(to_ns(9)) not in app.got


def test_a_seek_jumps_and_brings_what_is_so_there(log: LogFile) -> None:
    with _serving(log) as (server, app):
        app.subscribe("/rover/goal")  # there is none at the start
        _subscribe(server, app, "/truth/pose", playing=False)
        seen = len(app.messages)

        answer = app.ask(play=True, seek_ns=to_ns(7.5))
        assert (answer.time_ns, answer.did_seek) == (to_ns(7.5), True)
        for wall_s in (0, 0, 0, 1.0):
            server.tick(wall_s)
        assert _poses_until(app, 8, seen) == [7, 8]
        assert app.messages[seen].time_ns == to_ns(2)  # the goal


def test_at_the_end_the_play_bar_says_so_and_a_seek_plays_again(log: LogFile) -> None:
    with _serving(log) as (server, app):
        _subscribe(server, app, "/truth/pose")
        server.tick(99.0)
        app.until(lambda: app.states[-1].status == "ended")
        assert _poses_until(app, 9) == list(range(10))
        seen = len(app.messages)
        assert app.ask(play=True, seek_ns=0).status == "playing"
        for wall_s in (0, 0, 0, 1.0):
            server.tick(wall_s)
        assert _poses_until(app, 1, seen) == [0, 1]


def test_a_second_app_that_comes_late_gets_what_is_so_and_the_state(log: LogFile) -> None:
    with _serving(log) as (server, app):
        _subscribe(server, app, "/truth/pose")
        server.tick(4.5)
        with FoxgloveApp(server.port) as late:
            late.subscribe("/rover/goal")
            late.ask(play=True)
            server.tick(0)
            late.until_messages(1)
            assert late.messages[0].time_ns == to_ns(2)
            assert late.states[-1].status == "playing"


def test_as_ground_no_seek_shows_what_it_could_not_know_then(log: LogFile) -> None:
    with _serving(log, as_ground=True) as (server, app):
        app.until(lambda: len(app.channels) == len(offered(as_ground=True)))
        assert {topic.split("/")[1] for topic in app.channels} == {"ground"}
        app.subscribe(*app.channels)
        for seek_s in (9.5, 3.5, 8.5, 2.5):
            app.ask(play=False, seek_ns=to_ns(seek_s))
            seen, known = len(app.messages), log.as_ground(to_ns(seek_s)).latest_each(to_ns(END_S))
            for _ in range(3):
                server.tick(1.0)
            app.until_messages(seen + len(known))
            assert app.messages[seen:] == [
                Message(record.topic, record.log_time_ns, record.payload) for record in known
            ]
            assert max(record.log_time_ns for record in known) == to_ns(int(seek_s))


def test_a_port_that_is_taken_is_refused(log: LogFile) -> None:
    with _serving(log) as (server, _):
        feed = LogFeed(log)
        bar = PlayBar(Player(feed), feed, feed.end_ns)
        with pytest.raises(ServerError, match=f"127.0.0.1 port {server.port}: Address already"):
            LiveServer(bar, (), end_ns=0, name="another", port=server.port)
