"""Text made fit for a terminal; with nothing but the standard library, as failures need it too."""


def printable(text: str) -> str:
    """`text` as it may be shown on a terminal: whatever could steer one is escaped.

    All that comes from a mission, a log or a command line goes through here before it is printed.
    """
    return text if text.isprintable() else "".join(map(_escaped, text))


def _escaped(character: str) -> str:
    return character if character.isprintable() else repr(character)[1:-1]
