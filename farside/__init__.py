"""Farside simulates rover missions over delayed, lossy links.

The packages, from the bottom up: `dem` (the learning controller, on its own), `link` (what
crosses, and what carries it), `rover`, `ground` and `logs` (which do not know each other),
`console` (a person's place at the ground), and `missions` (which brings them together).

Raises:
    ImportError: in a checkout whose symbolic links, such as `farside/dem`, became text files.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from farside.lazily import lazily

if TYPE_CHECKING:
    from farside.missions.reliving.moment import Relived, relive

__all__ = ["Relived", "relive"]

if not (Path(__file__).parent / "dem").is_dir():
    raise ImportError(
        "Expected the symbolic link farside/dem -> ../dem, found none: this checkout was made "
        "without symbolic links. Clone again with `git clone -c core.symlinks=true`."
    )

__getattr__ = lazily(
    __name__, {"Relived": "missions.reliving.moment", "relive": "missions.reliving.moment"}
)
