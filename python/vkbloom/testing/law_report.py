"""Every law at once: which ones a bloom holds, by how much, and why it may break the others."""

from __future__ import annotations

import dataclasses
import html
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from vkbloom.argument_types import checked
from vkbloom.testing import laws, point_spread
from vkbloom.testing.deviations import measuring
from vkbloom.testing.probe import Bloom, Probe

__all__ = ["LAWS", "LawReport", "LawRow", "report"]

# A threshold of 1, the usual one, lets nothing of an image of 1 through.
_BRIGHT: Final = 16.0
# Positions along the diagonal: a period of a chain of four halvings.
_PERIOD: Final = 16

#: Why a bloom that is no fault may break a law, by the law's name.
LAWS: Final = {
    "superposition": "A threshold, a clamp, a firefly filter and a median are not linear. They "
    "break this law on purpose.",
    "gain": "With a threshold, the gain depends on the value. A method that reads black outside "
    "the image loses light at the border.",
    "symmetric": "An even number of taps, a missing half texel and boxes of an odd number of "
    "pixels are not the same from both sides.",
    "transposed": "Blades, streaks and passes of different widths along x and y treat rows and "
    "columns differently.",
    "centroid_kept": "A chain of halved images averages boxes of 2 x 2 pixels. The light of a "
    "pixel moves to the centre of its box, and back on average over all positions.",
    "separable": "A sum of several widths, such as the levels of a pyramid, is not a row times a "
    "column, even where each level is.",
    "no_ringing": "Negative weights ring, as in a sharpening filter. A method that reads black "
    "outside the image darkens the border.",
    "bounded_fireflies": "A linear bloom spreads a share of any brightness. Only a clamp, or an "
    "average weighted by 1 / (1 + luminance), limits it.",
    "additive": "The bloom alone lacks the image. The composite mix takes light from bright "
    "pixels, and screen and a tone curve compress it.",
}


@dataclass(frozen=True, kw_only=True)
class LawRow:
    """One law of a report.

    Attributes
    ----------
    name : str
        Name of the assertion without ``assert_``; "transposed" is `assert_symmetric` for "xy".
    held : bool or None
        None: the premise of the law does not hold, such as light that reaches the border.
    off : float
        The deviation that is the largest share of its limit; NaN where nothing was measured.
    limit : float
        The allowed deviation there.
    law : str
        The law in words.
    message : str
        The assertion's message, or the reason why it could not be tested; empty if the law holds.
    why : str
        Why a bloom that is no fault may break the law.

    See Also
    --------
    LawReport : Has one row for each law.

    Examples
    --------
    >>> from vkbloom import testing
    >>> testing.report(lambda image: image, size=(32, 32)).rows[0].held
    True
    """

    name: str
    held: bool | None
    off: float
    limit: float
    law: str
    message: str
    why: str

    @property
    def words(self) -> str:
        """The verdict: yes, no or not tested."""
        return {True: "yes", False: "no", None: "not tested"}[self.held]


@dataclass(frozen=True, eq=False, kw_only=True)
class LawReport:
    """Which laws a bloom holds.

    Attributes
    ----------
    rows : tuple of LawRow
    probe : Probe
        The test images: size, dtype and brightest value.
    gain : float
        Of a flat image of that value, in its middle; the law of the gain is tested with it.

    See Also
    --------
    report : Returns it.

    Examples
    --------
    >>> from vkbloom import reference, testing
    >>> def bloom(image):
    ...     return reference.blur(image, vkbloom.Separable())
    >>> found = testing.report(bloom, size=(64, 64))
    >>> [row.name for row in found.rows if not row.held]
    ['bounded_fireflies', 'additive']
    >>> found.assert_held("superposition", "gain", "symmetric")
    """

    rows: tuple[LawRow, ...]
    probe: Probe
    gain: float

    def assert_held(self, *names: str) -> None:
        """Assert that the laws of these names hold; without a name, all of them.

        Parameters
        ----------
        *names : str

        Raises
        ------
        AssertionError
            One does not hold, or could not be tested. The message has those of all of them.
        ValueError
            There is no law of this name.

        See Also
        --------
        assert_superposition : One of the assertions.

        Examples
        --------
        >>> from vkbloom import testing
        >>> testing.report(lambda image: image, size=(32, 32)).assert_held("symmetric")
        """
        __tracebackhide__ = True
        known = {row.name: row for row in self.rows}
        if unknown := [name for name in names if name not in known]:
            raise ValueError(f"names: {unknown[0]!r} is not one of {', '.join(known)}")
        broken = [known[name] for name in names or known if not known[name].held]
        if broken:
            raise AssertionError(
                "\n".join(f"{row.name}: {row.message}\n  why: {row.why}" for row in broken)
            )

    def __str__(self) -> str:
        """Return a table, and below it the reasons for broken laws."""
        width, height = self.probe.size
        lines = [
            f"Laws of a bloom, on {self.probe.dtype} images of {width} x {height} with values up "
            f"to {self.probe.value:g}; gain {self.gain:.4g}",
            f"{'law':<18} {'held':<11} {'off by':>9} {'allowed':>9}",
        ]
        for row in self.rows:
            figures = "" if math.isnan(row.off) else f"{row.off:9.3g} {row.limit:9.3g}"
            lines.append(f"{row.name:<18} {row.words:<11} {figures}".rstrip())
        for row in self.rows:
            if not row.held:
                lines += [f"{row.name}: {row.message}", f"  why: {row.why}"]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """Return the same as a table."""
        heads = "".join(
            f'<th scope="col" style="text-align:left">{head}</th>'
            for head in ("law", "held", "off by", "allowed", "why it may be broken")
        )
        body = []
        for row in self.rows:
            figures = ["", ""] if math.isnan(row.off) else [f"{row.off:.3g}", f"{row.limit:.3g}"]
            words = f"<b>{row.words}</b>" if not row.held else row.words
            why = "" if row.held else f"{html.escape(row.message)}<br><i>{html.escape(row.why)}</i>"
            body.append(
                f'<tr><th scope="row" style="text-align:left" title="{html.escape(row.law)}">'
                f"{row.name}</th><td>{words}</td><td>{figures[0]}</td><td>{figures[1]}</td>"
                f'<td style="text-align:left">{why}</td></tr>'
            )
        return (
            f'<table style="color:inherit"><caption>{html.escape(str(self).splitlines()[0])}'
            f"</caption><thead><tr>{heads}</tr></thead><tbody>{''.join(body)}</tbody></table>"
        )


@checked
def report(
    bloom: Bloom, *, size: tuple[int, int] = (256, 256), probe: Probe | None = None
) -> LawReport:
    """Test a bloom against every law.

    Parameters
    ----------
    bloom : callable
        Takes an image and returns one of the same height and width: the bloom alone, or the
        picture with its bloom.
    size : (int, int)
        Width and height of the test images. A wide bloom needs a large one.
    probe : Probe, optional
        Replaces `size`. Default: float32 with values up to 1, or up to 16 where a bloom of 1 is
        black, as after a threshold.

    Returns
    -------
    LawReport

    Raises
    ------
    TypeError, ValueError
        `bloom` is not such a callable.

    See Also
    --------
    stability, resolution_response : Measure a moving light, and several resolutions.

    Examples
    --------
    >>> from vkbloom import reference, testing
    >>> def bloom(image):
    ...     return reference.blur(image, vkbloom.DualKawase(levels=2))
    >>> found = testing.report(bloom, size=(64, 64))
    >>> [row.name for row in found.rows if row.held][:3]
    ['superposition', 'gain', 'symmetric']
    """
    return law_report(bloom, probe or fitting_probe(bloom, Probe(size=size)))


def fitting_probe(bloom: Bloom, probe: Probe) -> Probe:
    """Return the probe with a higher value if a bloom of its own value is black."""
    if probe.dtype.kind == "u" or probe.apply(bloom, probe.noise(0, probe.value))[0].any():
        return probe
    return dataclasses.replace(probe, value=_BRIGHT * probe.value)


def law_report(
    bloom: Bloom,
    probe: Probe,
    *,
    gain: float | None = None,
    additive: Callable[[], None] | None = None,
) -> LawReport:
    """Test a bloom against every law.

    - `gain`: The expected gain. None: what a flat image gets in its middle.
    - `additive`: Replaces the test of that law, where image and bloom are known apart.
    """
    if gain is None:
        flat = probe.apply(bloom, probe.flat(probe.value))[0]
        x, y = probe.centre
        gain = max(0.0, float(flat[y, x].mean()) / probe.value)
    expected = gain
    tests: dict[str, Callable[[], None]] = {
        "superposition": lambda: laws.assert_superposition(bloom, probe),
        "gain": lambda: laws.assert_gain(bloom, expected, probe),
        "symmetric": lambda: laws.assert_symmetric(bloom, probe),
        "transposed": lambda: laws.assert_symmetric(bloom, probe, axes=("xy",)),
        "centroid_kept": lambda: point_spread.assert_centroid_kept(bloom, probe),
        "separable": lambda: point_spread.assert_separable(bloom, probe),
        "no_ringing": lambda: laws.assert_no_ringing(bloom, probe),
        "bounded_fireflies": lambda: laws.assert_bounded_fireflies(bloom, probe=probe),
        "additive": additive or (lambda: laws.assert_additive(bloom, probe=probe)),
    }
    rows = [law_row(name, test, LAWS[name]) for name, test in tests.items()]
    for index, row in enumerate(rows):
        if row.name == "centroid_kept" and row.held is False:
            why = f"{row.why} {_mean_shift(bloom, probe)}"
            rows[index] = dataclasses.replace(row, why=why)
    return LawReport(rows=tuple(rows), probe=probe, gain=gain)


def law_row(name: str, test: Callable[[], None], why: str) -> LawRow:
    """Run the test of a law, and return its row."""
    message, held = "", True
    with measuring() as found:
        try:
            test()
        except AssertionError as error:
            message, held = str(error).removeprefix(f"{_assertion(name)}: "), False
        except (TypeError, ValueError) as error:
            # Not of the bloom itself: report has called it before.
            return LawRow(
                name=name,
                held=None,
                off=math.nan,
                limit=math.nan,
                law="",
                message=str(error),
                why=why,
            )
    worst = max(found, key=lambda one: one.off / max(one.allowed, 1e-300), default=None)
    return LawRow(
        name=name,
        held=held,
        off=worst.off if worst else math.nan,
        limit=worst.allowed if worst else math.nan,
        law=worst.law if worst else "",
        message=message,
        why=why,
    )


def _assertion(name: str) -> str:
    return "assert_symmetric" if name == "transposed" else f"assert_{name}"


def _mean_shift(bloom: Bloom, probe: Probe) -> str:
    """Return a sentence on the shift of the light over a period of positions."""
    x, y = (max(0, place - _PERIOD // 2) for place in probe.centre)
    shifts = []
    for step in range(min(_PERIOD, probe.size[0] - x, probe.size[1] - y)):
        place = (x + step, y + step)
        plane = point_spread.point_spread(bloom, probe, at=place).mean(axis=2)
        if plane.sum() > 0:
            centroid = [
                float((plane.sum(axis=axis) * np.arange(plane.shape[1 - axis])).sum() / plane.sum())
                for axis in (0, 1)
            ]
            shifts.append(np.subtract(centroid, place))
    if not shifts:
        return ""
    mean, least, most = (
        float(reduce(np.array(shifts)[:, 0])) for reduce in (np.mean, np.min, np.max)
    )
    return (
        f"Measured along x over {len(shifts)} positions: {least:+.3g} to {most:+.3g} pixels, "
        f"{mean:+.3g} on average"
        + (
            "; all positions move alike, as with a missing half texel."
            if most - least < abs(mean) / 4
            else "."
        )
    )
