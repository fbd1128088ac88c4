"""NAIF's numbers of bodies by their names."""

from farside.link.profile.sky.positions import BUILT_IN, EphemerisError
from farside.validation import did_you_mean, shown


def number_of(body: int | str) -> int:
    """The number of a body given by that or by its name, in any case.

    The names of astropy's ephemeris are known, and with jplephem those of NAIF too.

    Raises:
        EphemerisError: if nothing is known by this name.
    """
    if isinstance(body, int):
        return body
    text = " ".join(body.replace("_", " ").casefold().split())
    if text.removeprefix("-").isascii() and text.removeprefix("-").isdigit() and len(text) <= 10:
        return int(text)
    names = _names()
    if text in names:
        return names[text]
    raise EphemerisError(
        f"expected a body by name or NAIF number, found {shown(body)}{did_you_mean(text, names)}"
    )


def name_of(number: int) -> str:
    """A body's number, with its name where it has one: `499 (mars)`."""
    names = [name for name, each in _names().items() if each == number]
    return f"{number} ({names[0]})" if names else f"{number}"


def _names() -> dict[str, int]:
    names = {name: numbers[0] for name, numbers in BUILT_IN.items()}
    try:
        from jplephem.names import target_name_pairs  # type: ignore[import-untyped]  # noqa: PLC0415
    except ModuleNotFoundError:
        return names
    for number, name in target_name_pairs:
        names.setdefault(name.replace("_", " ").casefold(), number)
    return names
