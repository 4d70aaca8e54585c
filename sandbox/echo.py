"""Echoes: input as messages quote it, bounded in length and in one line, whatever a user or a file gave."""

MAX_ECHO = 80
"""Characters of an input that a message quotes."""
MAX_NAMED = 240
"""Characters of the name of a file, or of the path of a key, in a message."""
MAX_MESSAGE = 1000
"""Characters of a message, whatever it quotes."""


def shorten(text: str, most: int = MAX_ECHO) -> str:
    """Return a text of at most `most` characters: of a longer one the beginning and the end, and … in between."""
    if len(text) <= most:
        return text
    return f"{text[: most - most // 3 - 1]}…{text[-(most // 3) :]}"


def short_repr(value: object) -> str:
    """Return the `repr` of a value, at most `MAX_ECHO` characters."""
    return shorten(repr(shorten(value) if isinstance(value, str) else value))


def printable(text: str) -> str:
    """Return a text in one line, with unprintable characters escaped."""
    return "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)


def short_count(count: int) -> str:
    """Return a count, of many digits as a power of ten."""
    digits = len(str(count)) if count.bit_length() < 10_000 else None  # Python converts no more than 4,300
    if digits is None:
        return "more than 10^3,000"
    return f"{count:,}" if digits <= 15 else f"10^{digits - 1:,}"
