"""The fixture `frame_regression`: framebuffers held against references that were looked at."""

from __future__ import annotations

import hashlib
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vkbloom.frames import Frames
from vkbloom.testing import report_parts
from vkbloom.testing.judging import Verdict, first_failure, judge
from vkbloom.testing.records import Record
from vkbloom.testing.references import Origin, Reference, ReferenceFolder, check_name, cpu_vendor
from vkbloom.version import installed_version
from vkbloom.views.tolerances import Tolerances

__all__ = ["FrameDifferenceWarning", "FrameRegression", "Mode", "name_of_test"]


class FrameDifferenceWarning(UserWarning):
    """An image passed, but differs by more than ``warn``.

    See Also
    --------
    Tolerances : Has the limit `warn`.

    Examples
    --------
    Make such a warning an error of the test:

    >>> import warnings
    >>> from vkbloom import testing
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", testing.FrameDifferenceWarning)
    """


@dataclass(frozen=True, kw_only=True)
class Mode:
    """What the command line asked for.

    Parameters
    ----------
    update : bool
        Write the references of checks that fail, in place of those that are there.
    add : bool
        Write them beside those that are there.
    allow_missing : bool
        Let a check pass that has no reference.
    expect_adapter : str or None
        A part of the name or of the driver of the adapter that frames must come from.
    parts : Path or None
        Folder for what the report shows of failed checks; None: no report.
    """

    update: bool = False
    add: bool = False
    allow_missing: bool = False
    expect_adapter: str | None = None
    parts: Path | None = None


@dataclass(frozen=True, eq=False)
class _Given:
    """What a test gave to a check."""

    name: str
    images: Mapping[str, NDArray[Any]]
    origin: Origin
    tolerances: Tolerances


class FrameRegression:
    """Compares frames with references; what the fixture `frame_regression` gives a test.

    Parameters
    ----------
    folder : Path
        Of the references of the test's module.
    test : str
        The test's id, for messages.
    name : str
        Of the reference where a check gives none.
    mode : Mode
    records : list of dict
        Where each check leaves what it found.

    See Also
    --------
    pytest_vkbloom.frame_regression : The fixture that gives it.
    Tolerances : The limits of a comparison.

    Examples
    --------
    A test in a module ``test_blur.py``, whose references are made by ``pytest --bloom-update``:

    >>> def test_blur(bloom_renderer, frame_regression):
    ...     image = np.full((16, 16, 4), 0.5, np.float32)
    ...     frames = bloom_renderer.apply(image, vkbloom.Pyramid(levels=2))
    ...     frame_regression.check(frames, atol=1e-3)
    """

    def __init__(
        self, *, folder: Path, test: str, name: str, mode: Mode, records: list[Record]
    ) -> None:
        self._folder = ReferenceFolder(folder)
        self._test = test
        self._name = name
        self._mode = mode
        self._records = records
        self._has_used_name = False

    def check(
        self,
        frames: Frames | Mapping[str, NDArray[Any]] | NDArray[Any],
        name: str | None = None,
        *,
        atol: float | None = None,
        rtol: float | None = None,
        fail_percent: float = 0.0,
        hard_fail: float | None = None,
        ssim: float | None = None,
        flip: float | None = None,
        warn: float | None = None,
        allow_nan: bool = False,
        info: Mapping[str, str] | None = None,
    ) -> None:
        """Compare frames with their reference, and fail where they differ.

        The checks of each framebuffer, in this order: shape and dtype, finiteness, equality (which
        ends them), tolerances, SSIM, FLIP. All framebuffers are compared, so that the first one in
        the order that the data flows can be named. Where there are several references, one that
        fits is enough.

        Parameters
        ----------
        frames : Frames, mapping of str to ndarray, or ndarray
            What a renderer gave; framebuffers of another one by name, in the order that the data
            flows; or one image. Arrays of shape (H, W) or (H, W, C) with up to 4 channels, uint8,
            uint16, float16 or float32, top row first.
        name : str, optional
            Of the reference, within the test's module; by default the test's.
        atol, rtol, fail_percent, hard_fail, warn
            See `vkbloom.testing.Tolerances`; integers count as 0 to 1. A value that differs by
            more than `warn` and passes is a `FrameDifferenceWarning`.
        ssim, flip : float, optional
            Smallest SSIM (scikit-image's) and largest mean FLIP (OpenImageIO's), on top of the
            tolerances. ``atol=math.inf`` leaves these alone to decide.
        allow_nan : bool, default False
            Let NaN and infinity pass where the reference has the same.
        info : mapping of str to str, optional
            "adapter" and "driver" that made the images, recorded with a new reference; of `Frames`
            their own.

        Raises
        ------
        AssertionError
            The frames differ, or there is no reference; says what, where, and how to go on.
        TypeError, ValueError
            An argument is wrong, or a reference's file is damaged.
        OSError
            A file cannot be read or written.
        """
        __tracebackhide__ = True
        tolerances = Tolerances(
            atol=atol,
            rtol=rtol,
            fail_percent=fail_percent,
            hard_fail=hard_fail,
            ssim=ssim,
            flip=flip,
            warn=warn,
            allow_nan=allow_nan,
        )
        given = _Given(
            self._chosen_name(name), _images("frames", frames), _origin(frames, info), tolerances
        )
        self._check_adapter(given.origin)
        references = self._folder.load(given.name)
        if not references:
            self._without_reference(given)
            return
        reference, verdicts = _closest(references, given)
        if first_failure(verdicts) and (self._mode.update or self._mode.add):
            self._write(given)
            return
        self._conclude(given, reference, verdicts, len(references))

    def compare(
        self,
        actual: Frames | Mapping[str, NDArray[Any]] | NDArray[Any],
        expected: Frames | Mapping[str, NDArray[Any]] | NDArray[Any],
        name: str | None = None,
        *,
        atol: float | None = None,
        rtol: float | None = None,
        fail_percent: float = 0.0,
        hard_fail: float | None = None,
        ssim: float | None = None,
        flip: float | None = None,
        warn: float | None = None,
        allow_nan: bool = False,
    ) -> None:
        """Compare frames with others that the test has made, and report as `check` does.

        Parameters
        ----------
        actual, expected : Frames, mapping of str to ndarray, or ndarray
            As for `check`; `expected` stands in for the reference, of which there are no files.
        name : str, optional
            For messages and the report.
        atol, rtol, fail_percent, hard_fail, ssim, flip, warn, allow_nan
            As for `check`.

        Raises
        ------
        AssertionError
            The frames differ.
        TypeError, ValueError
            An argument is wrong.
        """
        __tracebackhide__ = True
        tolerances = Tolerances(
            atol=atol,
            rtol=rtol,
            fail_percent=fail_percent,
            hard_fail=hard_fail,
            ssim=ssim,
            flip=flip,
            warn=warn,
            allow_nan=allow_nan,
        )
        if name is not None:
            check_name(name)
        given = _Given(
            name or self._name, _images("actual", actual), _origin(actual, None), tolerances
        )
        reference = Reference(images=_images("expected", expected), origin=_origin(expected, None))
        self._conclude(given, reference, judge(reference.images, given.images, tolerances), None)

    def _chosen_name(self, name: str | None) -> str:
        if name is not None:
            check_name(name)
            return name
        if self._has_used_name:
            raise ValueError("name: a second check in one test needs a name of its own")
        self._has_used_name = True
        return self._name

    def _check_adapter(self, origin: Origin) -> None:
        wanted = self._mode.expect_adapter
        if wanted is None or origin.adapter is None:
            return
        if wanted.lower() not in f"{origin.adapter} {origin.driver or ''}".lower():
            raise ValueError(
                f"--bloom-expect-adapter={wanted}: these frames come from {origin.summary}"
            )

    def _without_reference(self, given: _Given) -> None:
        __tracebackhide__ = True
        if self._mode.update or self._mode.add:
            self._write(given)
            return
        record = self._record(given, "missing", None)
        if not self._mode.allow_missing:
            record["message"] = message = (
                f"{given.name}: there is no reference {self._folder.file(given.name)}. Make it "
                "with --bloom-update, look at it, and keep it with the tests"
            )
            raise AssertionError(message)

    def _write(self, given: _Given) -> None:
        for framebuffer, image in given.images.items():
            if not given.tolerances.allow_nan and not np.isfinite(image).all():
                raise ValueError(
                    f"{given.name}: {framebuffer} has NaN or infinity; allow_nan=True lets that be "
                    "a reference"
                )
        self._folder.write(given.name, given.images, given.origin, add=self._mode.add)
        self._record(given, "written", None)

    def _conclude(
        self,
        given: _Given,
        reference: Reference,
        verdicts: tuple[Verdict, ...],
        count: int | None,
    ) -> None:
        """Record what was found; raise AssertionError if something failed.

        `count` references were tried; None: the test gave what it expects.
        """
        __tracebackhide__ = True
        failure = first_failure(verdicts)
        record = self._record(given, "failed" if failure else "passed", reference)
        record["has_files"] = count is not None
        record["first_failure"] = failure.name if failure else None
        record["framebuffers"] = [
            report_parts.figures(verdict, given.images) for verdict in verdicts
        ]
        if failure is None:
            for verdict in verdicts:
                if verdict.warning:
                    text = f"{given.name}: {verdict.warning}"
                    warnings.warn(text, FrameDifferenceWarning, stacklevel=3)
            return
        record["message"] = _message(given, verdicts, reference, count)
        if self._mode.parts is not None:
            record["part"] = report_parts.write(
                self._mode.parts, verdicts, reference.images, given.images
            )
        raise AssertionError(record["message"])

    def _record(self, given: _Given, outcome: str, reference: Reference | None) -> Record:
        record: Record = {
            "test": self._test,
            "name": given.name,
            "folder": str(self._folder.path),
            "has_files": True,
            "outcome": outcome,
            "origin": given.origin.summary,
            "reference_origin": reference.origin.summary if reference else None,
            "first_failure": None,
            "message": None,
            "framebuffers": [],
            "part": None,
        }
        self._records.append(record)
        return record


def name_of_test(test: str) -> str:
    """Make the name of a reference out of a test's.

    Parameters
    ----------
    test : str
        Within its module, such as "TestBlur::test_saucer[tutorial]".

    Returns
    -------
    str
        Such as "TestBlur.test_saucer-tutorial". A checksum follows where something had to be
        replaced, so that two tests do not share a name.
    """
    plain = test.replace("::", ".")
    if plain.endswith("]") and "[" in plain:
        head, _, parameters = plain[:-1].partition("[")
        plain = f"{head}-{parameters}"
    cleaned = re.sub(r"[^A-Za-z0-9_+,=.-]", "-", plain)
    if cleaned != plain or len(cleaned) > 100:
        cleaned = f"{cleaned[:91]}-{hashlib.sha256(test.encode()).hexdigest()[:8]}"
    return cleaned


def _images(field: str, frames: object) -> dict[str, NDArray[Any]]:
    """Return framebuffers by name, in this machine's byte order."""
    if isinstance(frames, np.ndarray):
        frames = {"image": frames}
    if not isinstance(frames, Mapping) or not frames:
        raise TypeError(
            f"{field}: Frames, a mapping of names to arrays or an array is needed, not {frames!r}"
        )
    images = {}
    for name, image in frames.items():
        if not isinstance(image, np.ndarray):
            raise TypeError(f"{field}: {name} must be an array, not {type(image).__name__}")
        images[name] = image.astype(image.dtype.newbyteorder("="), copy=False)
    return images


def _origin(frames: object, info: Mapping[str, str] | None) -> Origin:
    known: Mapping[str, Any] = info or (frames.info if isinstance(frames, Frames) else {})
    return Origin(
        adapter=known.get("adapter"),
        driver=known.get("driver"),
        cpu_vendor=cpu_vendor(),
        version=installed_version(),
    )


def _closest(
    references: Sequence[Reference], given: _Given
) -> tuple[Reference, tuple[Verdict, ...]]:
    """Return a reference that fits, else the one whose first failure is the furthest down."""
    judged = [(each, judge(each.images, given.images, given.tolerances)) for each in references]

    def depth(pair: tuple[Reference, tuple[Verdict, ...]]) -> float:
        failure = first_failure(pair[1])
        return float("inf") if failure is None else pair[1].index(failure)

    return max(judged, key=depth)


def _message(
    given: _Given, verdicts: tuple[Verdict, ...], reference: Reference, count: int | None
) -> str:
    before: list[str] = []
    for verdict in verdicts:
        if not verdict.passed:
            break
        before.append(verdict.name)
    lines = [
        f"{given.name}: the first framebuffer that differs is {verdicts[len(before)].name}"
        + (f" ({', '.join(before)}: right)" if before else "")
    ]
    for verdict in verdicts:
        if verdict.identical:
            lines.append(f"  {verdict.name}: equal")
        elif verdict.passed:
            lines.append(f"  {verdict.name}: within the tolerances")
        for reason in verdict.reasons:
            lines.append(f"  {verdict.name}: FAILED ({verdict.failed_at}): {reason}")
    of_several = f" (the closest of {count})" if count and count > 1 else ""
    now = given.origin.summary
    lines.append(f"  reference{of_several}: {reference.origin.summary}; now: {now}")
    return "\n".join(lines)
