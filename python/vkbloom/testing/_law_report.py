"""Which laws a bloom holds, by how much, and why it may break the others: a report, a verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, cast

import numpy as np

from vkbloom._argument_types import check_arguments
from vkbloom._numbers import check_number
from vkbloom._psf.varying import Varying
from vkbloom._public import public
from vkbloom._settings.exposure import Exposure
from vkbloom._views import markup
from vkbloom._views.markup import element
from vkbloom.testing._adaptation import SIZE, Adaptation, Meter, is_meter, meter_of
from vkbloom.testing._deviations import measuring
from vkbloom.testing._laws.law import Law, Limits
from vkbloom.testing._laws.table import ALL_LAWS, find_law, merge_limits
from vkbloom.testing._probe import Bloom, BloomError, NotTaken, Probe
from vkbloom.testing._programs import levels_of
from vkbloom.testing._subject import Subject, fitting_probe

__tracebackhide__ = True

#: Colours of the rows: of a law that was promised and is broken, and of one that was not promised.
COLOURS: Final = {"required": "#c33", "broken": "#b60", "untested": "#888", "held": "inherit"}


# Why a law of the other kind of subject is not tested.
_NOT_OF: Final = {
    Subject: "this is a law of a bloom, and not of an exposure, which takes dt",
    Adaptation: "this is a law of an exposure, which takes dt, and not of a bloom",
}


@dataclass(frozen=True, kw_only=True)
class LawRow:
    """One law of a report.

    Attributes
    ----------
    name : str
        Name of the law.
    held : bool or None
        None: the premise of the law does not hold, such as light that reaches the border. An error
        that the bloom raises is False.
    off : float
        The deviation that is the largest share of its limit; NaN where nothing was measured.
    limit : float
        The allowed deviation there.
    figures : mapping of str to float
        What was measured, by name: the deviations, and figures such as the gain.
    law : str
        The law in words.
    message : str
        What is wrong, or the reason why it could not be tested; empty if the law holds.
    why : str
        Why a bloom that is no fault may break the law.
    applies : bool
        Whether the bloom takes what the law needs, such as a region or alpha.
    """

    name: str
    held: bool | None
    off: float
    limit: float
    figures: Mapping[str, float]
    law: str
    message: str
    why: str
    applies: bool = True

    @property
    def words(self) -> str:
        """The verdict: yes, no or not tested."""
        return {True: "yes", False: "no", None: "not tested"}[self.held]


@public("vkbloom.testing")
@dataclass(frozen=True, eq=False, kw_only=True)
class LawReport:
    """Which laws a bloom or an exposure holds.

    Attributes
    ----------
    rows : tuple
        A row for each law: `name`; `held` (True, False, or None for not tested); `off`, the
        deviation that is the largest share of its limit, and this `limit` (NaN where nothing was
        measured); `figures`, a mapping of names to what was measured; `law` in words; `message`,
        what is wrong or why it could not be tested; `why` a bloom that is no fault may break the
        law; and `applies`, whether the bloom takes what the law needs.
    probe : Probe
        The test images: size, dtype and brightest value.
    gain : float or None
        Of a flat image of that value, in its middle. Where none is promised, the law of the gain is
        tested with it. None: this is an exposure.
    required : tuple of str
        Names of the laws that the bloom promises.
    untaken : tuple of str
        What the bloom does not take, of "region" and "time": `views` is not tested without a
        region; without a time, `history` tests the order of the images alone. Of an exposure,
        "state": it keeps its state itself, and a test begins where the one before has left it.
    """

    rows: tuple[LawRow, ...]
    probe: Probe
    gain: float | None
    required: tuple[str, ...] = ()
    untaken: tuple[str, ...] = ()

    def assert_held(self, *names: str) -> None:
        """Assert that the laws of these names hold; without a name, all that apply to the bloom.

        Parameters
        ----------
        *names : str

        Raises
        ------
        AssertionError
            One does not hold, or could not be tested. The message has those of all of them.
        ValueError
            There is no law of this name.
        """
        known = {row.name: row for row in self.rows}
        try:
            chosen = [find_law(name, known.keys()) for name in names] or [
                name for name, row in known.items() if row.applies
            ]
        except (TypeError, ValueError) as error:
            raise type(error)(f"names: {error}") from None
        broken = [known[name] for name in chosen if not known[name].held]
        if broken:
            raise AssertionError(
                "\n".join(f"{row.name}: {row.message}\n  why: {row.why}" for row in broken)
            )

    def __str__(self) -> str:
        """Return a table, and below it the reasons for broken laws."""
        width, height = self.probe.size
        images = f"on {self.probe.dtype} images of {width} x {height}"
        about = f"Laws of an exposure, {images}"
        if self.gain is not None:
            values = f"with values up to {self.probe.value:g}; gain {self.gain:.4g}"
            about = f"Laws of a bloom, {images} {values}"
        if self.untaken:
            what = "exposure" if self.gain is None else "bloom"
            about += f"; the {what} takes no {' and no '.join(self.untaken)}"
        if self.gain is not None:
            about += "; without dt, the laws of exposures are not tested"
        lines = [
            about,
            f"{'law':<18} {'held':<11} {'off by':>9} {'allowed':>9}",
        ]
        for row in self.rows:
            figures = "".join(f"{cell:>10}" for cell in cells(row))
            mark = " required" if row.name in self.required else ""
            lines.append(f"{row.name:<18} {row.words:<11}{figures}{mark}".rstrip())
        for row in self.rows:
            if not row.held:
                lines += [f"{row.name}: {row.message}", f"  why: {row.why}"]
        return "\n".join(lines)

    def kind(self, row: LawRow) -> str:
        """Return whether a row is held, untested, broken, or broken and required."""
        if row.held:
            return "held"
        if row.name in self.required:
            return "required"
        return "untested" if row.held is None else "broken"

    def _repr_html_(self) -> str:
        """Return the same as a table."""
        rows = []
        for row in self.rows:
            kind = {"class_": self.kind(row), "style": f"color:{COLOURS[self.kind(row)]}"}
            words = element("span", row.words if row.held else element("b", row.words), **kind)
            required = " (required)" * (row.name in self.required)
            why = ("",) if row.held else (row.message, element("br"), element("i", row.why))
            rows.append(
                (
                    element("span", row.name, title=row.law, **kind),
                    markup.join((words, required)),
                    *cells(row),
                    element("span", *why, style="text-align:left"),
                )
            )
        head = ("law", "held", "off by", "allowed", "why it may be broken")
        caption = str(self).splitlines()[0]
        name = {"style": "text-align:left"}
        return str(markup.table(rows, head, caption=caption, name=name, style="color:inherit"))


def cells(row: LawRow) -> tuple[str, str]:
    """Return what a table shows of deviation and limit."""
    return ("", "") if math.isnan(row.off) else (f"{row.off:.3g}", f"{row.limit:.3g}")


@public("vkbloom.testing")
@check_arguments
def report(
    bloom: Bloom | Meter | Exposure | str,
    *,
    size: tuple[int, int] | None = None,
    laws: str | Sequence[str] = "all",
    limits: Mapping[str, Mapping[str, float]] = {},
    gain: float | None = None,
    picture: Bloom | None = None,
    intensity: float | None = None,
    field: Varying | None = None,
    probe: Probe | None = None,
) -> LawReport:
    """Test a bloom, or an exposure, against every law.

    Parameters
    ----------
    bloom : callable, Exposure or str
        A bloom takes an image and returns one of the same height and width: the bloom alone, or the
        picture with its bloom.

        An exposure is one of the package, or its name in `vkbloom.exposures`, which runs on
        `default_renderer`; or a callable with the keywords `dt` and `state`, which is called as
        ``bloom(image, dt=seconds, state=state)``. The image is (H, W, 3) in float32, linear light;
        `dt` is the time since the frame before, and `state` what the call before has returned, or
        None, to begin anew. It returns (stops, next state), where the exposed picture may stand for
        its stops, or `Frames`. A callable without the keyword `state` keeps its state itself, and
        returns the stops or the picture.
    size : (int, int), optional
        Width and height of the test images. A wide bloom needs a large one. Default: 256 x 256; of
        an exposure, 96 x 64.
    laws : "all" or sequence of str
        Names of the laws to test; they are promised: `LawReport.required`.
    limits : mapping of str to mapping of str to float
        Limits of figures by law, such as ``{"stability": {"ripple": 0.05}}``, in place of the law's
        own (docs/check.md lists them), 0 or more. They are allowed beyond the errors of values.
        Infinity leaves a figure out.
    gain : float, optional
        The gain of flat images that the bloom promises. Default: `gain` tests that there is one,
        and `energy` that no light is lost or added.
    picture : callable, optional
        The picture with its bloom, where `bloom` is the bloom alone: `additive` and `alpha` test
        it, and `finite` tests both.
    intensity : float, optional
        The factor by which the bloom is added in `picture`, 0 or more. Default: `additive` tests
        only that no light is removed.
    field : psf.Varying, optional
        The kernels that lights show at their places, where the bloom promises them: the law
        `field`.
    probe : Probe, optional
        Replaces `size`. Default: float32 with values up to 1, or up to 16 where a bloom of 1 is
        black, as after a threshold. For a `command` whose files hold integers, values up to 1/2
        that these files hold, so that nothing is clipped.

    Returns
    -------
    LawReport

    Examples
    --------
    >>> from vkbloom import reference, testing
    >>> def bloom(image):
    ...     return reference.blur(image, vkbloom.DualKawase(levels=2))
    >>> found = testing.report(bloom, size=(64, 64))
    >>> [row.name for row in found.rows if row.held][:3]
    ['superposition', 'gain', 'symmetric']
    >>> def meter(image, *, dt, state):
    ...     goal = -np.log2(max(image.mean(), 1e-4) / 0.18)
    ...     now = goal if state is None else goal + (state - goal) * 2.0**-dt
    ...     return now, now
    >>> [row.name for row in testing.report(meter).rows if not row.held]
    ['finite_state']
    """
    for name, value in (("gain", gain), ("intensity", intensity)):
        if value is not None:
            check_number(name, value, 0.0, math.inf)
    if intensity is not None and picture is None:
        raise ValueError("intensity: it is the factor of the bloom in picture, which is not given")
    names = [] if laws == "all" else [laws] if isinstance(laws, str) else laws
    try:
        required = tuple(dict.fromkeys(find_law(name) for name in names))
    except ValueError as error:
        raise ValueError(f"laws: {error}") from None
    merged = merge_limits(limits, required or ALL_LAWS.keys())
    if is_meter(bloom):
        given = {"gain": gain, "picture": picture, "field": field, "probe": probe}
        for name in (name for name, value in given.items() if value is not None):
            raise ValueError(f"{name}: an exposure has none")
        meter = meter_of(bloom) if isinstance(bloom, Exposure | str) else bloom
        return law_report(Adaptation(meter=meter, size=size or SIZE), merged, required)
    if not callable(bloom):
        raise TypeError(f"bloom: {bloom!r} is not callable")
    bloom, size = cast("Bloom", bloom), size or (256, 256)
    used = probe or fitting_probe(bloom, Probe(size=size, levels=levels_of(bloom, size)))
    subject = Subject(
        bloom=bloom, probe=used, picture=picture, intensity=intensity, gain=gain, field=field
    )
    return law_report(subject, merged, required)


@public("vkbloom.testing")
def assert_laws(
    bloom: Bloom | Meter | Exposure | str,
    *names: str,
    limits: Mapping[str, Mapping[str, float]] = {},
    size: tuple[int, int] | None = None,
    gain: float | None = None,
    picture: Bloom | None = None,
    intensity: float | None = None,
    field: Varying | None = None,
    probe: Probe | None = None,
) -> None:
    """Assert that a bloom, or an exposure, holds laws.

    Parameters
    ----------
    bloom : callable, Exposure or str
        As for `report`.
    *names : str
        Names of laws; without a name, all that apply.
    limits, size, gain, picture, intensity, field, probe
        As for `report`.

    Raises
    ------
    AssertionError
        A law does not hold, or could not be tested. For each, the message has the deviation, its
        position, what is allowed, the law, and why a bloom that is no fault may break it.
    ValueError
        There is no law or figure of a name, or a value is out of range.

    Examples
    --------
    >>> from scipy.ndimage import gaussian_filter
    >>> from vkbloom import testing
    >>> def bloom(image):
    ...     return gaussian_filter(image, (2, 2, 0))
    >>> testing.assert_laws(bloom, "superposition", "symmetric", size=(64, 64))
    >>> testing.assert_laws(
    ...     bloom, "stability", limits={"stability": {"ripple": 0.001}}, size=(64, 64)
    ... )
    """
    try:
        laws = tuple(map(find_law, names))
    except (TypeError, ValueError) as error:
        raise type(error)(f"names: {error}") from None
    found = report(
        bloom,
        size=size,
        laws=laws or "all",
        limits=limits,
        gain=gain,
        picture=picture,
        intensity=intensity,
        field=field,
        probe=probe,
    )
    found.assert_held(*laws)


def law_report(
    subject: Subject | Adaptation,
    limits: Mapping[str, Limits],
    required: tuple[str, ...] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> LawReport:
    """Test a bloom or an exposure against the laws whose limits are given.

    Those that do not apply to it are tested only if they are required.
    """
    try:
        subject.try_once()
    except BloomError as error:
        raise (error.__cause__ or error) from None
    rows = []
    for law in (ALL_LAWS[name] for name in ALL_LAWS if name in limits):
        is_of_subject = isinstance(subject, law.subject)
        if law.name in required or (is_of_subject and law.applies(subject)):
            progress(law.name)
            rows.append(_test(law, subject, limits[law.name]))
    return LawReport(
        rows=tuple(rows),
        probe=subject.probe,
        gain=subject.measured_gain if isinstance(subject, Subject) else None,
        required=required,
        untaken=subject.untaken,
    )


def _explain(law: Law, subject: Subject | Adaptation) -> str:
    """Return why a law is broken, where that can be measured."""
    if law.explain is None or not isinstance(subject, Subject):
        return law.why
    try:
        return law.explain(subject, law.why)
    except Exception:
        return law.why


def _test(law: Law, subject: Subject | Adaptation, limits: Limits) -> LawRow:
    """Test a law."""
    message, why, applies = "", law.why, True
    held: bool | None = True
    # NaN and infinity among the test images are no fault of the caller's arithmetic.
    with measuring() as deviations, np.errstate(all="ignore"):
        try:
            if not isinstance(subject, law.subject):
                raise NotTaken(_NOT_OF[law.subject])
            subject.check_visible()
            law.test(subject, limits)
        except AssertionError as error:
            message, held = str(error), False
            why = _explain(law, subject)
        except (TypeError, ValueError) as error:
            # Of the probe: an error of the bloom is a BloomError.
            message, held, applies = str(error), None, not isinstance(error, NotTaken)
        except Exception as error:
            # A failure of one law does not end the report.
            message, held = str(error), False
    limited = (
        [item for item in deviations if not math.isinf(item.allowed)] if held is not None else []
    )
    worst = max(limited, key=lambda item: item.off / max(item.allowed, 1e-300), default=None)
    figures: dict[str, float] = {}
    for item in deviations:
        figures[item.name] = max(item.off, figures.get(item.name, -math.inf))
    return LawRow(
        name=law.name,
        held=held,
        off=worst.off if worst else math.nan,
        limit=worst.allowed if worst else math.nan,
        figures=MappingProxyType(figures),
        law=worst.law if worst else law.formula,
        message=message,
        why=why,
        applies=applies,
    )
