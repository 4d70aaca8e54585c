"""XML of untrusted files as a bounded tree with line numbers.

Entities are refused, so that nothing expands (billion laughs) and nothing is fetched (external entities). A plain
`<!DOCTYPE>`, as drawing programs write it, is accepted, and the file that it names is not read.
"""

from dataclasses import dataclass, field
from typing import NoReturn
from xml.parsers import expat

from sandbox.echo import short_repr
from sandbox.levels.level_files import refuse
from sandbox.resource_limits import FILE_SIZE

MAX_XML_ELEMENTS = 200_000
"""Elements of a file; they are read in a second."""
MAX_XML_DEPTH = 100
"""Nested elements; the readers recurse a few frames per level."""

_PREFIXES = {
    "http://www.w3.org/2000/svg": "",
    "http://www.w3.org/1999/xlink": "",
    "http://www.inkscape.org/namespaces/inkscape": "inkscape:",
    "http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd": "sodipodi:",
}
"""Prefix of the names of a namespace; names of other namespaces keep its address."""


@dataclass
class XmlNode:
    """One element of an XML file."""

    tag: str
    """name; of a namespace other than SVG with its prefix or its address"""
    attributes: dict[str, str]
    line: int | None
    """line of its start tag, from 1; None if it was read from JSON"""
    children: list["XmlNode"] = field(default_factory=list)
    text: str = ""
    """its characters, without those of its children"""

    def find(self, tag: str) -> "XmlNode | None":
        """Return the first child with this tag, or None."""
        return next((child for child in self.children if child.tag == tag), None)

    def find_all(self, tag: str) -> list["XmlNode"]:
        """Return the children with this tag."""
        return [child for child in self.children if child.tag == tag]


def parse_xml(text: str, file: str) -> XmlNode:
    """Parse a text of at most `FILE_SIZE` bytes.

    Args:
        text: the text; an encoding that it declares is ignored.
        file: its name in faults.

    Returns:
        The root element.

    Raises:
        SceneError: the text is not well-formed, declares or uses entities, or has too many elements or levels.
    """
    if not text.strip():
        refuse(file, "the file is empty", 1)
    builder = _TreeBuilder(file)
    try:
        content = text.encode()
    except UnicodeEncodeError:
        refuse(file, "contains characters that are not Unicode text")
    if len(content) > FILE_SIZE.value:
        refuse(file, f"is too large: {FILE_SIZE.remedy(len(content))}")
    builder.parse(content)
    assert builder.root is not None  # expat refuses a document without an element
    return builder.root


class _TreeBuilder:
    """Handlers of expat that build the tree, and refuse what is not bounded."""

    def __init__(self, file: str) -> None:
        self.root: XmlNode | None = None
        self._file = file
        self._open: list[XmlNode] = []
        self._count = 0
        parser = expat.ParserCreate("utf-8", namespace_separator=" ")
        parser.buffer_text = True
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._characters
        parser.EntityDeclHandler = self._entity
        parser.SkippedEntityHandler = self._entity
        parser.ExternalEntityRefHandler = self._entity
        self._parser = parser

    def parse(self, content: bytes) -> None:
        try:
            self._parser.Parse(content, True)
        except expat.ExpatError as error:
            message = expat.errors.messages[error.code] if error.code else str(error)
            refuse(self._file, f"not well-formed XML: {message}, at column {error.offset + 1}", error.lineno)

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._count += 1
        if self._count > MAX_XML_ELEMENTS:
            self._refuse(f"has more than {MAX_XML_ELEMENTS:,} elements")
        if len(self._open) >= MAX_XML_DEPTH:
            self._refuse(f"elements are nested more than {MAX_XML_DEPTH} levels deep; ungroup some")
        named = {_short_name(key): value for key, value in attributes.items()}
        node = XmlNode(_short_name(name), named, self._parser.CurrentLineNumber)
        if self._open:
            self._open[-1].children.append(node)
        else:
            self.root = node
        self._open.append(node)

    def _end(self, _: str) -> None:
        self._open.pop()

    def _characters(self, text: str) -> None:
        self._open[-1].text += text

    def _entity(self, *details: object) -> NoReturn:
        name = short_repr(details[0]) if details and isinstance(details[0], str) else "an external one"
        self._refuse(
            f"entities are refused ({name}); save the file without them, in Illustrator without its editing data"
        )

    def _refuse(self, message: str) -> NoReturn:
        refuse(self._file, message, self._parser.CurrentLineNumber)


def _short_name(name: str) -> str:
    """Return `address local`, as expat names it, as `prefix:local`."""
    address, _, local = name.rpartition(" ")
    if not address:
        return local
    return _PREFIXES[address] + local if address in _PREFIXES else f"{{{address}}}{local}"
