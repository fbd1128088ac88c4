"""Which format a contact plan is in, by the name of its file."""

from farside.link.profile.plans.contacts import Plan
from farside.link.profile.plans.hdtn import parse_hdtn
from farside.link.profile.plans.ion import parse_ion


def is_hdtn(name: str) -> bool:
    """Whether a contact plan of this name is one of HDTN, in JSON; else it is one of ION."""
    return name.casefold().endswith(".json")


def parse_plan(text: str, name: str) -> Plan:
    """The contact plan in a text, whose file has this name.

    Raises:
        ContactPlanError: as `parse_hdtn` and `parse_ion`.
    """
    return (parse_hdtn if is_hdtn(name) else parse_ion)(text, name)
