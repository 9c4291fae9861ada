"""The fixture `frame_regression`: compares framebuffers with approved references."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from vkbloom._checks import native_order
from vkbloom._renderer.frames import Frames
from vkbloom._version import installed_version
from vkbloom._views.tolerances import Tolerances
from vkbloom.testing import _hashes as hashes
from vkbloom.testing import _test_report as test_report
from vkbloom.testing._judging import Verdict, first_failure, judge
from vkbloom.testing._references import Origin, Reference, ReferenceFolder, check_name, cpu_vendor
from vkbloom.testing._test_report import Record


class Limits(TypedDict, total=False):
    """The fields of `Tolerances`."""

    atol: float | None
    rtol: float | None
    fail_percent: float
    hard_fail: float | None
    ssim: float | None
    psnr: float | None
    flip: float | None
    allow_nan: bool


@dataclass(frozen=True, kw_only=True)
class Mode:
    """The options of the command line.

    - `update`: Whether to replace the references of failed checks.
    - `add`: Whether to write further references for failed checks, and keep the existing ones.
    - `allow_missing`: Whether a check without a reference passes.
    - `hashed`: Whether references are hashes, and every value must be equal.
    - `parts`: Folder for the report's pictures of failed checks; None: no report.
    """

    update: bool = False
    add: bool = False
    allow_missing: bool = False
    hashed: bool = False
    parts: Path | None = None


@dataclass(frozen=True, eq=False)
class _Given:
    """The arguments of a check."""

    name: str
    images: Mapping[str, NDArray[Any]]
    origin: Origin
    tolerances: Tolerances


class FrameRegression:
    """Compares frames with references; the type of the fixture `frame_regression`.

    Parameters
    ----------
    folder : Path
        Folder of the references of the test's module.
    test : str
        The test's id, for messages.
    name : str
        Default name of the reference.
    mode : Mode
    records : list of dict
        Each check appends its result.
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
        exact: bool = False,
        info: Mapping[str, str] | None = None,
        **limits: Unpack[Limits],
    ) -> None:
        """Compare frames with their reference, and fail if they differ.

        Each framebuffer is checked for shape and dtype, finiteness, equality (equal framebuffers
        pass), tolerances, SSIM and FLIP, in this order. All framebuffers are compared, so that the
        message can name the first failed one in the order of the data flow. If there are several
        references, the frames must match one of them.

        Parameters
        ----------
        frames : Frames, mapping of str to ndarray, or ndarray
            Frames of vkbloom; framebuffers of another renderer by name, in the order of the data
            flow; or one image. Arrays of shape (H, W) or (H, W, C) with up to 4 channels, uint8,
            uint16, float16 or float32, top row first.
        name : str, optional
            Name of the reference within the test's module. Default: the test's name.
        exact : bool, default False
            Whether every value must be equal to the reference's. The reference must have been made
            by a driver with the same hash, whose results are bit-equal on every CPU. `Frames` of
            the package ``vkbloom-lavapipe`` have a hash. Excludes all tolerances.
        info : mapping of str to str, optional
            "adapter", "driver" and "driver_sha256" that made the images, stored with a new
            reference. `Frames` have their own.
        **limits
            Fields of `vkbloom.testing.Tolerances`. With ``atol=math.inf`` only SSIM and FLIP
            decide.
        """
        __tracebackhide__ = True
        if exact:
            if given_limits := [name for name in limits if name != "allow_nan"]:
                raise ValueError(
                    f"exact: True excludes tolerances; leave out {', '.join(given_limits)}"
                )
            limits["atol"] = 0.0
        tolerances = Tolerances(**limits)
        given = _Given(
            self._chosen_name(name), _images("frames", frames), _origin(frames, info), tolerances
        )
        if self._mode.hashed:
            self._check_hashes(given)
            return
        references = self._folder.load(given.name)
        if exact:
            references = self._of_one_driver(references, given)
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
        info: Mapping[str, Any] | None = None,
        expected_info: Mapping[str, Any] | None = None,
        **limits: Unpack[Limits],
    ) -> None:
        """Compare frames with others of the same test, and report as `check` does.

        Parameters
        ----------
        actual, expected : Frames, mapping of str to ndarray, or ndarray
            As for `check`; `expected` replaces the reference files.
        name : str, optional
            Name in messages and the report.
        info, expected_info : mapping of str to object, optional
            "adapter" and "driver" that made `actual` and `expected`, for messages and the report:
            an engine's name, or `Frames.info`. `Frames` have their own.
        **limits
            As for `check`.

        """
        __tracebackhide__ = True
        tolerances = Tolerances(**limits)
        if name is not None:
            check_name(name)
        given = _Given(
            name or self._name, _images("actual", actual), _origin(actual, info), tolerances
        )
        reference = Reference(
            images=_images("expected", expected), origin=_origin(expected, expected_info)
        )
        self._conclude(given, reference, judge(reference.images, given.images, tolerances), None)

    def _chosen_name(self, name: str | None) -> str:
        __tracebackhide__ = True
        if name is not None:
            check_name(name)
            return name
        if self._has_used_name:
            raise ValueError(
                "name: the test already has a check without a name; give this one a name"
            )
        self._has_used_name = True
        return self._name

    def _of_one_driver(self, references: list[Reference], given: _Given) -> list[Reference]:
        """Return the references that the driver of the given frames made.

        Raises ValueError if the driver has no hash, or no reference has the same hash.
        """
        __tracebackhide__ = True
        origin = given.origin
        if not origin.driver_sha256:
            raise ValueError(
                f"exact: the driver of the frames has no hash ({origin.summary}), so its "
                "results may differ between machines; use the driver of vkbloom-lavapipe, or "
                "tolerances"
            )
        same = [
            reference
            for reference in references
            if reference.origin.driver_sha256 == origin.driver_sha256
        ]
        if references and not same and not (self._mode.update or self._mode.add):
            made_by = "; ".join(reference.origin.summary for reference in references)
            raise ValueError(
                f"exact: {self._folder.file(given.name)} has no reference of the frames' driver "
                f"({origin.summary}), only of {made_by}; install that version of "
                "vkbloom-lavapipe, or write a reference with --bloom-update or --bloom-add"
            )
        return same

    def _check_hashes(self, given: _Given) -> None:
        """Compare the hashes of the images with those that the same driver drew."""
        __tracebackhide__ = True
        driver = given.origin.driver_sha256
        if not driver:
            raise ValueError(
                f"--bloom-hash: the driver of the frames has no hash ({given.origin.summary}); "
                "use the driver of vkbloom-lavapipe"
            )
        file = self._folder.file(given.name).with_suffix(".hashes")
        listed, results = hashes.load(file), hashes.hashes_of(given.images)
        expected = listed.get(driver)
        message = (
            "there is no reference" if expected is None else hashes.difference(expected, results)
        )
        if message and (self._mode.update or self._mode.add):
            hashes.save(file, {**(listed if self._mode.add else {}), driver: results})
            self._record(given, "written", None)
            return
        missing = expected is None
        outcome = "missing" if missing else "failed" if message else "passed"
        record = self._record(given, outcome, None)
        if message and not (missing and self._mode.allow_missing):
            record["message"] = (
                f"{given.name}: {message} of {file} for the driver {driver[:12]}. Compare images "
                "without --bloom-hash, or write a reference with --bloom-update or --bloom-add"
            )
            raise AssertionError(record["message"])

    def _without_reference(self, given: _Given) -> None:
        __tracebackhide__ = True
        if self._mode.update or self._mode.add:
            self._write(given)
            return
        record = self._record(given, "missing", None)
        if not self._mode.allow_missing:
            record["message"] = message = (
                f"{given.name}: there is no reference {self._folder.file(given.name)}. Create it "
                "with --bloom-update, view it, and commit it with the tests"
            )
            raise AssertionError(message)

    def _write(self, given: _Given) -> None:
        __tracebackhide__ = True
        for framebuffer, image in given.images.items():
            if not given.tolerances.allow_nan and not np.isfinite(image).all():
                raise ValueError(
                    f"{given.name}: {framebuffer} has NaN or infinity; set allow_nan=True to store "
                    "it as a reference"
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
        """Record the result; raise AssertionError if a framebuffer failed.

        `count` is the number of references; None if the test gave the expected frames.
        """
        __tracebackhide__ = True
        failure = first_failure(verdicts)
        record = self._record(given, "failed" if failure else "passed", reference)
        record["first_failure"] = failure.name if failure else None
        record["framebuffers"] = [
            test_report.figures(verdict, given.images) for verdict in verdicts
        ]
        if failure is None:
            return
        record["message"] = _message(given, verdicts, reference, count)
        if self._mode.parts is not None:
            record["part"] = test_report.write_part(
                self._mode.parts, verdicts, reference.images, given.images
            )
        raise AssertionError(record["message"])

    def _record(self, given: _Given, outcome: str, reference: Reference | None) -> Record:
        record: Record = {
            "test": self._test,
            "name": given.name,
            "folder": str(self._folder.path),
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
    """Return the name of a reference for a test's name."""
    plain = test.replace("::", ".")
    if plain.endswith("]") and "[" in plain:
        head, _, parameters = plain[:-1].partition("[")
        plain = f"{head}-{parameters}"
    cleaned = re.sub(r"[^A-Za-z0-9_+,=.-]", "-", plain)
    if cleaned != plain or len(cleaned) > 100:
        cleaned = f"{cleaned[:91]}-{hashlib.sha256(test.encode()).hexdigest()[:8]}"
    return cleaned


def _images(field: str, frames: object) -> dict[str, NDArray[Any]]:
    """Return framebuffers by name, in native byte order."""
    __tracebackhide__ = True
    if isinstance(frames, np.ndarray):
        frames = {"image": frames}
    if not isinstance(frames, Mapping) or not frames:
        raise TypeError(
            f"{field}: {frames!r} is not Frames, a mapping of names to arrays, or an array"
        )
    images = {}
    for name, image in frames.items():
        if not isinstance(image, np.ndarray):
            raise TypeError(f"{field}: {name}: {type(image).__name__} is not a NumPy array")
        images[name] = native_order(image)
    return images


def _origin(frames: object, info: Mapping[str, Any] | None) -> Origin:
    known: Mapping[str, Any] = info or (frames.info if isinstance(frames, Frames) else {})
    return Origin(
        adapter=known.get("adapter"),
        driver=known.get("driver"),
        cpu_vendor=cpu_vendor(),
        version=installed_version(),
        driver_sha256=known.get("driver_sha256"),
    )


def _closest(
    references: Sequence[Reference], given: _Given
) -> tuple[Reference, tuple[Verdict, ...]]:
    """Return a reference that matches; otherwise the one that fails last in the data flow."""
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
        if verdict.diagnosis is not None and verdict.diagnosis.cause is not None:
            lines.append(f"  {verdict.name}: cause: {verdict.diagnosis.summary}")
    of_several = f" (the closest of {count})" if count and count > 1 else ""
    now = given.origin.summary
    lines.append(f"  reference{of_several}: {reference.origin.summary}; now: {now}")
    return "\n".join(lines)
