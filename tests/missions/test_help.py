"""What `--help` says, and what is answered to a slip of the fingers."""

import re
from collections.abc import Callable

import pytest

COMMANDS = [
    (),
    ("run",),
    ("check",),
    ("replay",),
    ("export",),
    ("recover",),
    ("verify",),
    ("rerun",),
    ("diff",),
