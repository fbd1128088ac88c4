"""What a fake session shows: a rover walks through blackout's yard, and everything is there."""

from fake_session import LIGHT_NS, START_NS, FakeSession

from farside.console.screen.screen import (
    CommandRow,
    EventRow,
    ExerciseStep,
    Ghost,
    GoalRow,
    GoalSpot,
    MapView,
    OptionRow,
    Pose,
    ProposalCard,
    Said,
    Screen,
    Spot,
    Strip,
    StripWord,
    Tone,
)
from farside.ground.view.view import OptionKind
from farside.node import Direction, to_ns, to_s

YARD = (
    "#################",
    "#A..##....##..B##",
    "#...##..o.##...##",
    "#...##....##...##",
    "##.###.##.###.###",
    "#...............#",
    "###.#D##.####.###",
    "#....##...#....##",
    "#C...##...#....##",
    "#################",
)
STEP_NS = to_ns(4.0)
WALK = [(5, 3), (5, 4), (6, 4), (7, 4), (8, 4), (9, 4), (10, 4), (11, 4), (12, 4), (13, 4)]
WALK += [(13, 5), (13, 6), (13, 7), (13, 8), (14, 8)]
TURNS = {(0, 1): "N", (1, 0): "E", (0, -1): "S", (-1, 0): "W"}


def _at(now_ns: int) -> tuple[int, float]:
    """Which step of the walk the rover is in, and how far."""
    done = max(0, now_ns - START_NS) % (STEP_NS * (len(WALK) - 1))
    return done // STEP_NS, done % STEP_NS / STEP_NS


def _pose(now_ns: int) -> Pose:
    step, part = _at(now_ns)
    (east, north), (to_east, to_north) = WALK[step], WALK[step + 1]
    heading = {"E": 0.0, "N": 1.5708}[TURNS[to_east - east, to_north - north]]
    x = east + 0.5 + part * (to_east - east)
    return Pose(x, north + 0.5 + part * (to_north - north), heading)


def _turn(step: int) -> str:
    (east, north), (to_east, to_north) = WALK[step], WALK[min(step + 1, len(WALK) - 1)]
    return TURNS.get((to_east - east, to_north - north), "N")


def screen_of(session: FakeSession) -> Screen:
    """What is shown now."""
    now, rover = session.now_ns, session.now_ns - LIGHT_NS
    step, _ = _at(rover)
    commands = _commands(session, step)
    proposed = _turn(min(step + 2, len(WALK) - 2))
    return Screen(
        mission="blackout",
        now_ns=now,
        rover_ns=rover,
        end_ns=to_ns(1200.0),
        speed=session.pacing.speed,
        paused=session.pacing.paused,
        warp="" if session.pacing.until is None else f"until {session.pacing.until}",
        slowed="" if session.pacing.until else "proposal 14 has come",
        over=session.over,
        mode=Said("", session.mode.upper()),
        status=(
            Said("link", "1.28 s ↑↓"),
            Said("heard", "1.4 s ago"),
            Said("next outage", f"in {max(0.0, 620.0 - to_s(now)):.0f} s", Tone.CAUTION),
            Said("", "not known to the rover"),
        ),
        on_the_way=sum(not command.is_over for command in commands),
        if_nothing=session.over or "If you do nothing: the rover stands and waits for your word.",
        proposal=_proposal(session, proposed),
        options=_options(session, step, proposed),
        commands=commands,
        goals=tuple(
            GoalRow(
                (f"at:{name}",),
                f"{name}, priority {2 - order}, {'yours' if not order else 'the mission'}",
            )
            for order, name in enumerate(session.goals)
        ),
        rover=(
            Said("at", f"{WALK[step][0]},{WALK[step][1]}"),
            Said("battery", "92 %"),
            Said("", "driving"),
            Said("tilt", "3°, 14 s ago", stale=True),
        ),
        model=(Said("", "48 Signs"), Said("", "74 hypotheses"), Said("", "in step")),
        failsafe=(
            Said("", "nominal"),
            Said("", "holds after 10 s of silence, alone at 30 s: then B, C"),
        ),
        link=(Said("up", "12 % used"), Said("down", "48 % used"), Said("store", "nothing waits")),
        map=_map(session, step),
        strip=_strip(session, commands),
        events=tuple(
            EventRow(
                number,
                START_NS + number * STEP_NS,
                START_NS + number * STEP_NS + LIGHT_NS,
                f"command {88 + number}: drive {_turn(number)} done",
                routine=number % 2 == 0,
            )
            for number in range(step, -1, -1)
        ),
        alarms=tuple(session.alarms.values()),
        exercise=(
            ExerciseStep("Drive the rover three places", "arrows or W A S D", True),
            ExerciseStep("Let it propose: set the mode to shared", "M, then S", True),
            ExerciseStep("Consent to a proposal", "Enter, while one stands", False),
            ExerciseStep("Override one", "choose another action", False),
        ),
    )


def _proposal(session: FakeSession, action: str) -> ProposalCard:
    answered = session.answers.get(session.number, "")
    window = session.veto_window_s
    return ProposalCard(
        session.number,
        action,
        f"Proposal {session.number}: {action}, towards B",
        (
            Said("", "24.1 s to go"),
            Said("", "as planned 83 %"),
            Said("", "made 2.7 s ago"),
        ),
        conflicts=("blocked at 12,4 was learned after it was made",),
        runner_up="runner-up N, 3.2 s dearer",
        answered=answered,
        veto_left_s=window and window / 3,
        veto_window_s=window,
        can_answer=not answered,
    )


def _options(session: FakeSession, step: int, proposed: str) -> tuple[OptionRow, ...]:
    east, north = WALK[min(step + 2, len(WALK) - 1)]
    kinds = {"N": OptionKind.FREE, "E": OptionKind.FREE}
    kinds |= {"S": OptionKind.INVALID, "W": OptionKind.PROBLEMATIC}
    kinds[proposed] = OptionKind.PROPOSED
    severity = {OptionKind.INVALID: 1.0, OptionKind.PROBLEMATIC: 0.6}
    why = {
        OptionKind.INVALID: "a wall was met here",
        OptionKind.PROBLEMATIC: "C_m 0.31; blocked here once before",
        OptionKind.PROPOSED: "proposed, 24.1 s to go",
    }
    rows = []
    for turn, action in sorted(TURNS.items(), key=lambda item: "NESW".index(item[1])):
        kind = kinds[action]
        overrides = f"overrides proposal {session.number} with {action}"
        does = f"approves proposal {session.number}" if action == proposed else overrides
        spots = (Spot(east + turn[0], north + turn[1], 0.83), Spot(east, north, 0.12))
        rows.append(
            OptionRow(action, kind, severity.get(kind, 0.0), does, why.get(kind, ""), spots)
        )
    return tuple(rows)


def _commands(session: FakeSession, step: int) -> tuple[CommandRow, ...]:
    """One command a step: made two light times and a second before it begins."""
    rows = []
    for number in range(step + 3, max(-1, step - 3), -1):
        begins = START_NS + number * STEP_NS
        seen = begins + STEP_NS + LIGHT_NS
        made = begins - 2 * LIGHT_NS - to_ns(3.0)
        until = begins - LIGHT_NS
        if session.now_ns < made:
            continue
        name, text = 88 + number, f"drive {_turn(min(number, len(WALK) - 2))}"
        if name in session.taken_back:
            rows.append(CommandRow(name, text, ("withdrawn",), is_over=True))
        elif session.now_ns >= seen:
            rows.append(CommandRow(name, text, ("done",), is_over=True))
        elif session.now_ns >= begins:
            within = f"word within {to_s(seen - session.now_ns):.1f} s"
            rows.append(CommandRow(name, text, ("under way, on time", within), seen_ns=seen))
        else:
            can = session.now_ns < until
            told = [f"begins in {to_s(begins - session.now_ns):.1f} s"]
            if can:
                told.append(f"take back: {to_s(until - session.now_ns):.1f} s left")
            rows.append(
                CommandRow(
                    number=name,
                    text=text,
                    words=tuple(told),
                    begins_ns=begins,
                    seen_ns=seen,
                    take_back_until_ns=until if can else None,
                    can_take_back=can,
                )
            )
    words = ("held until the link is up",)
    held = CommandRow(0, "mode autonomous", words, can_take_back=True, held=3)
    return (held, *rows)


def _map(session: FakeSession, step: int) -> MapView:
    spots = [Spot(*place, 0.83 - 0.1 * n) for n, place in enumerate(WALK[step : step + 4])]
    goal = session.looked_at or (session.goals or ["B"])[0]
    return MapView(
        heard=_pose(session.now_ns - 2 * LIGHT_NS),
        heard_label="as of 1.4 s ago",
        now=Ghost(
            (spots[0], Spot(spots[0].east, spots[0].north + 1, 0.12)),
            None,
            "now, as predicted 83 %",
        ),
        after=(
            *(
                Ghost((spot,), 88 + step + n, f"after {88 + step + n}")
                for n, spot in enumerate(spots[1:], 1)
            ),
            Ghost((Spot(8, 6, 0.3), Spot(8, 7, 0.25), Spot(9, 7, 0.2)), 99, "after 99"),
        ),
        track=tuple(Spot(*place, 4.0 * (step - n)) for n, place in enumerate(WALK[: step + 1])),
        committed=tuple(Spot(*place, 0.8) for place in WALK[step : step + 3]),
        policy=tuple(
            Spot(*place, 4.0 * (len(WALK) - n)) for n, place in enumerate(WALK) if n >= step
        ),
        policy_label=f"to {goal}: 24.1 s to go, as planned 83 %",
        goals=tuple(
            GoalSpot(
                *{"B": (14, 8), "C": (1, 1), "A": (1, 8)}.get(name, (8, 2)), name, order, order == 1
            )
            for order, name in enumerate(session.goals, 1)
        ),
        heat=_heat() if session.heat else (),
    )


def _heat() -> tuple[Spot, ...]:
    high = len(YARD) - 1
    return tuple(
        Spot(east, high - row, 4.0 * (abs(east - 14) + abs(high - row - 8)))
        for row, line in enumerate(YARD)
        for east, character in enumerate(line)
        if character not in "#o" and east > 4
    )


def _strip(session: FakeSession, commands: tuple[CommandRow, ...]) -> Strip:
    now = session.now_ns
    second = to_ns(1.0)
    words = [
        StripWord(Direction.DOWN, "telemetry", n * second - LIGHT_NS, n * second, routine=True)
        for n in range((now - to_ns(30.0)) // second, now // second + 2)
    ]
    for row in commands:
        if row.number:
            begins = START_NS + (row.number - 88) * STEP_NS
            sent = begins - 2 * LIGHT_NS - to_ns(2.0)
            words.append(
                StripWord(
                    Direction.UP,
                    f"command {row.number}: {row.text}",
                    sent,
                    sent + LIGHT_NS,
                    str(row.number),
                )
            )
    words.append(
        StripWord(
            Direction.DOWN, "proposal 14", now - to_ns(4.0), now - to_ns(4.0) + LIGHT_NS, "14"
        )
    )
    return Strip(
        from_ns=now - to_ns(20.0),
        until_ns=now + to_ns(20.0),
        known_ns=now - LIGHT_NS,
        words=tuple(sorted(words, key=lambda word: word.sent_ns)),
        begins=tuple((row.number, row.begins_ns) for row in commands if row.begins_ns),
        take_backs=tuple(
            (row.number, row.take_back_until_ns) for row in commands if row.take_back_until_ns
        ),
        gaps=((now + to_ns(9.5), now + to_ns(30.0)), (now - to_ns(14.0), now - to_ns(12.0))),
    )
