"""Makes docs/blackout.svg, the picture in the README: `farside replay` in the middle of the run."""

import sys
import tempfile
from io import StringIO
from pathlib import Path

from rich.console import Console

from farside.logs import LogFile, picture_at, screen
from farside.logs.playing import Player
from farside.logs.terminal.transport import keys_of, keys_text, transport
from farside.missions import load_mission, run_mission
from farside.node import to_ns

WIDTH, HEIGHT = 100, 30
AT_S = 690.0


def main(target: Path) -> None:
    """Run the mission, and draw the screen at `AT_S`."""
    with tempfile.TemporaryDirectory() as out:
        run = run_mission(load_mission("blackout"), in_process=True, out=Path(out))
        log = LogFile(run.log)
        player = Player(log, speed=20, start_ns=to_ns(AT_S))
        keys = keys_text(keys_of(player), WIDTH)
        console = Console(record=True, width=WIDTH, height=HEIGHT, file=StringIO())
        console.print(
            screen(
                picture_at(log, to_ns(AT_S)),
                to_ns(AT_S),
                width=WIDTH,
                height=HEIGHT - 1 - len(keys),
                title=log.path.name,
                end_ns=log.end_ns,
            ),
            transport(player, WIDTH),
            *keys,
        )
    console.save_svg(str(target), title="farside replay")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).with_name("blackout.svg"))
