"""Contact plans as files: which format, encoding and length."""

from pathlib import Path

from farside.files import read_text
from farside.link.profile.plans.contacts import Plan
from farside.link.profile.plans.hdtn import parse_hdtn
from farside.link.profile.plans.ion import parse_ion

MAX_PLAN_BYTE = 32 * 1024 * 1024
"""The longest contact plan that is read (project default): 100,000 contacts of HDTN, spaced out."""


def read_plan(path: Path) -> str:
    """The text of a contact plan.

    One of ION may be in Latin-1: its commands are ASCII, and the encoding of its comments is
    nobody's business. One of HDTN is JSON, which is in UTF-8.

    Raises:
        OSError, ValueError: as `farside.files.read_text`.
    """
    return read_text(path, most_byte=MAX_PLAN_BYTE, is_old=not _is_hdtn(path))


def parse_plan(text: str, path: Path) -> Plan:
    """The contact plan in the text of a file: one of HDTN if its name ends in .json, else of ION.

    Raises:
        ContactPlanError: as `parse_hdtn` and `parse_ion`.
    """
    return (parse_hdtn if _is_hdtn(path) else parse_ion)(text, str(path))


def _is_hdtn(path: Path) -> bool:
    return path.suffix.lower() == ".json"
