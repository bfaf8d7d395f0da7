"""Between plain values, as files hold them, and the classes whose fields are the config's keys.

Nothing is checked here: jobs read what has been checked, and pay for no more than that.
"""

import types
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from functools import cache
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin, get_type_hints

from biogrip.keys import Key

T = TypeVar("T")


@dataclass(frozen=True)
class Shape:
    """What a value may look like; of the fields below, the one that is given decides.

    Parameters
    ----------
    key
        What else is said of it.
    scalar
        Type of a single value; `object` if it may be anything.
    block
        Class whose fields are the keys of a block.
    items
        Of a list.
    names, values
        Of a block whose keys are the user's.
    options
        Shapes of which it has one.
    """

    key: Key
    scalar: type | None = None
    block: type | None = None
    items: "Shape | None" = None
    names: "Shape | None" = None
    values: "Shape | None" = None
    options: "tuple[Shape, ...]" = ()

    @property
    def text(self) -> str:
        """What it means: what its key says, else its class."""
        doc = self.block.__doc__ if self.block and not self.key.text else None
        return doc.partition("\n")[0] if doc else self.key.text

    @property
    def single(self) -> bool:
        """Whether it is the same plain and typed."""
        inner = self.options or ((self.items,) if self.items else ())
        return self.scalar is not None or (bool(inner) and all(shape.single for shape in inner))


@dataclass(frozen=True)
class Entry:
    """A key of a block.

    Parameters
    ----------
    name
        Of the field that holds it.
    shape
        What its value may look like.
    needed
        Whether a config must give it.
    default
        What it is otherwise.
    """

    name: str
    shape: Shape
    needed: bool
    default: Any = None


@cache
def entries(block: Any) -> dict[str, Entry]:
    """Return the fields of a block's class by name, one that is spread among them."""
    hints = get_type_hints(block, include_extras=True)
    found = {}
    for field in fields(block):
        shape = shape_of(hints[field.name])
        default = field.default if field.default_factory is MISSING else field.default_factory()
        needed = default is MISSING or shape.key.needed
        found[field.name] = Entry(field.name, shape, needed, default)
    return found


@cache
def spread(block: Any) -> Entry | None:
    """Return the field of a block that holds the keys which no other is named like, if any."""
    return next((e for e in entries(block).values() if e.shape.key.spread), None)


@cache
def keys(block: type) -> dict[str, Entry]:
    """Return the keys of a block that have names, those of all methods among them."""
    found = {}
    for name, entry in entries(block).items():
        if not entry.shape.key.spread:
            found[name] = entry
        elif several := getattr(entry.shape.block, "classes", None):
            for inner, kind in several().items():
                needed = any(entry.needed for entry in keys(kind).values())
                found[inner] = Entry(inner, Shape(Key(), block=kind), needed)
    return found


@cache
def shape_of(hint: Any) -> Shape:
    """Read what the annotation of a field says."""
    if get_origin(hint) is Annotated:
        inner, *said = get_args(hint)
        key = next((item for item in said if isinstance(item, Key)), Key())
        return replace(shape_of(inner), key=_counted(key, inner))
    arguments = [a for a in get_args(hint) if a is not type(None)]
    origin = get_origin(hint)
    if origin in (Union, types.UnionType):
        options = tuple(shape_of(argument) for argument in arguments)
        return options[0] if len(options) == 1 else Shape(Key(), options=options)
    if origin is tuple:
        return Shape(_counted(Key(), hint), items=shape_of(arguments[0]))
    if origin is Mapping:
        return Shape(Key(), names=shape_of(arguments[0]), values=shape_of(arguments[1]))
    if isinstance(hint, type) and is_dataclass(hint):
        return Shape(Key(), block=hint)
    return Shape(Key(), scalar=object if hint is Any else hint)


def _counted(key: Key, hint: Any) -> Key:
    """Add how many items a tuple of fixed length has."""
    items = get_args(hint)
    if get_origin(hint) is not tuple or items[-1] is Ellipsis:
        return key
    return replace(key, fewest=len(items), most=len(items))


def built(kind: type[T], block: Mapping[str, Any]) -> T:
    """Make the object that a checked plain block says."""
    known: Any = kind
    given: dict[str, Any] = {}
    rest = spread(known)
    others: dict[str, Any] = {}
    for name, value in block.items():
        entry = entries(known).get(name)
        if entry is None or entry is rest:
            others[name] = value
        else:
            given[name] = typed(entry.shape, value)
    if rest:
        own = rest.shape.block
        given[rest.name] = own(others) if own else typed(rest.shape, others)
    elif others:
        raise LookupError(f"{kind.__name__} has no {', '.join(others)}")
    return kind(**given)


def typed(shape: Shape, value: Any) -> Any:
    """Make what a checked plain value says."""
    if isinstance(value, dict):
        if shape.options:
            shape = next(o for o in shape.options if o.block or o.values)
        if shape.block:
            return built(shape.block, value)
        inner = shape.values
        return {n: typed(inner, v) for n, v in value.items()} if inner else dict(value)
    if isinstance(value, list):
        items = next((o.items for o in (shape, *shape.options) if o.items), None)
        if items is None or items.single:
            return tuple(value)
        return tuple(typed(items, item) for item in value)
    return value


def plain(value: Any) -> Any:
    """Return what a file holds of a typed value; what is as by default is left out."""
    if is_dataclass(value) and not isinstance(value, type):
        block: dict[str, Any] = {}
        for name, entry in entries(type(value)).items():
            inner = getattr(value, name)
            if entry.shape.key.spread:
                block |= plain(getattr(inner, "plain", inner))
            elif entry.needed or inner != entry.default:
                block[name] = plain(inner)
        return block
    if isinstance(value, Mapping):
        return {name: plain(inner) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def parts(value: Any) -> Iterator[tuple[str | int, Any]]:
    """Typed values in a typed value, by key or index."""
    if hasattr(value, "classes"):
        yield from ((name, value.block(name)) for name in value.classes())
    elif is_dataclass(value):
        for name, entry in entries(value.__class__).items():
            inner = getattr(value, name)
            yield from parts(inner) if entry.shape.key.spread else [(name, inner)]
    elif isinstance(value, Mapping):
        yield from value.items()
    elif isinstance(value, tuple):
        yield from enumerate(value)
