"""What a misspelled name may have meant."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

__all__ = ["Named", "did_you_mean", "lacking", "nearest", "unknown"]

T = TypeVar("T")
E = TypeVar("E")


# A shorter name is part of many others.
_LEAST_PART = 3


def nearest(name: object, known: Iterable[str]) -> str | None:
    """Return the known name that is most like another one; None if none is like it.

    Upper case, "-" and "_" make no difference.
    """
    import difflib  # noqa: PLC0415  rarely needed

    plain = {one.lower().replace("-", "_"): one for one in known}
    asked = str(name).lower().replace("-", "_")
    found = difflib.get_close_matches(asked, plain, n=1)
    if not found and len(asked) >= _LEAST_PART:
        found = [one for one in plain if asked in one or (len(one) >= _LEAST_PART and one in asked)]
    return plain[found[0]] if found else None


def did_you_mean(name: object, known: Iterable[str], form: str = "{!r}") -> str:
    """Return "; did you mean 'x'?" with the nearest known name; "" if none is near."""
    near = nearest(name, known)
    return f"; did you mean {form.format(near)}?" if near is not None else ""


def lacking(
    owner: str, names: Sequence[str], own: Iterable[str], others: Mapping[str, Iterable[str]]
) -> str:
    """Return a text that something lacks fields: what was meant, or what has them.

    - `own`: The fields that it has.
    - `others`: The fields of others by their names.
    """
    own = list(own)
    text = f"{owner} has no {', '.join(map(repr, names))}"
    if near := did_you_mean(names[0], own):
        return text + near
    having = [other for other, fields in others.items() if set(names) <= set(fields)]
    if having:
        return f"{text}, which {', '.join(having)} {'has' if len(having) == 1 else 'have'}"
    return f"{text}; it has {', '.join(own)}"


def unknown(what: str, name: object, known: Iterable[str]) -> str:
    """Return a text that a name is unknown: which one may be meant, and which there are."""
    known = list(known)
    near = did_you_mean(name, known) or ";"
    return f"{what} {name!r}{near} available: {', '.join(known) or 'none'}"


class Named(Mapping[str, T]):
    """Objects by their published names; the error for an unknown name suggests one.

    - `kind`: What the objects are.
    - `entries`: What each object is made of, when it is first asked for.
    """

    def __init__(self, kind: str, entries: Mapping[str, E], make: Callable[[E], T]) -> None:
        self._kind = kind
        self._entries: dict[str, Any] = {**entries}
        self._make: Callable[[Any], T] = make
        self._made: dict[str, T] = {}

    def __getitem__(self, name: str) -> T:
        if name not in self._entries:
            raise KeyError(unknown(f"unknown {self._kind}", name, self))
        if name not in self._made:
            self._made.setdefault(name, self._make(self._entries[name]))
        return self._made[name]

    def __contains__(self, name: object) -> bool:
        return name in self._entries

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def __repr__(self) -> str:
        return repr(dict(self))
