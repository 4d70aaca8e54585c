"""Numbers as users write them: expressions such as `2*pi`, `1/60` or `45 deg`, evaluated without `eval`."""

import ast
import math
import operator
import re
from collections.abc import Callable

MAX_TYPED = 200
"""Largest length of the text of a number or of each component; also limits the depth of expressions."""

_NO_NUMBER = "must be a number, such as 0.5, 1e-3, 1/60 or 2*pi"
_CONSTANTS = {"pi": math.pi, "π": math.pi, "tau": math.tau, "deg": math.pi / 180.0}
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
    "deg": math.radians,
}
_OPERATORS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_FACTOR = re.compile(r"(?<=[0-9.)])\s*(?=(?:pi|π|tau|deg)\b)")
"""place of an omitted multiplication sign, as in `45 deg`"""
_EXPRESSION = re.compile(r"(?:(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?![\w.])|[a-zπ]+|[-+*/()\s])*", re.ASCII)
_LEADING_ZEROS = re.compile(r"(?<![\d.])0+(?=\d)")
"""not allowed by the syntax of Python"""


def evaluated(text: str) -> float:
    """Return the value of a number or an expression; an int if it consists of whole numbers without a division.

    Raises:
        ValueError: it is no expression of numbers, or has no finite real value.
    """
    if len(text) > MAX_TYPED:
        raise ValueError(f"must have at most {MAX_TYPED} characters, has {len(text)}")
    source = _FACTOR.sub("*", text.replace("−", "-").replace("·", "*").replace("°", " deg").replace("^", "**"))
    if _EXPRESSION.fullmatch(source) is None:
        raise ValueError(_NO_NUMBER)
    try:
        value = _value(ast.parse(_LEADING_ZEROS.sub("", source.strip()), mode="eval").body)
        is_finite = math.isfinite(value)
    except (SyntaxError, TypeError, KeyError, MemoryError, RecursionError):
        raise ValueError(_NO_NUMBER) from None
    except ZeroDivisionError:
        raise ValueError("must not divide by 0") from None
    except OverflowError:
        is_finite = False
    except ValueError:  # such as the square root of a negative number
        raise ValueError("must have a real value") from None
    if not is_finite:
        raise ValueError("must be a finite number")
    return value


def _value(node: ast.expr) -> float:
    """Return the value of an expression.

    Raises:
        TypeError: a part of it is no number and no operation on numbers.
        KeyError: an unknown constant, function or operation.
        ArithmeticError, ValueError: an operation has no value.
    """
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            return number
        case ast.Name(id=name):
            return _CONSTANTS[name]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            value = _value(operand)
            return -value if value else -0.0
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _value(operand)
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            return _power(_value(left), _value(right))
        case ast.BinOp(left=left, op=operation, right=right):
            return _OPERATORS[type(operation)](_value(left), _value(right))
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]):
            return _FUNCTIONS[name](_value(argument))
    raise TypeError(node)


def _power(base: float, exponent: float) -> float:
    """Return a power; as an int only if it is small, as large ones take long."""
    if isinstance(base, int) and isinstance(exponent, int) and 0 <= exponent * base.bit_length() <= 128:
        return int(base**exponent)
    return math.pow(base, exponent)
