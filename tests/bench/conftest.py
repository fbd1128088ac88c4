"""Puts `peers` on the path: its modules import each other by bare name, as scripts do."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "peers"))
