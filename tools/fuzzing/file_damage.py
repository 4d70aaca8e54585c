"""Damage to files: each kind is a function of a file and a JSON object, so that a case file can contain it.

A damage is `{"op": "flip", "at": [0.2, 0.7]}`. Positions are fractions of the length of a file, so that a case stays
meaningful if the damaged file changes slightly. A raw JSON value is `{"raw": "NaN"}` or
`{"before": "[", "after": "]", "times": 10000}`.
"""

import io
import json
import random
import sqlite3
import struct
import zipfile
from collections.abc import Callable, Iterable, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from sandbox.run_file import DAMAGE

Damage = dict[str, Any]

PLACEHOLDER = "\x01raw value\x01"

# --- bytes ----------------------------------------------------------------------------------------------------------


def _index(content: bytes | bytearray, at: float) -> int:
    return min(int(at * len(content)), max(len(content) - 1, 0))


def flip(content: bytearray, damage: Damage) -> bytearray:
    """Flip a bit at each of several positions."""
    for at in damage["at"] if content else ():
        bit = at * len(content) * 8
        content[int(bit) // 8] ^= 1 << int(bit) % 8
    return content


def zero(content: bytearray, damage: Damage) -> bytearray:
    """Overwrite a block with zeros."""
    start = _index(content, damage["at"])
    block = content[start : start + damage["length"]]
    content[start : start + len(block)] = bytes(len(block))
    return content


def overwrite(content: bytearray, damage: Damage) -> bytearray:
    """Overwrite a block with other bytes."""
    start, block = _index(content, damage["at"]), bytes.fromhex(damage["hex"])
    content[start : start + len(block)] = block
    return content


def insert(content: bytearray, damage: Damage) -> bytearray:
    """Insert bytes."""
    start = int(damage["at"] * len(content))
    content[start:start] = bytes.fromhex(damage["hex"]) * damage.get("times", 1)
    return content


def cut(content: bytearray, damage: Damage) -> bytearray:
    """Cut a block out; the length may reach beyond the end, which truncates the file."""
    start = _index(content, damage["at"])
    del content[start : start + damage["length"]]
    return content


def double(content: bytearray, damage: Damage) -> bytearray:
    """Repeat a block in place."""
    start = _index(content, damage["at"])
    block = content[start : start + damage["length"]]
    content[start:start] = block
    return content


def crlf(content: bytearray, _: Damage) -> bytes:
    """Replace line ends by CRLF."""
    return bytes(content).replace(b"\n", b"\r\n")


def recode(content: bytearray, damage: Damage) -> bytes:
    """Encode a text differently, such as in `utf-16` or `utf-8-sig`."""
    return bytes(content).decode("utf-8", "replace").encode(damage["to"])


BYTES: dict[str, Callable[[bytearray, Damage], bytes | bytearray]] = {
    each.__name__: each for each in (flip, zero, overwrite, insert, cut, double, crlf, recode)
}

# --- JSON -----------------------------------------------------------------------------------------------------------


def raw_json(damage: Damage) -> str:
    """Return the raw JSON text of a value."""
    times = damage.get("times", 1)
    return str(damage.get("before", "") * times + damage.get("raw", "") + damage.get("after", "") * times)


def damage_json(text: str, damage: Damage) -> str:
    """Set, delete or duplicate the value at a path of a document.

    A path consists of keys and indices; a path that does not exist is followed as far as possible.
    """
    document = [json.loads(text)]
    holder: Any = document
    key: Any = 0
    for step in damage["path"]:
        inner = holder[key]
        if isinstance(inner, list) and isinstance(step, int) and inner:
            holder, key = inner, step % len(inner)
        elif isinstance(inner, dict) and isinstance(step, str):
            holder, key = inner, step
            inner.setdefault(step, None)
        else:
            break
    if damage["how"] == "delete" and holder is not document:
        del holder[key]
    elif damage["how"] == "duplicate" and isinstance(holder, dict):
        holder[PLACEHOLDER] = 0
        again = f"{json.dumps(key)}: {raw_json(damage)}"
        return json.dumps(document[0]).replace(f"{json.dumps(PLACEHOLDER)}: 0", again)
    else:
        holder[key] = PLACEHOLDER
        return json.dumps(document[0]).replace(json.dumps(PLACEHOLDER), raw_json(damage))
    return json.dumps(document[0])


# --- archives of arrays ---------------------------------------------------------------------------------------------


def _npy(array: Any, pickled: bool = False) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=pickled)
    return stream.getvalue()


def _array(content: bytes) -> Any:
    return np.load(io.BytesIO(content), allow_pickle=False)


def header(content: bytes, damage: Damage) -> bytes:
    """Write a header with another shape or type for the same data."""
    found = _array(content)
    shape, descr = damage.get("shape", str(found.shape)), damage.get("descr", repr(found.dtype.str))
    text = f"{{'descr': {descr}, 'fortran_order': {damage.get('fortran', False)}, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text) % 65536) + text + bytes(found.tobytes())


def cast(content: bytes, damage: Damage) -> bytes:
    """Store the values as another type."""
    with np.errstate(all="ignore"):
        try:
            return _npy(_array(content).astype(damage["dtype"]))
        except (ValueError, TypeError):
            return _npy(np.zeros(_array(content).shape, damage["dtype"]))


def resize(content: bytes, damage: Damage) -> bytes:
    """Store fewer or more rows."""
    found = _array(content)
    shape = (damage["rows"], *found.shape[1:]) if damage["axis"] == 0 else (*found.shape[:-1], damage["rows"])
    return _npy(np.resize(found, shape) if found.size else np.zeros(shape, found.dtype))


def reshape(content: bytes, damage: Damage) -> bytes:
    """Store zeros of another shape, which may be large because zeros compress well."""
    return _npy(np.zeros(damage["shape"], _array(content).dtype))


def put(content: bytes, damage: Damage) -> bytes:
    """Replace one value."""
    found = _array(content).copy()
    if found.size:
        with np.errstate(all="ignore"):
            value = np.asarray(damage["value"])
            flat = found.reshape(-1)
            flat[_index(bytes(len(flat)), damage["at"])] = value.astype(found.dtype)
    return _npy(found)


def shuffle(content: bytes, damage: Damage) -> bytes:
    """Permute the rows."""
    found = _array(content)
    order = np.random.default_rng(damage["seed"]).permutation(len(found)) if found.ndim else ()
    return _npy(found[order])


def fortran(content: bytes, _: Damage) -> bytes:
    """Store the values in Fortran order."""
    return _npy(np.asfortranarray(_array(content)))


def pickle(content: bytes, _: Damage) -> bytes:
    """Store the values as pickled objects."""
    return _npy(_array(content).astype(object), pickled=True)


def text(_: bytes, damage: Damage) -> bytes:
    """Store a text."""
    return _npy(np.asarray(raw_json(damage)))


def code_points(content: bytes, damage: Damage) -> bytes:
    """Replace characters of a text by invalid code points."""
    found = _array(content)
    if found.dtype.kind != "U" or not found.size:
        return content
    codes = np.frombuffer(found.tobytes(), "<u4").copy()
    codes[_index(bytes(len(codes)), damage["at"])] = damage["code"]
    return header(_npy(codes), {"descr": repr(found.dtype.str), "shape": str(found.shape)})


def info(content: bytes, damage: Damage) -> bytes:
    """Damage the JSON of the member `info`."""
    return _npy(np.asarray(damage_json(str(_array(content)), damage)))


MEMBER: dict[str, Callable[[bytes, Damage], bytes]] = {
    each.__name__: each
    for each in (header, cast, resize, reshape, put, shuffle, fortran, pickle, text, code_points, info)
}


def damage_archive(path: Path, damage: Damage) -> None:
    """Rewrite an archive with changed members."""
    with zipfile.ZipFile(path) as archive:
        members = [(name, archive.read(name)) for name in archive.namelist()]
    op, name = damage["op"], f"{damage.get('member', 'time')}.npy"
    named, other = dict(members), f"{damage.get('other', 'time')}.npy"
    method = zipfile.ZIP_DEFLATED
    if op == "remove":
        members = [each for each in members if each[0] != name]
    elif op == "repeat":
        members.append((name, named[other]))
    elif op == "rename":
        members = [(damage["to"] if each == name else each, content) for each, content in members]
    elif op == "swap":
        named[name], named[other] = named[other], named[name]
        members = list(named.items())
    elif op == "method":
        method = damage["method"]
    else:
        members = [(each, MEMBER[op](content, damage) if each == name else content) for each, content in members]
    with zipfile.ZipFile(path, "w", method) as archive:
        for each, content in members:
            archive.filelist = [entry for entry in archive.filelist if op == "repeat" or entry.filename != each]
            archive.NameToInfo.pop(each, None)  # avoids the warning about a duplicate name
            archive.writestr(each, content)


ARCHIVE = (*MEMBER, "remove", "repeat", "rename", "swap", "method")

# --- databases ------------------------------------------------------------------------------------------------------


def damage_database(path: Path, damage: Damage) -> None:
    """Execute an SQL statement on a database; `hex` or `value` is its parameter."""
    value: Any = damage.get("value")
    if "hex" in damage:
        value = bytes.fromhex(damage["hex"])
    with closing(sqlite3.connect(path)) as connection:
        connection.text_factory = bytes
        try:
            connection.execute(damage["sql"], (value,) if "?" in damage["sql"] else ())
            connection.commit()
        except sqlite3.DatabaseError:
            return  # the database is damaged already


# --- files ----------------------------------------------------------------------------------------------------------


def apply_damage(path: Path, damages: Iterable[Damage]) -> None:
    """Damage a file in place; damages that cannot be applied to an already damaged file are skipped."""
    for damage in damages:
        op = damage["op"]
        if op == "folder":
            path.unlink(missing_ok=True)
            path.mkdir(exist_ok=True)
        if path.is_dir():
            return
        if op == "sql":
            damage_database(path, damage)
        elif op in BYTES:
            path.write_bytes(BYTES[op](bytearray(path.read_bytes()), damage))
        elif op == "json":
            try:
                changed = damage_json(path.read_text(encoding="utf-8"), damage)
            except (ValueError, RecursionError):
                continue
            path.write_text(changed, encoding="utf-8", errors="surrogatepass")
        elif op in ARCHIVE:
            try:
                damage_archive(path, damage)
            except (*DAMAGE, KeyError, OSError):
                continue


# --- drawing damages ------------------------------------------------------------------------------------------------

RAW: tuple[Mapping[str, Any], ...] = tuple(
    [{"raw": raw} for raw in (
        "null", "true", "false", "0", "-1", "1", "7", "1.5", "-0.0", "1e308", "-1e308", "1e-320", "1e999", "NaN",
        "Infinity", "-Infinity", "9007199254740993", "1000000000000000000000000000000", '""', '"a"', '"ok"', '"0.1"',
        '"nan"', '"\\ud800"', '"\\u0000"', '"a\\nb\\u001b[31m"', '"\u202e\U0001f3b1"', "[]", "{}", "[[]]", "[null]",
        '{"a": {}}', "[1, 2]", '["a", "b"]', "[0, 0, 0]", "nul", '"', "",
    )]
    + [{"raw": "1", "after": "0", "times": times} for times in (400, 5000)]
    + [{"before": "[", "after": "]", "times": times} for times in (40, 300, 10_000)]
    + [{"before": '{"a":', "raw": "1", "after": "}", "times": times} for times in (40, 10_000)]
    + [{"raw": '"', "after": "x", "times": 100_000}, {"raw": '"x"', "before": " ", "times": 100_000}]
)  # fmt: skip
"""Raw values that replace the value of a key."""

SHAPES = (
    "()", "(0,)", "(1,)", "(-1,)", "(3, -2)", "(1000000000000000,)", "(1000000000000000, 2, 2)",
    "(0, 1000000000000000)",
    "(18446744073709551616,)", "(2.0,)", "('a',)", "None", "(" + "1, " * 70 + ")", "(" + "9" * 5000 + ",)",
)  # fmt: skip
DESCRS = (
    "'|O'", "'<f4'", "'>f8'", "'<i8'", "'<U3'", "'<U0'", "'<U4294967295'", "'|V8'", "'<M8[s]'", "'<c16'", "'|b1'",
    "[('a', '<f8')]", "'x'", "8", "'<f8', 'descr': '<i8'", "-" * 5000 + "1", "(" * 3000,
)  # fmt: skip
DTYPES = ("<f4", ">f8", "<i8", "<i4", "|b1", "<c16", "<U5", "|S5", "<f2", "|u1", ">i8", "<M8[s]")
VALUES: tuple[Any, ...] = (float("nan"), float("inf"), float("-inf"), -1.0, 1e300, -1e300, 1e9, 2**62, -(2**62), 0, 5)
COLUMNS = (
    "id", "scene_hash", "scene_title", "engine", "settings", "seed", "versions", "status", "reason", "created", "steps",
    "seconds", "energy_start", "energy_end", "contacts", "missed_contacts", "path", "score",
)  # fmt: skip
STATEMENTS = (
    "PRAGMA user_version = 99", "PRAGMA user_version = -1", "PRAGMA user_version = 1", "PRAGMA user_version = 0",
    "PRAGMA application_id = 7", "DROP TABLE runs", "ALTER TABLE runs RENAME TO other", "DELETE FROM runs",
    "ALTER TABLE runs DROP COLUMN score", "ALTER TABLE runs ADD COLUMN more TEXT",
    "ALTER TABLE runs RENAME status TO s",
    "CREATE TRIGGER t AFTER INSERT ON runs BEGIN DELETE FROM runs; END", "CREATE VIEW v AS SELECT * FROM runs",
    "CREATE TABLE other (a)", "UPDATE runs SET path = id || 'x.npz'", "UPDATE runs SET path = '../' || path",
    "INSERT INTO runs SELECT substr(id, 2) || 'a', scene_hash, scene_title, engine, settings, seed, versions, status,"
    " reason, created, steps, seconds, energy_start, energy_end, contacts, missed_contacts, path, score FROM runs",
)  # fmt: skip


def draw_bytes(draw: random.Random) -> Damage:
    """Draw damage to the bytes of any file."""
    at = draw.choice((0.0, 1.0, draw.random(), draw.random()))
    length = draw.choice((1, 4, 64, 512, 4096, 10**9))
    hexadecimal = draw.randbytes(draw.choice((1, 2, 8, 100))).hex()
    return draw.choice(
        (
            {"op": "flip", "at": [draw.random() for _ in range(draw.choice((1, 1, 2, 8, 64)))]},
            {"op": "zero", "at": at, "length": length},
            {"op": "overwrite", "at": at, "hex": hexadecimal},
            {"op": "insert", "at": at, "hex": hexadecimal, "times": draw.choice((1, 1, 1000))},
            {"op": "cut", "at": at, "length": length},
            {"op": "cut", "at": draw.random(), "length": 10**9},
            {"op": "double", "at": at, "length": length},
        )
    )


def draw_text(draw: random.Random) -> Damage:
    """Draw damage to a text file."""
    if draw.random() < 0.6:
        return draw_bytes(draw)
    strange = draw.choice(("\ufeff", "\x00", "\x1b[2J", "\r", "\u2028", "\U0001f3b1", "\x80", "é", "{", "[", '"', "'"))
    return draw.choice(
        (
            {"op": "crlf"},
            {"op": "recode", "to": draw.choice(("utf-16", "utf-8-sig", "utf-32"))},
            {"op": "insert", "at": draw.random(), "hex": draw.choice(("ff", "c3", "eda080", "f4908080", "fe"))},
            {
                "op": "insert", "at": draw.choice((0.0, 1.0, draw.random())), "hex": strange.encode().hex(),
                "times": draw.choice((1, 1, 3, 10_000)),
            },
        )
    )  # fmt: skip


def paths_of(document: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the path of every value of a JSON document."""
    inner = (
        document.items() if isinstance(document, dict) else enumerate(document) if isinstance(document, list) else ()
    )
    return [path, *(found for key, value in inner for found in paths_of(value, (*path, key)))]


def draw_json(document: Any, draw: random.Random, op: str = "json") -> Damage:
    """Draw damage to a JSON document; half of the paths are at or just below its root."""
    paths = paths_of(document)
    shallow = [path for path in paths if len(path) <= 1]
    path = list(draw.choice(draw.choice((paths, shallow))))
    how = draw.choice(("set", "set", "set", "set", "delete", "duplicate"))
    return {"op": op, "path": path, "how": how, **draw.choice(RAW)}


def draw_archive(shapes: Mapping[str, tuple[int, ...]], document: Any, draw: random.Random) -> Damage:
    """Draw damage to an archive of arrays with these shapes, whose `info` is a JSON document."""
    names = sorted(shapes)
    member, other = draw.choice(names), draw.choice(names)
    rows = draw.choice((0, 1, 2, 3, shapes[member][0] + 1 if shapes[member] else 1, 100_000))
    large = draw.choice(([10**6, 4], [3 * 10**7], [5 * 10**7], [0, 10**15], [1, 1, 1]))
    damage = draw.choice(
        (
            {"op": "header", "shape": draw.choice(SHAPES)},
            {"op": "header", "descr": draw.choice(DESCRS)},
            {"op": "header", "fortran": draw.choice((True, 1, "'x'"))},
            {"op": "cast", "dtype": draw.choice(DTYPES)},
            {"op": "resize", "rows": rows, "axis": draw.choice((0, -1))},
            {"op": "reshape", "shape": large if draw.random() < 0.15 else draw.choice(([], [0], [1], [2, 2], [0, 0]))},
            {"op": "put", "at": draw.random(), "value": draw.choice(VALUES)},
            {"op": "put", "at": draw.random(), "value": draw.choice(VALUES)},
            {"op": "shuffle", "seed": draw.randrange(1000)},
            {"op": "fortran"},
            {"op": "pickle"},
            {"op": "text", **draw.choice(RAW)},
            {
                "op": "code_points",
                "at": draw.random(),
                "code": draw.choice((0xD800, 0x110000, 2**31 - 1, 2**32 - 1, 0)),
            },
            {"op": "remove"},
            {"op": "repeat", "other": other},
            {"op": "rename", "to": draw.choice(("x.npy", "Time.npy", "time", "../time.npy", "a\x00b.npy", "é.npy"))},
            {"op": "swap", "other": other},
            {"op": "method", "method": draw.choice((zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2, zipfile.ZIP_STORED))},
        )
    )
    if damage["op"] in ("code_points", "text"):
        member = draw.choice(("names", "info"))
    if draw.random() < 0.35:
        return draw_json(document, draw, "info") | {"member": "info"}
    return {"member": member, **damage}


def draw_database(draw: random.Random) -> Damage:
    """Draw damage to the database of a store."""
    if draw.random() < 0.4:
        return draw_bytes(draw)
    if draw.random() < 0.4:
        return {"op": "sql", "sql": draw.choice(STATEMENTS)}
    column = draw.choice(COLUMNS)
    value = draw.choice((None, "", "x", "nan", -1, 0, 1.5, 2**62, "../x", "/dev/zero", "{}", "[]", "\x00", "[" * 5000))
    if draw.random() < 0.4:
        kind = draw.choice(("?", "CAST(? AS TEXT)"))
        return {
            "op": "sql",
            "sql": f"UPDATE runs SET {column} = {kind}",
            "hex": draw.choice(("ff", "eda080", "c328", "")),
        }
    return {"op": "sql", "sql": f"UPDATE runs SET {column} = ?", "value": value}
