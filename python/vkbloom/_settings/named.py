"""Objects by their published names: presets, glares, classes of methods."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple, TypeVar

from vkbloom._spelling import describe_unknown

T = TypeVar("T")


class NamedEntry(NamedTuple):
    """How the object of a name is made, what it is, and whose."""

    make: Callable[[], Any]
    what: str
    whose: str


class Named(Mapping[str, T]):
    """Objects by their published names, as keys or attributes.

    The error for an unknown name suggests one.

    - `kind`: What the objects are.
    - `make`: Makes an object of its entry, when it is first asked for. The entry's `what` and
      `whose` say what it looks like, and its source.
    """

    def __init__(self, kind: str, make: Callable[[Any], T]) -> None:
        self._kind = kind
        self._source: Callable[[], Mapping[str, Any]] = dict
        self._filled: Mapping[str, Any] | None = None
        self._make = make
        self._made: dict[str, T] = {}

    def fill(self, entries: Callable[[], Mapping[str, Any]]) -> None:
        """Set the function that returns the entries; it is called at the first use."""
        self._source, self._filled = entries, None

    @property
    def _entries(self) -> Mapping[str, Any]:
        """All entries. The mapping does not change, so that threads can read it at any time."""
        filled = self._filled
        if filled is None:
            # Assigned when it is complete: another thread may be here, too, and gets the same.
            filled = self._filled = self._source()
        return filled

    def __getitem__(self, name: str) -> T:
        entries = self._entries
        if name not in entries:
            raise KeyError(describe_unknown(f"unknown {self._kind}", name, entries))
        return self._object(name, entries[name])

    def _object(self, name: str, entry: Any) -> T:
        """Return the object of an entry: in all threads the same one."""
        if name not in self._made:
            self._made.setdefault(name, self._make(entry))
        return self._made[name]

    def __contains__(self, name: object) -> bool:
        return name in self._entries

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def __getattr__(self, name: str) -> T:
        # copy and pickle ask for methods before there are entries.
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(error.args[0], name=name, obj=self) from None

    def __dir__(self) -> Iterable[str]:
        return [*super().__dir__(), *self]

    def _rows(self) -> list[tuple[str, ...]]:
        """Return the name of each entry, what it is, and whose."""
        return [(name, entry.what, entry.whose) for name, entry in self._entries.items()]

    def __repr__(self) -> str:
        width = max(map(len, self), default=0)
        return "\n".join(f"{name:<{width}}  {what}" for name, what, *_ in self._rows())

    def _repr_html_(self) -> str:
        from vkbloom._views.markup import table  # noqa: PLC0415  costs start-up time

        left = {"style": "text-align:left"}
        return str(table(self._rows(), (self._kind, "what", "whose"), name=left, cell=left))


def check_named(name: str, given: object, kind: type[T], entries: Named[T]) -> T:
    """Return an object of a class, or that of a preset; raise TypeError or ValueError for others.

    `name`: that of the argument.
    """
    if isinstance(given, kind):
        return given
    if isinstance(given, str):
        if given not in entries:
            raise ValueError(describe_unknown(f"{name}: unknown preset", given, entries))
        return entries[given]
    hint = ""
    if isinstance(given, type) and issubclass(given, kind):
        hint = f"; give {given.__name__}()"
    raise TypeError(f"{name}: {given!r} is not an {kind.__name__} or the name of one{hint}")
