"""Messages for text that is not TOML: the usual mistakes, and the text that would be right.

tomllib names the line and column at which it stopped. The remedies look at the text there; they do not parse it.
"""

import re
import tomllib
from collections.abc import Iterator

from sandbox.scene.errors import Fault, Location, enter, path_of
from sandbox.scene.files.document import list_tables
from sandbox.scene.files.expressions import evaluated
from sandbox.scene.files.toml_index import statements

MAX_ROW = 1000
"""Characters of a line beyond which it gets no remedy: the patterns may take quadratic time."""

_KEY = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')(?:[ \t]*\.[ \t]*[\w-]+)*"""
_ASSIGNMENT = re.compile(rf"[ \t]*({_KEY})[ \t]*=(?!=)[ \t]*", re.ASCII)
_HEADING = re.compile(r"[ \t]*(\[\[?)[ \t]*([A-Za-z_][\w.-]*)[ \t]*\]*[ \t]*(?:#.*)?$", re.ASCII)
_SEPARATORS = " \t,[]{}=#\"'"
"""end a value that is neither text nor an array"""
_COMMENT = re.compile(r"[ \t]*#.*$")
_PREFIXES = {"ms": 1e-3, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "g": 1e-3, "%": 1e-2}
"""units that are converted, besides those of SI"""
_WITH_UNIT = re.compile(
    r"([+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)\s*(ms|mm|cm|km|g|%|(?:kg|Hz|rad|sec|[msNJ])(?:/(?:kg|m|s)(?:²|\^2|\*\*2|2)?)?)",
    re.ASCII,
)
_DECIMAL_COMMA = re.compile(r"([+-]?\d+),(\d+)", re.ASCII)
_QUOTES = "“”„«»‘’"
_TRUTH = {"true": "true", "yes": "true", "on": "true", "false": "false", "no": "false", "off": "false"}
_NOTHING = ("none", "null", "nil")


def syntax_fault(file: str, text: str, error: tomllib.TOMLDecodeError) -> Fault:
    """Return the fault of a text that is not TOML, with the remedy of a usual mistake.

    Args:
        file: name of the text.
        text: the text.
        error: of the parser.
    """
    message, lines = str(error), text.replace("\r\n", "\n").rstrip("\n").split("\n")
    at = re.search(r" \(at line (\d+), column (\d+)\)$", message)
    line, column = (int(at[1]), int(at[2])) if at else (len(lines), len(lines[-1]) + 1)
    row, position = (lines[line - 1] if line <= len(lines) else ""), column - 1
    statement = _statement_above(lines, line, is_before=message.startswith("Unclosed") and not row[:position].strip())
    assignment = _ASSIGNMENT.match(lines[statement - 1])
    key = assignment[1] if assignment else ""
    if _ends_unclosed(message, row, position, has_position=at is not None):
        line, row, position = statement, lines[statement - 1], len(lines[statement - 1])
    remedy = next(_remedies(message, row, position), None) if len(row) <= MAX_ROW else None
    if remedy is None:
        place = f", at column {at[2]}" if at else ""
        return Fault(file, line, "", f"not TOML: {message[: at.start()] if at else message}{place}")
    return Fault(file, line, _path("\n".join(lines[: statement - 1]), key), remedy)


def _statement_above(lines: list[str], line: int, is_before: bool) -> int:
    """Return the line of the key or heading to which a line belongs; it is above the line if `is_before`."""
    for number in range(line - is_before, 0, -1):
        if _ASSIGNMENT.match(lines[number - 1]) or _HEADING.match(lines[number - 1]):
            return number
    return line


def _ends_unclosed(message: str, row: str, position: int, has_position: bool) -> bool:
    """Return whether an array has no end: the next statement begins, or the text ends, where it should go on."""
    if not message.startswith("Unclosed array"):
        return False
    is_next = _ASSIGNMENT.match(row) is not None or _HEADING.match(row) is not None
    return not has_position or (is_next and not row[:position].strip())


def _path(above: str, key: str) -> str:
    """Return the path of a key by the text above it; the key alone if that cannot be read."""
    if not key:
        return ""
    table: Location = ()
    counts: dict[Location, int] = {}
    try:
        document = tomllib.loads(above)
        for each in statements(above):
            if each.heading:
                table = enter((each.keys, above.startswith("[[", each.head[0])), counts)
    except ValueError:
        return key
    parts = tuple(part.strip().strip("\"'") for part in key.split("."))
    return path_of((*table, *parts), document)


def _remedies(message: str, row: str, position: int) -> Iterator[str]:
    """Yield what would be right, by the text of a line and the position at which the parser stopped."""
    if message.startswith("Cannot"):
        yield from _repeated(message, row)
    elif heading := _HEADING.match(row):
        brackets = heading[1] == "[[" or heading[2] in list_tables()
        right = _heading(heading[2], brackets)
        is_right = _COMMENT.sub("", row).strip() == right
        yield "a bracket ] is missing above this heading" if is_right else f"write the heading as {right}"
    elif message.startswith("Invalid statement"):
        if row.lstrip().startswith(("//", ";", "/*", "--", "%")):
            yield "a comment begins with #"
    elif "quote" in message or message.startswith(("Unterminated string", "Illegal character")):
        yield from _unclosed_text(row)
    elif message.startswith(("Expected '='", "Invalid initial character")):
        yield from _key_remedies(row, position)
    else:
        yield from _value_remedies(message, row, position)


def _heading(name: str, is_list: bool) -> str:
    return f"[[{name}]]" if is_list else f"[{name}]"


def _repeated(message: str, row: str) -> Iterator[str]:
    """Yield the remedy for a table or key that is there twice."""
    heading, assignment = _HEADING.match(row), _ASSIGNMENT.match(row)
    if heading and heading[2] in list_tables():
        yield f"[{heading[2]}] is there twice; write each heading as [[{heading[2]}]]"
    elif heading and message.startswith("Cannot declare"):
        yield f"the table [{heading[2]}] is there twice; put all of its keys under one heading"
    elif assignment and message.startswith("Cannot overwrite"):
        yield "this key is there twice in its table; remove one of them"


def _unclosed_text(row: str) -> Iterator[str]:
    """Yield the remedy for a text whose closing quote is missing."""
    assignment = _ASSIGNMENT.match(row)
    value = row[assignment.end() :].rstrip() if assignment else ""
    if assignment and value[:1] in ('"', "'") and value.count(value[0]) == 1:
        yield f"the quote at the end of the text is missing: {assignment[1]} = {value}{value[0]}"


def _key_remedies(row: str, position: int) -> Iterator[str]:
    """Yield remedies for a key without `=`, and for what cannot be a key."""
    rest = row[position:].strip()
    if match := re.search(r"([+-]?\d+),(\d+)[ \t]*$", row[:position], re.ASCII):
        yield f"decimals have a point: {match[1]}.{match[2]}"
    if "{" in row[:position]:
        if rest.startswith("}") and row[:position].rstrip().endswith(","):
            yield "remove the comma before }"
        elif match := re.match(rf"\s*({_KEY})\s*=\s*\{{\s*([^{{}}=]+?)\s*\}}", row, re.ASCII):
            value = f"[{match[2]}]" if "," in match[2] else match[2]
            yield f"braces hold keys with values; write {match[1]} = {value}"
        elif not rest or rest.startswith("#"):
            yield "a table in braces must be on one line; put longer ones under a heading, such as [world]"
    if match := re.match(rf"\s*({_KEY})\s*:\s*(\S.*)$", row, re.ASCII):
        yield f"write = in place of the colon: {match[1]} = {match[2]}"
    if match := re.match(r"\s*(\w+(?:[ \t]+\w+)+)[ \t]*(=.*)$", row, re.ASCII):
        yield f"a key has no spaces: {'_'.join(match[1].split())} {match[2]}"
    if match := re.match(rf"\s*({_KEY})[ \t]+([^\s=].*)$", row, re.ASCII):
        yield f"= is missing after the key: {match[1]} = {match[2]}"
    if not rest and (word := row.strip()) and (word in list_tables() or word in ("world", "solver", "play")):
        yield f"write the heading as {_heading(word, word in list_tables())}"


def _value_remedies(message: str, row: str, position: int) -> Iterator[str]:
    """Yield remedies for a value that TOML does not have, and for what follows a value."""
    assignment = _ASSIGNMENT.match(row)
    before = f"{assignment[1]} = " if assignment else ""
    rest = row[position:].strip()
    whole = _COMMENT.sub("", row[assignment.end() :]).strip() if assignment else ""
    is_whole = bool(whole) and whole[0] not in "[{\"'"
    if row[position : position + 1] == "=":
        yield "write one = only"
    if assignment and not whole:
        yield "a value is missing after ="
    if message.startswith("Expected newline"):
        yield from _trailing(whole, before, row[position : position + 1], rest)
    if is_whole:
        yield from _scalar_remedies(whole, before)
    elif whole[:1] not in ('"', "'") and (message.startswith("Invalid") or not _is_after_value(row, position)):
        yield from _scalar_remedies(_token(row, position), "")
    if message.startswith("Unclosed"):
        bracket = "}" if "table" in message else "]"
        is_end = not rest or rest.startswith("#")
        quantity = f"{_token(row, len(row[:position].rstrip()))} {re.split('[],}]', rest)[0].strip()}"
        if not is_end and _WITH_UNIT.fullmatch(quantity):
            yield from _scalar_remedies(quantity, "")
        elif not is_end:
            yield f"a comma is missing before {rest[:20]}"
        elif (
            bracket == "]"
            and assignment
            and row[assignment.end() :].count("[") == row.count("]") + 1
            and whole[-1] not in "[,"
        ):
            yield f"the bracket at the end is missing: {before}{whole}]"
        elif bracket == "]":
            yield "the bracket ] at the end is missing"
        else:
            yield "the brace } at the end is missing; a table in braces must be on one line"


def _trailing(whole: str, before: str, sign: str, rest: str) -> Iterator[str]:
    """Yield the remedy for what follows the value of a statement, of which `sign` is the first character."""
    if sign in ("]", "}"):
        yield f"remove the last {sign}: more brackets are closed than opened"
    if sign in (";", ",") and not _COMMENT.sub("", rest)[1:].strip():
        yield f"remove the {sign} at the end: {before}{whole[:-1].rstrip()}"
    if whole[:1] in ('"', "'") and whole[0] in rest:
        other = "'" if whole[0] == '"' else '"'
        yield f"the text ends at its second {whole[0]}; put text that contains {whole[0]} between {other} and {other}"
    if _ASSIGNMENT.match(rest):
        yield "each key needs a line of its own"


def _is_after_value(row: str, position: int) -> bool:
    """Return whether a value ended before a position of a line, so that a comma or bracket was expected there."""
    return not row[:position] or row[position - 1] in _SEPARATORS


def _token(row: str, position: int) -> str:
    """Return the value without spaces at a position of a line, or which ends there."""
    begin = end = position
    while begin > 0 and row[begin - 1] not in _SEPARATORS:
        begin -= 1
    while end < len(row) and row[end] not in _SEPARATORS:
        end += 1
    return row[begin:end]


def _scalar_remedies(value: str, before: str) -> Iterator[str]:
    """Yield remedies for a number, truth value or text that TOML does not have, such as `1/60` or `True`."""
    if not value:
        return
    if value[0] == "(":
        yield "write a vector in square brackets, such as [0.0, 1.0]"
    if value[0] in _QUOTES:
        text = value.strip(_QUOTES)
        yield f'write straight quotes: {before}"{text}"'
    if (remedy := number_remedy(value)) is not None:
        reason, number = remedy
        yield f"{reason}: {before}{number}"
    if value.lower() in _TRUTH:
        yield f"write true or false: {before}{_TRUTH[value.lower()]}"
    if value.lower() in _NOTHING:
        yield "there is no empty value; remove this key"
    if re.match(r"[+-]?(?:[.\d]|nan|inf)", value, re.ASCII | re.IGNORECASE):
        return
    if value[0].isalpha() or (before and re.search(r"[^\W\d_]{2}", value)):
        yield f'put text in quotes: {before}"{value}"'


def number_remedy(text: str) -> tuple[str, str] | None:
    """Return why a text is no number of a TOML file, and the number that is meant; None if it means none.

    Examples are `1/60`, `0,5`, `.5`, `007`, `45°`, `−9.81` (with a minus sign of typography) and `3 s`.
    """
    text = text.strip()
    if match := re.fullmatch(r"([+-]?[1-9]\d{0,2}),(\d{3})", text, re.ASCII):
        return "numbers have no comma", f"{match[1]}{match[2]}, or {match[1]}.{match[2]}"
    if match := _DECIMAL_COMMA.fullmatch(text):
        return "decimals have a point", f"{match[1]}.{match[2]}"
    if match := _WITH_UNIT.fullmatch(text):
        return "numbers have no unit; all are in SI units", f"{float(match[1]) * _PREFIXES.get(match[2], 1.0):.9g}"
    try:
        value = float(evaluated(text))
        number = f"{value:.0f}" if value.is_integer() and abs(value) < 1e15 else repr(value)
    except ValueError:
        return None
    plain = text.lstrip("+-−")
    if "°" in text or "deg" in text:
        return "angles are in radians", number
    if re.fullmatch(r"\.\d+|\d+\.(?:[eE].*)?", plain):
        number = number if "." in number or "e" in number else f"{number}.0"
        return "a number needs a digit on both sides of its point", number
    if re.fullmatch(r"0\d.*", plain):
        return "a number has no leading zeros", number
    if re.fullmatch(r"[\d.]+(?:[eE][+-]?\d+)?", plain):
        return ("write the minus sign as -", number) if text.startswith("−") else None
    return "write fractions and formulas as a number", number
