"""What can never come about in a mission is warned of, and nothing else is."""

from pathlib import Path

import pytest

from farside.missions.advice import warnings
from farside.missions.loading import load_mission
from farside.validation import dotted

YARD = """\
name = "yard"
duration_s = 300
world.map = '''
######
#A..B#
#..D.#
######
'''
rover.start = "D"
link.up.delay_s = 1
link.down.delay_s = 1
"""

BLACKOUT = "[[link.blackouts]]\nstart_s = 100\nend_s = 150\n"
GUIDED_GOAL = '[[ground.script]]\ndo = "goal"\nplace = "A"\n'
AWAIT = '[[ground.script]]\ndo = "await"\nplace = "B"\n'
PRELOADED = '[[rover.goals]]\nplace = "B"\n'


def mode(name: str) -> str:
    return f'[[ground.script]]\ndo = "mode"\nmode = "{name}"\n'


def warned(tmp_path: Path, *tables: str) -> list[str]:
    """The warnings of the yard with these tables, as `farside check` prints them."""
    path = tmp_path / "yard.toml"
    path.write_text(YARD + "".join(tables))
    found = warnings(load_mission(path, ["ground.heartbeat_s=2"]).mission)
    return [f"{dotted(key)}: {text}" for key, text in found]


@pytest.mark.parametrize(
    "tables",
    [
        (mode("shared"), GUIDED_GOAL),
        (mode("autonomous"), GUIDED_GOAL),
        (GUIDED_GOAL, BLACKOUT),
        ('[[ground.script]]\ndo = "tour"\nplaces = ["A"]\n', GUIDED_GOAL),
        (PRELOADED, BLACKOUT, AWAIT),
        (mode("shared"), GUIDED_GOAL, AWAIT.replace('"B"', '"A"')),
        ('[[ground.script]]\ndo = "wait"\nuntil_s = 299\n',),
        ('[[expect]]\nwhat = "charge"\nat_least = 0.5\n',),
        (mode("shared"), GUIDED_GOAL, '[[expect]]\nwhat = "reached"\nplace = "A"\n'),
        (AWAIT, PRELOADED, "[[link.changes]]\nat_s = 9\nloss = 1.0\n"),
    ],
)
def test_what_may_come_about_is_not_warned_of(tmp_path: Path, tables: tuple[str, ...]) -> None:
    assert warned(tmp_path, *tables) == []


@pytest.mark.parametrize(
    ("tables", "warning"),
    [
        (
            (GUIDED_GOAL,),
            (
                "ground.script.0.do: waits for goal A to be reached, but a guided rover acts on no "
                'goal: put a step with do = "mode" and mode = "shared" before it'
            ),
        ),
        (
            (mode("shared"), mode("guided"), GUIDED_GOAL, BLACKOUT.replace("150", "120")),
            (
                "ground.script.2.do: waits for goal A to be reached, but a guided rover acts on no "
                'goal: put a step with do = "mode" and mode = "shared" before it'
            ),
        ),
        (
            (AWAIT, BLACKOUT),
            (
                "ground.script.0.place: waits for goal B, which no step before sets, and which is "
                "not in rover.goals"
            ),
        ),
        (
            (AWAIT, PRELOADED),
            (
                "ground.script.0.place: waits for goal B of rover.goals, which is pursued only "
                "when the link is lost: no outage of the uplink lasts 30 s"
            ),
        ),
        (
            ('[[ground.script]]\ndo = "wait"\nuntil_s = 300\n',),
            "ground.script.0.until_s: waits until 300 s, but the run ends at 300 s",
        ),
        (
            ("[rover.body]\nradius_m = 0.5\n",),
            "rover.body.radius_m: the rover is as wide as a cell of 1 m: it will be blocked",
        ),
        (
            ('[[expect]]\nwhat = "reached"\nplace = "A"\n',),
            (
                "expect.0.place: expects goal A, which no step before sets, and which is not in "
                "rover.goals"
            ),
        ),
        (
            (
                *(PRELOADED, "[[link.changes]]\nat_s = 9\nloss = 1.0\n"),
                '[[expect]]\nwhat = "reached"\nplace = "B"\nin_blackout = true\n',
            ),
            "expect.0.in_blackout: the mission has no blackout",
        ),
        (
            (
                "[rover.battery]\ninitial = 0.4\n",
                '[[expect]]\nwhat = "charge"\nat_least = 0.5\n',
            ),
            "expect.0.at_least: the battery begins with less: 0.4",
        ),
    ],
)
def test_what_can_never_come_about_is_warned_of(
    tmp_path: Path, tables: tuple[str, ...], warning: str
) -> None:
    assert warned(tmp_path, *tables) == [warning]


def test_of_an_operator_of_ones_own_nothing_is_known() -> None:
    """Nobody can tell which goals it sets. What nobody reads is warned of."""
    own = {"ground.operator": "caller:Caller", "ground.operator_options.places": ["A"]}
    expects = [{"what": "reached", "place": "A"}]
    loaded = load_mission("blackout", own | {"expect": expects, "ground.script": []})
    assert list(warnings(loaded.mission)) == []
    loaded = load_mission(
        "blackout", own | {"rover.controller": "pathfinder:Pathfinder", "rover.dem.alpha": 0.3}
    )
    assert [f"{dotted(key)}: {text}" for key, text in warnings(loaded.mission)] == [
        'ground.script: is not read: ground.operator is "caller:Caller"',
        'rover.dem: is not read: rover.controller is "pathfinder:Pathfinder"',
    ]


def test_what_the_operator_does_not_read_is_warned_of() -> None:
    rule = {"rule": "cost", "below": 9.0}
    found = {
        "ground.operator": "absent",
        "ground.guide.times": 2,
        "ground.supervisor.goals": [{"place": "A"}],
        "ground.recorded.log": "some.mcap",
        "ground.rules": [rule],
        "expect": [],
    }
    told = [
        f'ground.{table}: {word} not read: ground.operator is "absent"'
        for table, word in (
            ("script", "is"),
            ("guide", "is"),
            ("supervisor", "is"),
            ("recorded", "is"),
            ("rules", "are"),
        )
    ]
    mission = load_mission("blackout", found).mission
    assert [f"{dotted(key)}: {text}" for key, text in warnings(mission)] == told


def test_rules_that_no_step_goes_by_are_warned_of(tmp_path: Path) -> None:
    rules = '[[ground.rules]]\nrule = "cost"\nbelow = 9\n'
    assert warned(tmp_path, rules, '[[ground.script]]\ndo = "teach"\n') == [
        "ground.rules: are not read: no step answers proposals or supervises"
    ]
    assert warned(tmp_path, rules, mode("shared"), GUIDED_GOAL) == []


def test_goals_that_a_supervisor_or_a_last_word_sets_may_be_waited_for(tmp_path: Path) -> None:
    leave = '[[ground.script]]\ndo = "leave"\ngoals = [{ place = "B" }]\n'
    assert warned(tmp_path, leave, AWAIT) == []
    assert warned(tmp_path, leave.replace("leave", "supervise"), AWAIT) == []
    assert warned(tmp_path, '[[ground.script]]\ndo = "supervise"\n') == [
        "ground.script.0.goals: there is no goal: nothing is done"
    ]


def test_the_shipped_missions_are_not_warned_of() -> None:
    assert list(warnings(load_mission("blackout").mission)) == []


def test_of_a_hold_that_a_single_lost_heartbeat_would_lead_to(tmp_path: Path) -> None:
    assert warned(tmp_path, "[rover.failsafe]\nhold_after_s = 4.0\n") == [
        (
            "rover.failsafe.hold_after_s: silence counts from 5 s on, which is 2.5 heartbeats: "
            "a single lost one is none"
        )
    ]


def test_of_a_tour_to_where_nobody_hears_the_rover(tmp_path: Path) -> None:
    dark = YARD.replace("#..D.#", "#.~D.#")
    path = tmp_path / "dark.toml"
    path.write_text(dark + '[[ground.script]]\ndo = "tour"\nplaces = ["A", "2,1"]\n')
    found = warnings(load_mission(path).mission)
    assert [f"{dotted(key)}: {text}" for key, text in found] == [
        (
            "ground.script.0.places.1: 2,1 lies in terrain shadow: "
            "the ground cannot see the rover arrive there"
        )
    ]
