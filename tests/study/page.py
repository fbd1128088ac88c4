"""Writes docs/study.md and its pictures from the results of the studies, and from nothing else."""

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

from drawing import COLOURS, Axis, Estimate, Picture, apart
from ground_page import ground_pictures, ground_words
from numbers_told import estimate, table, told

Result = dict[str, Any]
Rows = list[dict[str, Any]]

SECTION = Path(__file__).with_name("page.md")
WAY_COLOURS = {"guided": "blue", "curious": "green", "random": "orange"}
POLICIES = {
    "signal": "by learned ways",
    "track": "by its track",
    "none": "does not return",
    "hold": "no autonomy at all",
}
WORK = {
    ("autonomy", "long"): ("autonomy, long outages", "blue", False),
    ("autonomy", "short"): ("autonomy, short outages", "blue", True),
    ("hold", "long"): ("hold, long outages", "orange", False),
    ("hold", "short"): ("hold, short outages", "orange", True),
}


# --- exploring ------------------------------------------------------------------------------------


class Exploring:
    """What came of the first study."""

    def __init__(self, results: Result) -> None:
        self._yard = results["yard"]
        self._runs = {
            way: [run for run in results["exploring"] if run["way"] == way] for way in WAY_COLOURS
        }
        self.arcs = {way: self._of(way, "all_arcs") for way in WAY_COLOURS}

    def _of(self, way: str, key: str) -> Estimate:
        return estimate([run[key] for run in self._runs[way]])

    def table(self) -> str:
        """Actions until all places and all arcs are known."""
        rows = []
        for way, runs in self._runs.items():
            most = max(run["all_arcs"] for run in runs)
            rows.append(
                [
                    way,
                    told(self._of(way, "all_places")),
                    told(self.arcs[way]),
                    f"{most:,}",
                    f"{sum(run['complete'] for run in runs)} of {len(runs)}",
                ]
            )
        head = ["", "all places", "all arcs", "most", "complete"]
        return table(head, rows)

    def words(self) -> dict[str, str]:
        """What the page says of it."""
        guided, curious, random = (self.arcs[way].mean for way in WAY_COLOURS)
        half = max(n for n, count in enumerate(self._yard["grid"]) if count <= random / 2)
        known = estimate([run["arcs_at"][half] for run in self._runs["random"]])
        return {
            "places": str(self._yard["places"]),
            "arcs": str(self._yard["arcs"]),
            "shadow": str(self._yard["shadow"]),
            "random_times": f"{random / guided:.0f}",
            "curious_times": f"{curious / guided:.1f}",
            "random_curious_times": f"{random / curious:.0f}",
            "random_arcs": told(self.arcs["random"]),
            "half_actions": f"{self._yard['grid'][half]:,}",
            "half_arcs": told(known),
        }

    def picture(self) -> str:
        """Growth of the model."""
        arcs, grid = self._yard["arcs"], self._yard["grid"]
        picture = Picture(
            "Arcs known against actions performed, for guided, curious and random exploration",
            Axis(10, 10_000, (10, 30, 100, 300, 1000, 3000, 10_000), "actions performed", log=True),
            Axis(0, arcs, (0, 50, 100, 150, arcs), f"arcs known, of {arcs}"),
            right=40,
        )
        for way, colour in WAY_COLOURS.items():
            curve = [
                (count, estimate([run["arcs_at"][n] for run in self._runs[way]]))
                for n, count in enumerate(grid)
            ]
            # An arc is an action at least, and beyond the last arc there is nothing to see.
            full = next((n for n, (_, value) in enumerate(curve) if value.low >= arcs), len(curve))
            picture.curve(curve[: full + 1], COLOURS[colour])
            half = next(n for n, (_, value) in enumerate(curve) if value.mean > 0.55 * arcs)
            x, y = picture.x(curve[half][0]), picture.y(curve[half][1].mean)
            # The first is at the left: between the others and it there is no room.
            at, anchor = ((x - 12, y), "end") if way == "guided" else ((x + 14, y + 14), "start")
            picture.text(at, way, colour=COLOURS[colour], weight="bold", anchor=anchor)
        return picture.svg()


# --- working --------------------------------------------------------------------------------------


class Working:
    """What came of the second study."""

    def __init__(self, results: Result) -> None:
        self._runs: Rows = results["working"]
        self.shares = sorted({run["share"] for run in self._runs})

    def _goals(self, on_loss: str, length: str, share: int) -> list[int]:
        kind = "long" if share == 0 else length  # without outages their length is nothing
        return [
            run["goals"]
            for run in sorted(self._runs, key=lambda run: run["seed"])
            if (run["on_loss"], run["length"], run["share"]) == (on_loss, kind, share)
        ]

    def estimate(self, on_loss: str, length: str, share: int) -> Estimate:
        """Goals reached."""
        return estimate(self._goals(on_loss, length, share))

    def gain(self, length: str, share: int) -> Estimate:
        """Goals gained by autonomy, run by run on the same outages."""
        pairs = zip(
            self._goals("autonomy", length, share), self._goals("hold", length, share), strict=True
        )
        return estimate([alone - held for alone, held in pairs])

    def table(self) -> str:
        """Goals reached by share of outages."""
        head = ["outages", "autonomy, long", "hold, long", "gain, long"]
        head += ["autonomy, short", "hold, short", "gain, short"]
        rows = []
        for share in self.shares:
            row = [f"{share} %"]
            for length in ("long", "short"):
                row += [
                    told(self.estimate(kind, length, share), 1) for kind in ("autonomy", "hold")
                ]
                row.append(told(self.gain(length, share), 1))
            rows.append(row)
        return table(head, rows)

    def _verdict(self, length: str) -> str:
        pays: list[str] = []
        costs: list[str] = []
        neither: list[str] = []
        for share in self.shares[1:]:
            gain = self.gain(length, share)
            kind = pays if gain.low > 0 else costs if gain.high < 0 else neither
            kind.append(f"{share} %")
        if len(pays) == len(self.shares) - 1:
            return f"pays at every share from {pays[0]} on"
        said = []
        if pays:
            said.append(f"pays at {_listed(pays)}")
        if neither:
            said.append(
                f"makes no difference that {_runs(self._runs)} runs could show at "
                f"{_listed(neither)}"
            )
        if costs:
            said.append(f"costs goals at {_listed(costs)}")
        return "; it ".join(said)

    def words(self) -> dict[str, str]:
        """What the page says of it."""
        first, last = self.shares[1], self.shares[-1]
        found = {
            f"{on_loss}_{length}_{name}": told(self.estimate(on_loss, length, share), 1)
            for on_loss, length in WORK
            for name, share in (("none", 0), ("most", last))
        }
        trend = self.estimate("autonomy", "long", last), self.estimate("autonomy", "long", 0)
        more = "more" if trend[0].low > trend[1].high else "fewer"
        if more == "fewer" and trend[0].high >= trend[1].low:
            more = "as many"
        return {
            **found,
            "most_share": f"{last} %",
            "least_share": f"{first} %",
            "gain_long_least": told(self.gain("long", first), 1),
            "gain_short_least": told(self.gain("short", first), 1),
            "verdict_long": self._verdict("long"),
            "verdict_short": self._verdict("short"),
            "trend": more,
        }

    def picture(self) -> str:
        """Goals reached against the share of outages."""
        top = 40
        picture = Picture(
            "Goals reached against the share of time without link, with autonomy and without",
            Axis(0, 90, self.shares, "share of the time without link, %"),
            Axis(0, top, range(0, top + 1, 10), f"goals reached, of {top}, in 15 min"),
            right=190,
        )
        labels = []
        for number, ((on_loss, length), (words, colour, dashed)) in enumerate(WORK.items()):
            points: list[tuple[float, Estimate]] = [
                (share, self.estimate(on_loss, length, share)) for share in self.shares
            ]
            picture.curve(points, COLOURS[colour], dashed=dashed)
            picture.bars(points, COLOURS[colour], aside=1.5 * (number % 2))
            labels.append((picture.y(points[-1][1].mean) + 4, words, COLOURS[colour]))
        for height, (_, words, colour) in zip(apart(labels), labels, strict=True):
            picture.text((picture.x(90) + 10, height), words, colour=colour)
        return picture.svg()


# --- shadow ---------------------------------------------------------------------------------------


class Shadowed:
    """What came of the second study, in the yard with terrain shadow."""

    def __init__(self, results: Result) -> None:
        runs: Rows = sorted(results["shadowed"], key=lambda run: run["seed"])
        self._goals = {
            policy: [2.0 * run["goals"] for run in runs if run["policy"] == policy]
            for policy in POLICIES
        }
        self._actions = {
            policy: [run["actions"] for run in runs if run["policy"] == policy]
            for policy in POLICIES
        }

    def table(self) -> str:
        """Goals an hour by what brings the rover out of the shadow."""
        rows = [
            [
                f"`{policy}`" if policy != "hold" else '`on_loss = "hold"`',
                told(estimate(goals), 1),
                f"{min(goals):.0f} to {max(goals):.0f}",
                told(estimate(self._actions[policy])),
            ]
            for policy, goals in self._goals.items()
        ]
        return table(
            ["return to", "goals an hour", "least and most", "moves in half an hour"], rows
        )

    def words(self) -> dict[str, str]:
        """What the page says of it."""
        pairs = zip(self._goals["signal"], self._goals["track"], strict=True)
        gain = estimate([signal - track for signal, track in pairs])
        differs = gain.low > 0 or gain.high < 0
        none, signal = (estimate(self._goals[policy]) for policy in ("none", "signal"))
        return {
            "signal_gain": told(gain, 1),
            "signal_verdict": "more than chance" if differs else "no more than chance",
            "return_times": f"{signal.mean / none.mean:.0f}",
        }

    def picture(self) -> str:
        """Goals an hour, a row for each way out."""
        most = max(max(goals) for goals in self._goals.values())
        top = 10 * (int(most) // 10 + 1)
        picture = Picture(
            "Goals an hour in the yard with terrain shadow, by what brings the rover out of it",
            Axis(0, top, range(0, top + 1, 10), "goals reached an hour"),
            None,
            height=250,
            left=160,
            right=150,
        )
        for number, (policy, words) in enumerate(POLICIES.items()):
            y = 50 + 38 * number
            value = estimate(self._goals[policy])
            colour = COLOURS["blue" if policy in {"signal", "track"} else "orange"]
            picture.row(y, value, colour, words)
            picture.text((580, y + 4), told(value, 1), colour=colour)
        return picture.svg()


# --- the page -------------------------------------------------------------------------------------


def _runs(runs: Rows) -> int:
    return len({run["seed"] for run in runs})


def _listed(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _wrapped(page: str) -> str:
    """The page with its paragraphs in lines of a hundred characters, now that numbers are in."""
    kept = ("|", "#", "!", "`" * 3, "- ", "<")
    blocks = [
        block if block.startswith(kept) else fill(block, 100, break_on_hyphens=False)
        for block in page.rstrip("\n").split("\n\n")
    ]
    return "\n\n".join(blocks) + "\n"


# --- surprises ------------------------------------------------------------------------------------


class Surprises:
    """What came of the random runs."""

    def __init__(self, results: Result) -> None:
        self.counts: Counter[str] = Counter()
        for part in results["surprises"]:
            self.counts.update(part["counts"])
        self.found = [found for part in results["surprises"] for found in part["found"]]

    def table(self) -> str:
        """What happened in them, in numbers."""
        kinds = {"action": "actions begun, by who chose", "command": "commands, by stage"}
        kinds |= {"failsafe": "changes of the failsafe, by state", "mode": "modes, by cause"}
        rows = []
        for kind, words in kinds.items():
            of_kind = {k: n for k, n in self.counts.items() if k.split()[0] == kind}
            told = ", ".join(f"{k.removeprefix(kind + ' ')} {n:,}" for k, n in of_kind.items())
            rows.append([words, told])
        rows += [[name, f"{self.counts[name]:,}"] for name in ("proposals", "outages")]
        lines = ["| what | how many |", "|---|---|", *(f"| {a} | {b} |" for a, b in rows)]
        return "\n".join(lines)

    def words(self) -> dict[str, str]:
        """The numbers in the text."""
        found = "no surprise" if not self.found else f"{len(self.found)} surprises"
        days = self.counts["simulated_s"] / 86_400
        return {
            "surprise_runs": f"{self.counts['runs']:,}",
            "surprise_days": f"{days:.0f}",
            "surprises_found": found,
            "surprises_table": self.table(),
        }


def written(results: Result, folder: Path) -> None:
    """Write the page and its pictures into a folder."""
    exploring, working, shadow = Exploring(results), Working(results), Shadowed(results)
    words = {
        "seeds": str(results["seeds"]),
        "exploring_table": exploring.table(),
        "working_table": working.table(),
        "shadow_table": shadow.table(),
        **exploring.words(),
        **working.words(),
        **shadow.words(),
        **Surprises(results).words(),
        **ground_words(results),
    }
    page = SECTION.read_text(encoding="utf-8")
    for name, value in words.items():
        page = page.replace(f"{{{name}}}", value)
    pictures: dict[str, Callable[[], str]] = {
        "exploring": exploring.picture,
        "working": working.picture,
        "shadow": shadow.picture,
        **ground_pictures(results),
    }
    (folder / "study").mkdir(parents=True, exist_ok=True)
    (folder / "study.md").write_text(_wrapped(page), encoding="utf-8")
    for name, picture in pictures.items():
        (folder / f"study/{name}.svg").write_text(picture(), encoding="utf-8")
