"""`farside link light-time`, as a person at a terminal meets it."""

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from kernels import chebyshev, write_kernel

from farside.missions.commands import main as cli


@pytest.fixture
def farside(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    """Runs `farside link light-time ...`: exit status, standard output, standard error."""

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["farside", "link", "light-time", *arguments])
        with pytest.raises(SystemExit) as end:
            cli.main()
        return end.value.code, *capsys.readouterr()

    return run


def test_json_is_one_object_of_three_numbers(farside: Callable[..., tuple[int, str, str]]) -> None:
    status, out, err = farside("mars", "2021-02-18T00:00:00Z", "--json")

    assert (status, err) == (0, "")
    assert json.loads(out) == {
        "uplink_s": pytest.approx(677.99, abs=0.05),
        "downlink_s": pytest.approx(678.047, abs=0.05),
        "sun_earth_target_deg": pytest.approx(82.36, abs=0.05),
    }


def test_people_read_seconds_and_the_angle(
    farside: Callable[..., tuple[int, str, str]],
) -> None:
    status, out, err = farside("mars", "2021-02-18")
    lines = [line.split() for line in out.splitlines()]

    assert (status, err) == (0, "")
    assert [line[:1] for line in lines] == [["uplink"], ["downlink"], ["from"]]
    assert lines[1] == ["downlink", "678.047", "s"]
    assert lines[2] == ["from", "the", "Sun", "82.356°"]


def test_people_are_told_of_a_conjunction(farside: Callable[..., tuple[int, str, str]]) -> None:
    _, within, _ = farside("mars", "2021-10-08")
    _, before, _ = farside("mars", "2021-09-08")

    assert "in conjunction: below 2.2°, missions to Mars are sent no commands" in within
    assert "conjunction" not in before


def test_a_spacecraft_is_seen_in_a_kernel(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    pytest.importorskip("jplephem")
    first_s, last_s = 8.4e8, 8.6e8
    away = ([299_792.458 * 60, 0], [0, 0], [0, 0])
    kernel = write_kernel(
        tmp_path / "probe.bsp",
        [
            chebyshev(399, 0, first_s, last_s, ([0, 0], [0, 0], [0, 0])),
            chebyshev(-74, 399, first_s, last_s, away),
        ],
    )
    status, out, err = farside("--kernel", str(kernel), "--json", "--", "-74", "2026-11-28")

    assert (status, err) == (0, "")
    assert json.loads(out)["uplink_s"] == pytest.approx(60, abs=1e-9)
    assert farside("mro", "2026-11-28", "--kernel", str(kernel))[1].startswith("uplink")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["mras", "2021-02-18"], ["expected one of", '"mras"', "did you mean mars?"]),
        (["mars"], ["expected a date after the body, found none"]),
        (
            ["mars", "2026-11-28", "--kernel", "a", "--horizons", "b"],
            ["expected kernel or horizons"],
        ),
        (["2026-11-28", "--horizons", "no"], ["expected a file, found", "no"]),
        (["mars", "2026-11-28", "--kernel", "no"], ['expected a kernel, found: "no"']),
        (["mars", "soon"], ["expected a date", "such as 2021-02-18T00:00:00Z", '"soon"']),
        (["mars", "2021-02-18T00:00:00"], ["did you mean 2021-02-18T00:00:00Z?"]),
        (["mars", "1900-01-01", "--json"], ["expected a date from 1960", "1900-01-01"]),
    ],
)
def test_bad_input_is_status_2_and_one_line(
    farside: Callable[..., tuple[int, str, str]], arguments: Sequence[str], named: Sequence[str]
) -> None:
    status, out, err = farside(*arguments)

    assert (status, out) == (2, "")
    assert err.startswith("farside: ")
    assert err.count("\n") == 1
    for words in named:
        assert words in err


def test_without_astropy_it_is_status_2_and_says_what_to_install(
    farside: Callable[..., tuple[int, str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("astropy", "astropy.utils"):
        monkeypatch.setitem(sys.modules, module, None)
    status, _, err = farside("mars", "2021-02-18")

    assert status == 2
    assert "pip install 'farside[astropy]'" in err


def test_help_shows_what_to_type(farside: Callable[..., tuple[int, str, str]]) -> None:
    status, out, _ = farside("--help")

    assert status == 0
    assert "farside link light-time mars 2021-02-18T00:00:00Z" in out
    assert "farside link light-time mars 2021-10-08 --json" in out
