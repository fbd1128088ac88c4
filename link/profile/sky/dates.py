"""Dates as people write them."""

from datetime import UTC, date, datetime

from farside.validation import shown


def parsed_date(text: str) -> datetime:
    """A date and time in ISO 8601 with `Z` or an offset, or a date alone for 00:00 UTC.

    Raises:
        ValueError: if it is none.
    """
    expected = (
        "expected a date and time in ISO 8601 with Z or an offset, "
        f"such as 2021-02-18T00:00:00Z, found {shown(text)}"
    )
    try:
        moment = datetime.fromisoformat(text)
    except ValueError as error:
        raise ValueError(expected) from error
    if moment.tzinfo is not None:
        return moment
    try:
        date.fromisoformat(text)
    except ValueError:
        raise ValueError(f"{expected}; did you mean {text}Z?") from None
    return moment.replace(tzinfo=UTC)
