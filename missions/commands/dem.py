"""`farside dem`: the Dynamic Expectancy Model without a mission."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

import msgspec
import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from farside.dem import DynamicExpectancyModel, Hypothesis, Parameters, PolicyValue, Sign, Values
from farside.escaping import printable
from farside.missions.commands.dem_stream import RecordedCycle, StreamError, read_stream
from farside.missions.figure1.example import GOALS, SEED, Figure1, run_figure1

_DEFAULTS, _PLAIN = Parameters(), Parameters(plain=True)
_DEFAULT_COST = 1.0
_ROWS = 30

_HELP = """The learning controller by itself.

\b
farside dem learn drive.jsonl --goal at:B
farside dem figure1 --out pictures
"""

app = typer.Typer(help=_HELP, no_args_is_help=True, rich_markup_mode=None, add_completion=False)


class GoalPolicy(msgspec.Struct, frozen=True):
    """A goal and the policy values towards it, the goal first and the farthest Sign last."""

    goal: Sign
    values: tuple[PolicyValue, ...]


class LearnedLists(msgspec.Struct, frozen=True):
    """The lists learned from a stream: the object that `farside dem learn --json` prints."""

    signs: tuple[Sign, ...]
    hypotheses: tuple[Hypothesis, ...]
    policies: tuple[GoalPolicy, ...]


class GoalOption(NamedTuple):
    """A goal, as typer reads it: a bare tuple would pass for several values."""

    sign: Sign


class ActionCost(NamedTuple):
    """The cost of an action."""

    action: str
    cost: float


def _goal(text: str) -> GoalOption:
    if not text.split():
        raise typer.BadParameter("expected Tokens separated by spaces, found none")
    return GoalOption(tuple(sorted(set(text.split()))))


def _action_cost(text: str) -> ActionCost:
    name, _, number = text.rpartition("=")
    try:
        cost = float(number)
    except ValueError:
        cost = 0.0
    if not name or not 0.0 < cost < float("inf"):
        raise typer.BadParameter(f"expected ACTION=COST, the cost above 0, found {text!r}")
    return ActionCost(name, cost)


def _by(averaging: float, constant: float) -> str:
    return f"[default: {averaging:g}, without averaging {constant:g}]"


@app.command()
def learn(
    stream: Annotated[
        str,
        typer.Argument(
            metavar="STREAM.jsonl",
            help='Recorded cycles, one {"tokens": ["at:0,0"], "action": "N"} per line: the '
            "Tokens sensed and the action then performed, null for none. '-' is standard input.",
        ),
    ],
    goals: Annotated[
        list[GoalOption] | None,
        typer.Option(
            "--goal",
            parser=_goal,
            metavar="TOKENS",
            help="Show the policy towards this Sign: its Tokens, separated by spaces. Repeatable.",
        ),
    ] = None,
    alpha: Annotated[
        float | None,
        typer.Option(
            metavar="X", help=f"α, gain of C_m on success. {_by(_DEFAULTS.alpha, _PLAIN.alpha)}"
        ),
    ] = None,
    beta: Annotated[
        float | None,
        typer.Option(
            metavar="X", help=f"β, loss of C_m on failure. {_by(_DEFAULTS.beta, _PLAIN.beta)}"
        ),
    ] = None,
    learning_probability: Annotated[
        float,
        typer.Option(metavar="X", help="λ, probability that an opportunity to learn is taken."),
    ] = _DEFAULTS.learning_probability,
    initial_cm: Annotated[
        float, typer.Option(metavar="X", help="C_m of a new hypothesis.")
    ] = _DEFAULTS.initial_cm,
    reach: Annotated[
        int, typer.Option(metavar="N", help="Longest delay of a hypothesis, in cycles.")
    ] = _DEFAULTS.reach,
    action_costs: Annotated[
        list[ActionCost] | None,
        typer.Option(
            "--action-cost",
            parser=_action_cost,
            metavar="ACTION=COST",
            help=f"Cost of an action, {_DEFAULT_COST:g} by default. Repeatable.",
        ),
    ] = None,
    plain: Annotated[
        bool,
        typer.Option("--plain", help="The seed and nothing else: all of the following at once."),
    ] = False,
    no_averaging: Annotated[
        bool,
        typer.Option("--no-averaging", help="Let C_m change at constant rates only."),
    ] = False,
    no_credit: Annotated[
        bool, typer.Option("--no-credit", help="Base cost estimates on C_m, not on credit.")
    ] = False,
    no_situations: Annotated[
        bool, typer.Option("--no-situations", help="Let every Sign before it explain a surprise.")
    ] = False,
    no_whole_implies_parts: Annotated[
        bool,
        typer.Option("--no-whole-implies-parts", help="Let no Sign stand for the parts of it."),
    ] = False,
    no_differentiation: Annotated[
        bool, typer.Option("--no-differentiation", help="Do not form conjunctions of Tokens.")
    ] = False,
    no_removal: Annotated[
        bool, typer.Option("--no-removal", help="Keep ineffective hypotheses.")
    ] = False,
    no_put_aside: Annotated[
        bool, typer.Option("--no-put-aside", help="Put no goal aside for want of a way.")
    ] = False,
    no_break_point: Annotated[
        bool, typer.Option("--no-break-point", help="Block no goal that has become too dear.")
    ] = False,
    values: Annotated[
        Values,
        typer.Option(help="What policy values tell: equation 5, or the cost by all outcomes."),
    ] = Values.BEST,
    seed: Annotated[
        int, typer.Option(min=0, metavar="N", help="Seed of the random generator.")
    ] = 0,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Feed recorded cycles to the model and print its lists.

    The goals are on the Goal List from the first cycle on, so that the model can learn about a
    goal of several Tokens.

    \b
    farside dem learn drive.jsonl --action-cost N=2.66
    farside dem learn drive.jsonl --goal at:B --goal "at:2,4 heading:N"
    tail -n 500 drive.jsonl | farside dem learn - --json
    """
    try:
        rates = Parameters(plain=plain, averaging=not no_averaging)
        parameters = Parameters(
            alpha=rates.alpha if alpha is None else alpha,
            beta=rates.beta if beta is None else beta,
            plain=plain,
            averaging=not no_averaging,
            own_credit=not no_credit,
            situations=not no_situations,
            whole_implies_parts=not no_whole_implies_parts,
            put_aside=not no_put_aside,
            break_point=not no_break_point,
            learning_probability=learning_probability,
            initial_cm=initial_cm,
            reach=reach,
            differentiation=not no_differentiation,
            removal=not no_removal,
            values=values,
        )
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    cycles = read_stream(stream)
    costs = dict.fromkeys((c.action for c in cycles if c.action is not None), _DEFAULT_COST)
    costs |= dict(action_costs or ())
    if not costs:
        raise StreamError(f"{stream}: expected an action in at least one cycle, found none")
    model = DynamicExpectancyModel(costs, parameters, rng=np.random.default_rng(seed))
    learned = _learn(model, cycles, [goal.sign for goal in goals or ()])
    if json:
        print(msgspec.json.encode(learned).decode())  # noqa: T201
    else:
        _show(learned, Console())


def _learn(
    model: DynamicExpectancyModel, cycles: Sequence[RecordedCycle], goals: Sequence[Sign]
) -> LearnedLists:
    _set(model, goals)
    for cycle in cycles:
        reached = model.sense(cycle.tokens).reached
        model.perform(cycle.action)
        _set(model, [goal.tokens for goal in reached])
    for goal in goals:
        model.withdraw_goal(goal)
    return LearnedLists(
        signs=model.signs,
        hypotheses=model.hypotheses,
        policies=tuple(_policy(model, goal) for goal in goals),
    )


def _set(model: DynamicExpectancyModel, goals: Sequence[Sign]) -> None:
    for goal in goals:
        model.set_goal(goal, priority=1.0)


def _policy(model: DynamicExpectancyModel, goal: Sign) -> GoalPolicy:
    _set(model, [goal])
    values = model.policy_map()
    model.withdraw_goal(goal)
    return GoalPolicy(goal, values)


def _show(learned: LearnedLists, console: Console) -> None:
    signs = [(str(number), _words(sign)) for number, sign in enumerate(learned.signs, start=1)]
    _show_table(console, "Signs", ("sign", "tokens"), signs)
    strongest = sorted(learned.hypotheses, key=lambda h: (-h.cm, -h.predictions))
    columns = ("context", "action", "outcome", "delay", "C_m", "predictions", "successes")
    _show_table(console, "Hypotheses", columns, [_hypothesis_row(h) for h in strongest])
    for policy in learned.policies:
        title = f"Policy towards {_words(policy.goal)}"
        rows = [_policy_row(value) for value in policy.values]
        _show_table(console, title, ("sign", "value", "action", "depth"), rows)


def _hypothesis_row(hypothesis: Hypothesis) -> tuple[str, ...]:
    return (
        _words(hypothesis.context),
        hypothesis.action,
        _words(hypothesis.outcome),
        str(hypothesis.delay),
        f"{hypothesis.cm:.3f}",
        str(hypothesis.predictions),
        str(hypothesis.successes),
    )


def _policy_row(row: PolicyValue) -> tuple[str, ...]:
    return _words(row.sign), f"{row.value:.2f}", row.action or "", str(row.depth)


def _words(sign: Sign) -> str:
    return " ".join(sign)


def _show_table(
    console: Console, title: str, columns: Sequence[str], rows: Sequence[tuple[str, ...]]
) -> None:
    """Print the first rows, and the number of further ones."""
    console.print(Text.assemble((title, "bold"), f"  {len(rows)}"))
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim")
    for column in columns:
        table.add_column(column)
    for row in rows[:_ROWS]:
        table.add_row(*(Text(printable(cell)) for cell in row))
    if rows:
        console.print(table)
    if len(rows) > _ROWS:
        console.print(f"and {len(rows) - _ROWS} more; --json prints all", style="dim")
    console.print()


@app.command()
def figure1(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the pictures.")] = Path(
        "figures"
    ),
    seed: Annotated[
        int, typer.Option(min=0, metavar="N", help="Seed of the random actions.")
    ] = SEED,
) -> None:
    """Draw the worked example of the model.

    A yard of 52 places is learned by 2000 random actions. With 96% of seeds they sense every place
    at least twice.
    Three goals are set one after another. For each, the height of a column is the policy value of
    its place: the expected cost to reach the goal. Requires Farside's extra `figures`.

    \b
    farside dem figure1
    farside dem figure1 --out pictures --seed 7
    """
    try:
        from farside.missions.figure1.page import write_page  # an extra
        from farside.missions.figure1.png import write_png
    except ModuleNotFoundError as error:
        raise typer.BadParameter(
            f"expected plotly and Pillow to draw the pictures, found no {error.name}: "
            "pip install 'farside[figures]'"
        ) from error
    figure = run_figure1(seed)
    out.mkdir(parents=True, exist_ok=True)
    write_page(figure, out / "figure1.html")
    write_png(figure, out / "figure1.png")
    _show_figure1(figure, Console())
    for name in ("figure1.html", "figure1.png"):
        print(out / name)  # noqa: T201


def _show_figure1(figure: Figure1, console: Console) -> None:
    console.print(
        f"{figure.model.sign_count} of {len(figure.chart.tokens)} places seen, "
        f"{figure.twice} at least twice, "
        f"{figure.model.hypothesis_count} hypotheses\n"
    )
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim")
    table.add_column("goal")
    table.add_column("map built in")
    named = [name for name in (*GOALS, "D", "9,1") if f"at:{name}" in figure.chart.cells]
    for name in named:
        table.add_column(f"P_v at {name}")
    for panel in figure.panels:
        values = [panel.values.get(figure.chart.cells[f"at:{name}"]) for name in named]
        cells = ("none" if value is None else f"{value.value:.2f}" for value in values)
        table.add_row(panel.goal, f"{panel.build_s * 1e3:.3f} ms", *cells)
    console.print(table)
    console.print()
