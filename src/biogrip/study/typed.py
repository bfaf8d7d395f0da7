"""Conversion between plain values, as in YAML, and the config dataclasses.

Nothing is checked here: jobs read configs that were checked before, and need no pydantic.
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
    """Schema of a config value; which of the optional fields is given tells the kind of value.

    Parameters
    ----------
    key
        Constraints and description.
    scalar
        Type of a single value; `object` for any value.
    block
        Dataclass whose fields are the keys of a block.
    items
        Schema of a list's items.
    names, values
        Schemas of keys and values of a mapping with free keys.
    options
        Alternative schemas.
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
        """Description of the key, or else the first docstring line of its dataclass."""
        doc = self.block.__doc__ if self.block and not self.key.text else None
        return doc.partition("\n")[0] if doc else self.key.text

    @property
    def single(self) -> bool:
        """True if plain and typed value are the same."""
        inner = self.options or ((self.items,) if self.items else ())
        return self.scalar is not None or (bool(inner) and all(shape.single for shape in inner))


@dataclass(frozen=True)
class Entry:
    """A key of a config block, with schema and default.

    Parameters
    ----------
    name
        Name of the field that holds the value.
    shape
        Schema of the value.
    needed
        True if a config must give the key.
    default
        Value if the config does not give the key.
    """

    name: str
    shape: Shape
    needed: bool
    default: Any = None


@cache
def entries(block: Any) -> dict[str, Entry]:
    """Return all fields of a config dataclass by name, including one that is spread."""
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
    """Return the field that collects all keys of a block that no other field names, if any."""
    return next((e for e in entries(block).values() if e.shape.key.spread), None)


@cache
def keys(block: type) -> dict[str, Entry]:
    """Return the named keys of a block, including those of all methods."""
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
    """Return the schema that a field's annotation describes."""
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
    """Return a key with the length of a fixed-length tuple added."""
    items = get_args(hint)
    if get_origin(hint) is not tuple or items[-1] is Ellipsis:
        return key
    return replace(key, fewest=len(items), most=len(items))


def built(kind: type[T], block: Mapping[str, Any]) -> T:
    """Return the object that a checked plain block describes."""
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
    """Return the typed value of a checked plain value."""
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
    """Return the plain value of a typed value, without keys that have their default."""
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
    """Yield the typed values inside a typed value, by key or index."""
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
