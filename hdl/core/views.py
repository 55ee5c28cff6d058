"""Copies of views, and choices between views. Two shapes that differ in a field or a format are refused."""

from collections.abc import Iterable

from amaranth.hdl import Mux, Shape, ShapeCastable, ShapeLike, Value, ValueLike
from amaranth.lib import data

from blysk.hdl.core.fixed import FixedShape

__all__ = ["choose", "copy", "copy_fields", "of_shape", "require_same_shape"]


def require_same_shape(a: ShapeLike, b: ShapeLike, path: str = "payload") -> None:
    """Refuse two shapes that differ in a field, a width, a sign or a fixed-point format.

    Amaranth assigns views by width alone, and would accept a moved binary point.

    Parameters
    ----------
    a, b : ShapeLike
        Shapes.
    path : str
        Name of the value that has the shapes, for the message.

    Raises
    ------
    TypeError
        If the shapes differ. The message names the field.
    """
    if isinstance(a, data.StructLayout) and isinstance(b, data.StructLayout):
        if list(a.members) != list(b.members):
            raise TypeError(
                f"{path} has fields {list(a.members)} on one side, {list(b.members)} on the other"
            )
        for name, shape in a.members.items():
            require_same_shape(shape, b.members[name], f"{path}.{name}")
    elif isinstance(a, data.ArrayLayout) and isinstance(b, data.ArrayLayout):
        if a.length != b.length:
            raise TypeError(f"{path} has {a.length} elements on one side, {b.length} on the other")
        require_same_shape(a.elem_shape, b.elem_shape, f"{path}[]")
    else:
        custom = (FixedShape, data.Layout)
        same = a == b if isinstance(a, custom) or isinstance(b, custom) else Shape.cast(a) == Shape.cast(b)
        if not same:
            raise TypeError(f"{path} is {a!r} on one side, {b!r} on the other")


def copy(target, source, path: str = "view"):
    """Assignment of all bits of a view, a fixed-point value or a plain value to another of the same shape.

    Parameters
    ----------
    target, source : ValueLike
        Target and source of the copy.
    path : str
        Name of the copied value, for the message.

    Returns
    -------
    Assign
        The assignment.

    Raises
    ------
    TypeError
        If the shapes differ in a field, a width, a sign or a fixed-point format.
    """
    require_same_shape(source.shape(), target.shape(), path)
    return Value.cast(target).eq(Value.cast(source))


def copy_fields(target, source, names: Iterable[str] | None = None) -> list:
    """Assignments of fields to fields of the same name and shape.

    Parameters
    ----------
    target, source : View or mapping of str to ValueLike
        Target and source of the copy. Both have the fields.
    names : iterable of str, optional
        Names of the fields. By default all fields of the target.

    Returns
    -------
    list of Assign
        One assignment for each field.

    Raises
    ------
    TypeError
        If the shapes of a field differ. The message names the field.
    """
    if names is None:
        names = target.shape().members if isinstance(target, data.View) else target
    return [copy(target[name], source[name], name) for name in names]


def choose(condition: ValueLike, a, b):
    """The view ``a`` if the condition holds, else ``b``: a `Mux` of two values with one shape.

    Parameters
    ----------
    condition : ValueLike
        Condition.
    a, b : ValueLike
        Views, fixed-point values or plain values.

    Returns
    -------
    ValueLike
        Value of the shape that both have.

    Raises
    ------
    TypeError
        If the shapes differ in a field, a width, a sign or a fixed-point format.
    """
    require_same_shape(a.shape(), b.shape(), "choice")
    return of_shape(a, Mux(condition, Value.cast(a), Value.cast(b)))


def of_shape(like, bits: Value):
    """A view made again from its bits, which passed through a memory or a `Mux`.

    Parameters
    ----------
    like : ValueLike
        View, fixed-point value or plain value.
    bits : Value
        Bits of the view, or of a value of the same shape.

    Returns
    -------
    ValueLike
        The bits in the shape of ``like``. For a plain shape they are unchanged.
    """
    shape = like.shape()
    return shape(bits) if isinstance(shape, ShapeCastable) else bits
