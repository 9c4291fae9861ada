"""Two measured blooms beside each other: what got better, and what worse."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from vkbloom._cli.check.showing import FIGURES, figure_of, times, words

Verdict = Literal["broken", "mended", "worse", "better", "changed", "same"]

# What counts as a change: of a deviation, in shares of its limit, and of a figure, as a share of
# itself and at least so much; of a time, as a share, where all runs of one are longer than all of
# the other.
_LAW: Final = (0.1, 0.25)
_FIGURE: Final = (0.02, 1e-3)
_TIME: Final = 0.2


@dataclass(frozen=True)
class Change:
    """A law, a figure or a time of two blooms.

    - `before`, `after`: Of a law its deviation as a share of the limit; times are in seconds. None:
      not measured.
    - `words`: Both in words, before and after.
    """

    kind: Literal["law", "figure", "time"]
    name: str
    before: float | None
    after: float | None
    words: tuple[str, str]
    verdict: Verdict


def changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> tuple[Change, ...]:
    """Compare the values that `vkbloom check --json` prints of two blooms."""
    return (*_laws(before, after), *_figures(before, after), *_times(before, after))


def find_newly_broken(changes: Sequence[Change], required: Sequence[str]) -> list[str]:
    """Return the required laws that the second bloom breaks and the first did not."""
    broken = [each.name for each in changes if each.verdict == "broken"]
    return [name for name in broken if name in required]


def _laws(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Change]:
    untested: Mapping[str, Any] = {"held": None, "off": None, "limit": None}
    for name, new in after["laws"].items():  # a law that does not apply to both tells nothing
        old = before["laws"].get(name, untested)
        was, now = _share(old), _share(new)
        verdict = _verdict(was, now, *_LAW, less=True)
        if old["held"] != new["held"]:
            # A law that is not tested of one of them is neither broken nor mended by the other.
            verdict = "broken" if new["held"] is False else "changed"
            if old["held"] is False and new["held"]:
                verdict = "mended"
        yield Change(
            "law", name, was, now, (_describe_verdict(old), _describe_verdict(new)), verdict
        )


def _share(law: Mapping[str, Any]) -> float | None:
    off, limit = law["off"], law["limit"]
    return None if off is None or limit is None else off / max(limit, 1e-300)


def _describe_verdict(law: Mapping[str, Any]) -> str:
    words = {True: "yes", False: "**no**", None: "not tested"}[law["held"]]
    return words if law["held"] is not False or law["off"] is None else f"{words}, {law['off']:.3g}"


def _figures(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Change]:
    if "energy" not in after:  # of an exposure
        return
    for name, (keys, less) in FIGURES.items():
        old, new = (figure_of(side, keys) for side in (before, after))
        verdict = _verdict(old, new, *_FIGURE, less=less)
        yield Change("figure", name, old, new, (words(old), words(new)), verdict)


def _times(before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Change]:
    sides = [times(side) for side in (before, after)]
    for name in dict.fromkeys([*sides[1], *sides[0]]):
        old, new = (side.get(name) for side in sides)
        told = ["none" if each is None else f"{1e3 * each:.3f} ms" for each in (old, new)]
        verdict: Verdict = "same"
        if name == "together" and _are_apart(before["together"], after["together"]):
            verdict = _verdict(old, new, _TIME, 0.0, less=True)
        yield Change("time", name, old, new, (told[0], told[1]), verdict)


def _are_apart(before: Mapping[str, Any], after: Mapping[str, Any]) -> bool:
    """Return whether all runs of one took longer than all of the other."""
    sides = sorted([before, after], key=lambda side: float(side["shortest"]))
    return bool(sides[0]["longest"] < sides[1]["shortest"])


def _verdict(
    old: float | None, new: float | None, share: float, least: float, *, less: bool
) -> Verdict:
    """Return whether a number changed by more than a share of itself, and more than `least`."""
    if old is None or new is None:
        return "same" if old == new else "changed"
    if abs(new - old) <= max(share * abs(old), least):
        return "same"
    if not less:
        return "changed"
    return "worse" if new > old else "better"


def summary(changes: Sequence[Change]) -> str:
    """Return which laws, figures and times got better and worse, as a sentence for each verdict."""
    reasons = []
    for verdict in ("broken", "mended", "worse", "better"):
        names = [
            f"time ({_ratio(each)})" if each.name == "together" else each.name
            for each in changes
            if each.verdict == verdict
        ]
        if names:
            reasons.append(f"{verdict}: {', '.join(names)}")
    return "; ".join(reasons) or "nothing got better or worse"


def _ratio(time: Change) -> str:
    return f"{time.after / time.before:.2f} times" if time.before and time.after else "new"


def as_text(changes: Sequence[Change], names: tuple[str, str]) -> str:
    """Return a table for a terminal: before, after, and what became of it."""
    lines = [f"{names[1]}, against {names[0]}: {summary(changes)}", ""]
    for kind in dict.fromkeys(each.kind for each in changes):
        lines.append(f"{kind:<24} {'against':>22} {'now':>22}")
        for each in changes:
            if each.kind == kind:
                old, new = (words.replace("*", "") for words in each.words)
                verdict = "" if each.verdict == "same" else each.verdict
                lines.append(f"{each.name:<24} {old:>22} {new:>22}  {verdict}".rstrip())
        lines.append("")
    return "\n".join(lines[:-1])


def as_markdown(changes: Sequence[Change], names: tuple[str, str], device: str) -> str:
    """Return the comparison for a pull request: what changed, then everything, folded."""
    old, new = (name.replace("|", "\\|").replace("`", "'") for name in names)
    head = f"| | `{old}` | `{new}` | |\n|---|---|---|---|"

    def rows(changes: Sequence[Change]) -> str:
        marks = {"same": "", "broken": "**broken**"}
        cells = [
            (each.name, *each.words, marks.get(each.verdict, each.verdict)) for each in changes
        ]
        return "\n".join(f"| {' | '.join(row)} |" for row in cells)

    changed = rows([each for each in changes if each.verdict != "same"])
    return (
        f"### `{new}` against `{old}`\n\n{summary(changes).capitalize()}. On {device}.\n\n"
        + (f"{head}\n{changed}\n\n" if changed else "")
        + f"<details><summary>All laws, figures and times</summary>\n\n{head}\n{rows(changes)}\n\n"
        "</details>\n"
    )


def as_values(
    changes: Sequence[Change],
    before: Mapping[str, Any],
    after: Mapping[str, Any],
    failed: Sequence[str],
) -> dict[str, Any]:
    """Return plain values: both blooms, and the changes from the first to the second."""
    return {
        "bloom": after,
        "against": before,
        "changes": [
            {key: getattr(each, key) for key in ("kind", "name", "before", "after", "verdict")}
            for each in changes
        ],
        "summary": summary(changes),
        "newly_broken": list(failed),
        "passed": not failed,
    }
