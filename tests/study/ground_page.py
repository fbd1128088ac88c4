"""What the page says of the ground's studies: delay, prediction, the shadow, supervision."""

from collections.abc import Callable
from typing import Any

from drawing import COLOURS, Axis, Estimate, Picture, apart
from numbers_told import estimate, ratio, table, told

Result = dict[str, Any]
Rows = list[dict[str, Any]]

WAYS = {
    "wait": ("moves and waits", "grey"),
    "consent": ("shared, with consent", "orange"),
    "trust": ("trusts the prediction", "green"),
    "goals": ("goals only", "blue"),
}
Bins = list[tuple[float, Estimate, int]]
"""What was stated on average, the share that was right, and of how many predictions."""

HALF = 0.5
FEW = 30
"""Of fewer predictions than this no share is drawn."""


class Delays:
    """What came of the study of delay."""

    def __init__(self, results: Result) -> None:
        self._runs: Rows = results["delays"]
        self.round_trips = sorted({run["round_trip_s"] for run in self._runs})

    def _of(self, way: str, round_trip_s: float) -> Rows:
        return [
            run for run in self._runs if (run["way"], run["round_trip_s"]) == (way, round_trip_s)
        ]

    def rate(self, way: str, round_trip_s: float) -> Estimate:
        """Goals an hour."""
        return estimate([run["goals"] / run["hours"] for run in self._of(way, round_trip_s)])

    def pace(self, way: str, round_trip_s: float) -> Estimate:
        """Metres a minute: every move is one metre."""
        return estimate([run["moves"] / run["hours"] / 60 for run in self._of(way, round_trip_s)])

    def table(self) -> str:
        """Goals an hour by round trip and way to work."""
        rows = [
            [f"{trip:g} s", *(told(self.rate(way, trip), 1) for way in WAYS)]
            for trip in self.round_trips
        ]
        return table(["round trip", *(words for words, _ in WAYS.values())], rows)

    def words(self) -> dict[str, str]:
        """What the page says of it."""
        first, last = self.round_trips[0], self.round_trips[-1]
        pays = [
            trip
            for trip in self.round_trips
            if self.rate("goals", trip).low > self.rate("wait", trip).high
        ]
        as_good = [
            trip
            for trip in self.round_trips
            if self.rate("trust", trip).high >= self.rate("goals", trip).low
        ]
        return {
            "as_good_to": f"{as_good[-1]:g} s" if as_good else "no round trip of these",
            "pace_10": told(self.pace("wait", 10.0), 1),
            "pace_10_goals": told(self.pace("goals", 10.0), 1),
            "pays_from": f"{pays[0]:g} s" if pays else "no round trip of these",
            "wait_first": told(self.rate("wait", first), 1),
            "wait_last": told(self.rate("wait", last), 2),
            "goals_last": told(self.rate("goals", last), 1),
            "trust_last": told(self.rate("trust", last), 1),
            "first_trip": f"{first:g} s",
            "last_trip": f"{last / 60:g} min",
        }

    def picture(self) -> str:
        """Goals an hour against the round trip."""
        picture = Picture(
            "Goals an hour against the round trip of light, for four ways to work",
            Axis(0.2, 2400, (0.2, 2.56, 10, 60, 480, 2400), "round trip of light, s", log=True),
            Axis(0.3, 300, (0.3, 1, 3, 10, 30, 100, 300), "goals an hour", log=True),
            right=190,
        )
        labels = []
        for way, (words, colour) in WAYS.items():
            points = [(trip, self.rate(way, trip)) for trip in self.round_trips]
            picture.curve(points, COLOURS[colour])
            picture.bars(points, COLOURS[colour])
            labels.append((picture.y(points[-1][1].mean) + 4, words, COLOURS[colour]))
        for height, (_, words, colour) in zip(apart(labels), labels, strict=True):
            picture.text((picture.x(2400) + 10, height), words, colour=colour)
        return picture.svg()


class Predicting:
    """What came of the study of prediction."""

    def __init__(self, results: Result) -> None:
        self._delays: Rows = results["delays"]
        self._lessons: Rows = results["lessons"]

    def table(self) -> str:
        """How often the predicted rover was right, by delay."""
        trips = sorted({run["round_trip_s"] for run in self._delays})
        rows = []
        for trip in trips:
            runs = [run for run in self._delays if run["round_trip_s"] == trip]
            rows.append([f"{trip:g} s", *_shares(runs)])
        return table(["round trip", *_SHARES], rows)

    def lessons_table(self) -> str:
        """The same by how well the model was taught, for who moves and waits."""
        rows = []
        for trip in sorted({run["round_trip_s"] for run in self._lessons}):
            for rounds in sorted({run["lessons"] for run in self._lessons}):
                runs = [
                    run
                    for run in self._lessons
                    if (run["round_trip_s"], run["lessons"]) == (trip, rounds)
                ]
                rows.append([f"{rounds:.0%} of all moves, {trip:g} s", *_shares(runs)])
            runs = [
                run for run in self._delays if (run["round_trip_s"], run["way"]) == (trip, "wait")
            ]
            rows.append([f"three times all moves, {trip:g} s", *_shares(runs)])
        return table(["taught, round trip", *_SHARES], rows)

    def words(self) -> dict[str, str]:
        """What the page says of it."""
        cases = sum(sum(run["cases"]) for run in self._delays)
        right = sum(sum(run["right"]) for run in self._delays)
        stated = sum(sum(run["stated"]) for run in self._delays)
        bins = [one for one in self._bins() if one[2] >= FEW]
        upper = [one for one in bins if one[0] >= HALF]
        lower = [one for one in bins if one[0] < HALF]
        longest = max(run["round_trip_s"] for run in self._delays)
        far = [run for run in self._delays if run["round_trip_s"] == longest]
        return {
            "predictions": f"{cases:,}",
            "right_share": f"{100 * right / cases:.1f} %",
            "stated_share": f"{100 * stated / cases:.1f} %",
            "upper_share": f"{100 * sum(one[2] for one in upper) / cases:.1f} %",
            "worst_upper": f"{_worst(upper):.0f}",
            "worst_lower": f"{_worst(lower):.0f}",
            "far_stated": _shares(far)[2],
            "far_right": _shares(far)[3],
        }

    def _bins(self) -> Bins:
        """Per bin: what was stated on average, the share that was right, and how many there are."""
        found = []
        for index in range(len(self._delays[0]["cases"])):
            runs = [run for run in self._delays if run["cases"][index]]
            count = sum(run["cases"][index] for run in runs)
            if not count:
                continue
            stated = sum(run["stated"][index] for run in runs) / count
            found.append((stated, _pooled(runs, index), count))
        return found

    def picture(self) -> str:
        """The reliability diagram."""
        ticks = (0, 20, 40, 60, 80, 100)
        picture = Picture(
            "How often the predicted place was right, against the probability stated for it",
            Axis(0, 100, ticks, "probability stated for the most probable place, %"),
            Axis(0, 100, ticks, "share of predictions that were right, %"),
            right=90,
        )
        picture.curve([(0, Estimate(0, 0, 0)), (100, Estimate(100, 100, 100))], COLOURS["grey"])
        for stated, share, count in self._bins():
            if count < FEW:
                continue
            value = Estimate(*(100 * number for number in share))
            picture.bars([(100 * stated, value)], COLOURS["blue"])
            at = picture.x(100 * stated) + 8, picture.y(value.mean) + 16
            picture.text(at, f"{count:,}", colour=COLOURS["blue"])
        return picture.svg()


def _worst(bins: Bins) -> float:
    """By how many percentage points what was stated is off at most."""
    return max((100 * abs(stated - share.mean) for stated, share, _ in bins), default=0.0)


_SHARES = ("predictions", "nothing said", "stated", "right", "where last heard")


def _shares(runs: Rows) -> list[str]:
    """How many predictions, what they stated, how many were right, and what no prediction gives."""
    cases = sum(sum(run["cases"]) for run in runs)
    silent = sum(run["silent"] for run in runs)
    if not cases:
        return ["0", f"{silent:,}", "", "", ""]
    stated = sum(sum(run["stated"]) for run in runs) / cases
    naive = sum(run["naive"] for run in runs) / (cases + silent)
    share = _pooled(runs)
    value = Estimate(*(100 * number for number in share))
    return [
        f"{cases:,}",
        f"{silent:,}",
        f"{100 * stated:.0f} %",
        f"{told(value)} %",
        f"{100 * naive:.0f} %",
    ]


def _pooled(runs: Rows, index: int | None = None) -> Estimate:
    """The share that was right of all, with the interval over the runs."""
    pairs = [
        (sum(run["right"]), sum(run["cases"]))
        if index is None
        else (run["right"][index], run["cases"][index])
        for run in runs
    ]
    return ratio([right for right, _ in pairs], [cases for _, cases in pairs])


class Price:
    """What came of the study of the shadow's price."""

    def __init__(self, results: Result) -> None:
        self._runs: Rows = results["price"]
        self.missions = list(dict.fromkeys(run["mission"] for run in self._runs))

    def _of(self, mission: str, key: str) -> list[float]:
        return [run[key] for run in self._runs if run["mission"] == mission]

    def table(self) -> str:
        """Bits a cycle, share of the downlink, time to catch up, and the map instead."""
        rows = []
        for mission in self.missions:
            late = [t for run in self._runs if run["mission"] == mission for t in run["catch_up_s"]]
            shares = [100 * share for share in self._of(mission, "downlink_share")]
            rows.append(
                [
                    f"`{mission}`",
                    told(estimate(self._of(mission, "bits_per_cycle"))),
                    f"{told(estimate(shares), 1)} %",
                    told(estimate(late), 1) if late else "no long outage",
                    told(estimate(self._of(mission, "map_bits_per_cycle"))),
                ]
            )
        head = ["", "bits a cycle", "of the downlink", "caught up after, s", "map instead, bits"]
        return table(head, rows)

    def words(self) -> dict[str, str]:
        """What the page says of it."""
        equal = sum(run["equal"] for run in self._runs)
        return {"equal_runs": f"{equal} of {len(self._runs)}"}

    def picture(self) -> str:
        """Bits a cycle on each mission: the shadow, and the map instead."""
        ticks = range(0, 3001, 500)
        picture = Picture(
            "Bits a cycle on the downlink, for the shadow of the model and for maps instead",
            Axis(0, 3000, ticks, "bits a cycle on the downlink"),
            None,
            height=110 + 56 * len(self.missions),
            left=130,
            right=70,
        )
        for number, mission in enumerate(self.missions):
            y = 48 + 56 * number
            picture.row(y, estimate(self._of(mission, "bits_per_cycle")), COLOURS["blue"], mission)
            maps = estimate(self._of(mission, "map_bits_per_cycle"))
            picture.row(y + 22, maps, COLOURS["orange"], "maps instead")
        return picture.svg()


class Supervising:
    """What came of the supervisor."""

    def __init__(self, results: Result) -> None:
        self._runs: Rows = results["supervised"]

    def table(self) -> str:
        """Goals reached on each mission, after the guide and without."""
        rows = []
        for mission in dict.fromkeys(run["mission"] for run in self._runs):
            row = [f"`{mission}`"]
            for taught in (True, False):
                runs = [
                    run
                    for run in self._runs
                    if (run["mission"], run["taught"]) == (mission, taught)
                ]
                goals = sum(run["goals"] for run in runs)
                row.append(f"{sum(run['reached'] for run in runs)} of {goals}")
                row.append(str(sum(run["approved"] for run in runs)))
                row.append(str(sum(run["vetoed"] for run in runs)))
            rows.append(row)
        head = ["", "taught: reached", "approved", "vetoed", "untaught: reached"]
        return table([*head, "approved", "vetoed"], rows)

    def words(self) -> dict[str, str]:
        """What the page says of it."""
        return {"supervised_seeds": str(len({run["seed"] for run in self._runs}))}


def ground_words(results: Result) -> dict[str, str]:
    """All that the page says of the ground."""
    delays, predicting = Delays(results), Predicting(results)
    price, supervising = Price(results), Supervising(results)
    return {
        "delays_table": delays.table(),
        "predicting_table": predicting.table(),
        "lessons_table": predicting.lessons_table(),
        "price_table": price.table(),
        "supervised_table": supervising.table(),
        **delays.words(),
        **predicting.words(),
        **price.words(),
        **supervising.words(),
    }


def ground_pictures(results: Result) -> dict[str, Callable[[], str]]:
    """The pictures of the ground's studies, by name."""
    return {
        "delays": Delays(results).picture,
        "predicting": Predicting(results).picture,
        "price": Price(results).picture,
    }
