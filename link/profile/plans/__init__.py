"""Contact plans of ION and HDTN, and delivery traces of mahimahi, read from their text."""

from farside.link.profile.plans.contacts import (
    Contact,
    ContactPlanError,
    LinkTables,
    PairProblem,
    Plan,
    Range,
    WayTables,
    gaps,
    link_tables,
)
from farside.link.profile.plans.hdtn import parse_hdtn
from farside.link.profile.plans.ion import parse_ion
from farside.link.profile.plans.traces import TraceError, parse_trace

__all__ = [
    "Contact",
    "ContactPlanError",
    "LinkTables",
    "PairProblem",
    "Plan",
    "Range",
    "TraceError",
    "WayTables",
    "gaps",
    "link_tables",
    "parse_hdtn",
    "parse_ion",
    "parse_trace",
]
