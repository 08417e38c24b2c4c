"""Sixteen numbers at once: what generated code computes with them, written like arithmetic.

Numba finds no vectors in loops that look where to load from. Intrinsics that need them write LLVM's own,
which become what the processor has, of 16, 32 or 64 bytes: the same operations, and so the same results,
everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from llvmlite import ir
from numba import types  # noqa: F401  # Numba as a whole first: half of it fails while another thread imports it
from numba.core import cgutils

COUNT = 16

BYTE, SHORT, WORD, FLOAT = ir.IntType(8), ir.IntType(16), ir.IntType(32), ir.FloatType()


class Lanes:
    """A vector in the code that `builder` writes. Plain numbers in an expression stand for all lanes.

    Lanes are float32 or whole numbers with a sign; comparisons give lanes of one bit.
    """

    __slots__ = ("builder", "value")

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    @property
    def _floats(self) -> bool:
        return bool(self.value.type.element == FLOAT)

    def vector(self, other: Any) -> Any:
        """The value in the code of other lanes, or of a number in all lanes of this kind."""
        if isinstance(other, Lanes):
            return other.value
        return ir.Constant(self.value.type, [other] * self.value.type.count)

    def _made(self, name: str, other: Any) -> Lanes:
        prefix = "f" if self._floats and name in ("add", "sub", "mul", "div") else ""
        return Lanes(self.builder, getattr(self.builder, prefix + name)(self.value, self.vector(other)))

    def __add__(self, other: Any) -> Lanes:
        return self._made("add", other)

    def __sub__(self, other: Any) -> Lanes:
        return self._made("sub", other)

    def __mul__(self, other: Any) -> Lanes:
        return self._made("mul", other)

    def __truediv__(self, other: Any) -> Lanes:
        return self._made("div", other)

    def __and__(self, other: Any) -> Lanes:
        return self._made("and_", other)

    def __or__(self, other: Any) -> Lanes:
        return self._made("or_", other)

    def __lshift__(self, other: int) -> Lanes:
        return self._made("shl", other)

    def __rshift__(self, other: int) -> Lanes:
        return self._made("ashr", other)

    def is_(self, sign: str, other: Any) -> Lanes:
        """Where "<", "<=", "==", "!=", ">=" or ">" holds; nowhere for what is not a number."""
        compare = self.builder.fcmp_ordered if self._floats else self.builder.icmp_signed
        return Lanes(self.builder, compare(sign, self.value, self.vector(other)))

    def where(self, condition: Lanes, other: Any = 0) -> Lanes:
        """These where the condition holds, else the other."""
        return Lanes(self.builder, self.builder.select(condition.value, self.value, self.vector(other)))

    def most(self, other: Lanes) -> Lanes:
        """The greater of each two float32, all of which are numbers."""
        kind = self.value.type
        function = cgutils.get_or_insert_function(
            self.builder.module, ir.FunctionType(kind, [kind, kind]), f"llvm.maxnum.v{kind.count}f32"
        )
        called = self.builder.call(function, [self.value, other.value], fastmath=("nnan", "nsz"))
        return Lanes(self.builder, called)

    def size(self) -> Lanes:
        """Float32 without their signs."""
        kind = self.value.type
        function = cgutils.get_or_insert_function(
            self.builder.module, ir.FunctionType(kind, [kind]), f"llvm.fabs.v{kind.count}f32"
        )
        return Lanes(self.builder, self.builder.call(function, [self.value]))

    def within(self, low: Any, high: Any) -> Lanes:
        """Kept within low..high; what is not a number becomes low."""
        above = self.where(self.is_(">", low), low)
        return above.where(above.is_("<", high), high)

    def to_floats(self) -> Lanes:
        """Whole numbers as float32."""
        return Lanes(self.builder, self.builder.sitofp(self.value, ir.VectorType(FLOAT, COUNT)))

    def to_words(self) -> Lanes:
        """Rounded towards 0 where they are float32; 32 bits each."""
        kind = ir.VectorType(WORD, COUNT)
        convert = self.builder.fptosi if self._floats else self.builder.sext
        return Lanes(self.builder, convert(self.value, kind))

    def to_bytes(self) -> Lanes:
        """Float32 of 0..255 as bytes, rounded down."""
        return Lanes(self.builder, self.builder.trunc(self.to_words().value, ir.VectorType(BYTE, COUNT)))

    def widened(self) -> Lanes:
        """Bytes without a sign as numbers of 16 bits."""
        return Lanes(self.builder, self.builder.zext(self.value, ir.VectorType(SHORT, self.value.type.count)))

    def bits(self) -> Any:
        """Lanes of one bit as an unsigned number, the first lane lowest: its value in the code."""
        return self.builder.bitcast(self.value, ir.IntType(self.value.type.count))

    def as_(self, element: Any) -> Lanes:
        """The same bits in lanes of another width."""
        whole = self.value.type.count * self.value.type.element.width
        kind = ir.VectorType(element, whole // element.width)
        return Lanes(self.builder, self.builder.bitcast(self.value, kind))


def filled(builder: Any, number: Any, count: int = COUNT) -> Lanes:
    """A number that the code has at hand, in all lanes."""
    nothing = ir.Constant(ir.VectorType(number.type, count), ir.Undefined)
    one = builder.insert_element(nothing, number, ir.Constant(WORD, 0))
    lanes = ir.Constant(ir.VectorType(WORD, count), [0] * count)
    return Lanes(builder, builder.shuffle_vector(one, nothing, lanes))


def constant(builder: Any, element: Any, numbers: Sequence[float]) -> Lanes:
    """Known numbers."""
    return Lanes(builder, ir.Constant(ir.VectorType(element, len(numbers)), list(numbers)))


def shuffled(one: Lanes, other: Lanes, order: Sequence[int]) -> Lanes:
    """Lanes of two vectors, one after the other, in this order."""
    mask = ir.Constant(ir.VectorType(WORD, len(order)), list(order))
    return Lanes(one.builder, one.builder.shuffle_vector(one.value, other.value, mask))


def loaded(builder: Any, pointer: Any, index: Any, element: Any, count: int = COUNT) -> Lanes:
    """Lanes from an array, beginning at an index; counted in lanes, also where these hold two numbers."""
    address = builder.gep(builder.bitcast(pointer, element.as_pointer()), [index])
    vector = ir.VectorType(element, count).as_pointer()
    return Lanes(builder, builder.load(builder.bitcast(address, vector), align=2 if element != BYTE else 1))


def store(lanes: Lanes, pointer: Any, index: Any) -> None:
    """Store lanes in an array, beginning at an index of its elements."""
    builder, vector = lanes.builder, lanes.value.type
    address = builder.gep(builder.bitcast(pointer, vector.element.as_pointer()), [index])
    builder.store(lanes.value, builder.bitcast(address, vector.as_pointer()), align=1)


def dot(one: Lanes, other: Lanes) -> Lanes:
    """Products of pairs of 16-bit numbers, the pairs added: what processors have one instruction for."""
    builder = one.builder
    first, second = one.as_(SHORT).value, other.as_(SHORT).value
    count = first.type.count
    wide = ir.VectorType(WORD, count)
    products = Lanes(builder, builder.mul(builder.sext(first, wide), builder.sext(second, wide)))
    even, odd = (shuffled(products, products, range(start, count, 2)) for start in (0, 1))
    return even + odd
