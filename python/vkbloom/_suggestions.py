"""What a misspelled name may have meant."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

T = TypeVar("T")


# The least similarity of a name that may be meant, and the least length of a word of a name.
_MIN_RATIO = 0.7
_MIN_LETTERS = 3


def nearest(name: object, known: Iterable[str]) -> str | None:
    """Return the known name that is most like another one; None if none is like it.

    A name is like another one if few letters differ, or if one is a complete word of the other.
    Upper case, "-" and "_" make no difference.
    """
    import difflib  # noqa: PLC0415  costs start-up time

    plain = {word.lower().replace("-", "_").strip("_"): word for word in known}
    asked = str(name).lower().replace("-", "_").strip("_")
    near = difflib.get_close_matches(asked, plain, 1, _MIN_RATIO)
    if not near and len(asked) >= _MIN_LETTERS:
        near = [word for word in plain if asked in word.split("_") or word in asked.split("_")]
    return plain[near[0]] if near else None


def did_you_mean(name: object, known: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" with the nearest known name; "" if none is near."""
    near = nearest(name, known)
    return f"; did you mean {near!r}?" if near is not None else ""


def lacking(
    owner: str, names: Sequence[str], known: Iterable[str], others: Mapping[str, Iterable[str]]
) -> str:
    """Return a text that something lacks fields: what was meant, or what has them."""
    known = list(known)
    text = f"{owner} has no {', '.join(map(repr, names))}"
    if near := did_you_mean(names[0], known):
        return text + near
    having = [other for other, fields in others.items() if set(names) <= set(fields)]
    if having:
        return f"{text}, which {', '.join(having)} {'has' if len(having) == 1 else 'have'}"
    return f"{text}; it has {', '.join(known)}"


def unknown(what: str, name: object, known: Iterable[str]) -> str:
    """Return a text that a name is unknown: which one may be meant, and which there are."""
    known = list(known)
    near = did_you_mean(name, known) or ";"
    return f"{what} {name!r}{near} available: {', '.join(known) or 'none'}"


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
            raise KeyError(unknown(f"unknown {self._kind}", name, entries))
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
        from html import escape  # noqa: PLC0415  costs start-up time

        # As in the tables of `markup`: some notebooks have no padding of their own.
        cell = ' style="padding:2px 8px;text-align:left"'
        rows = "".join(
            f"<tr>{''.join(f'<td{cell}>{escape(text)}</td>' for text in row)}</tr>"
            for row in self._rows()
        )
        heads = "".join(f"<th{cell}>{escape(text)}</th>" for text in (self._kind, "what", "whose"))
        return f"<table><tr>{heads}</tr>{rows}</table>"
