"""Messages about unknown names, and what a misspelled one may have meant."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

# The least similarity of a name that may be meant, and the least length of a word of a name.
_MIN_RATIO: Final = 0.7
_MIN_LETTERS: Final = 3


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


def describe_missing_fields(
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


def describe_unknown(what: str, name: object, known: Iterable[str]) -> str:
    """Return a text that a name is unknown: which one may be meant, and which there are."""
    known = list(known)
    near = did_you_mean(name, known) or ";"
    return f"{what} {name!r}{near} available: {', '.join(known) or 'none'}"
