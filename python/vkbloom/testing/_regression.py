"""The fixture `frame_regression`: compares framebuffers with approved references."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from vkbloom._arrays import copy_to_host, native_order, plain_array
from vkbloom._public import public
from vkbloom._renderer.frames import Frames
from vkbloom._version import installed_version
from vkbloom._views.tolerances import Tolerances
from vkbloom.testing._judging import Verdict, first_failure, judge
from vkbloom.testing._references import Origin, ReferenceFolder, StoredReference, check_name

__tracebackhide__ = True


class Limits(TypedDict, total=False):
    """The fields of `Tolerances`."""

    atol: float | None
    rtol: float | None
    fail_percent: float
    hard_fail: float | None
    ssim: float | None
    flip: float | None
    allow_nan: bool


@public("vkbloom.testing")
class FrameRegression:
    """Compares frames with references; the type of the fixture `frame_regression`.

    Parameters
    ----------
    folder : Path
        Folder of the references of the test's module.
    name : str
        Default name of the reference.
    update : bool
        Whether to write the references of failed checks.
    save : Path, optional
        Folder for the images of failed checks.
    written : list of Path
        Gets the files of references that are written.
    test : str, optional
        Name of the test in messages.
    used : dict, optional
        Of all tests of a run, gets the fixture that a reference was held against last, by file.

    Examples
    --------
    A test asks for the fixture:

    >>> def test_saucer(bloom_renderer, frame_regression):
    ...     frames = bloom_renderer.render(vkbloom.Scene.ufo(), "tutorial", (160, 90))
    ...     frame_regression.check(frames)
    """

    def __init__(
        self,
        *,
        folder: Path,
        name: str,
        update: bool,
        save: Path | None,
        written: list[Path],
        test: str | None = None,
        used: dict[Path, FrameRegression] | None = None,
    ) -> None:
        self._folder = ReferenceFolder(folder)
        self._name = name
        self._update = update
        self._save = save
        self._written = written
        self._test = test or name
        self._used: dict[Path, FrameRegression] = {} if used is None else used
        self._has_used_name = False

    def check(
        self,
        frames: Frames | Mapping[str, NDArray[Any]] | NDArray[Any],
        name: str | None = None,
        *,
        info: Mapping[str, str] | None = None,
        **limits: Unpack[Limits],
    ) -> None:
        """Compare frames with their reference, and fail if they differ.

        Each framebuffer is checked for shape and dtype, finiteness, equality (equal framebuffers
        pass), tolerances, SSIM and FLIP, in this order. All framebuffers are compared, so that the
        message can name the first failed one in the order of the data flow.

        Parameters
        ----------
        frames : Frames, mapping of str to ndarray, or ndarray
            Frames of vkbloom; framebuffers of another renderer by name, in the order of the data
            flow; or one image. Arrays of shape (H, W) or (H, W, C) with up to 4 channels, uint8,
            uint16, float16 or float32, top row first.
        name : str, optional
            Name of the reference within the test's module. Default: the test's name.
        info : mapping of str to str, optional
            "adapter" and "driver" that made the images, stored with a new reference. `Frames` have
            their own.
        **limits
            Fields of `vkbloom.testing.Tolerances`. With ``atol=math.inf`` only SSIM and FLIP
            decide.
        """
        tolerances = Tolerances(**limits)
        name = self._choose_name(name)
        given = StoredReference(images=_images("frames", frames), origin=_origin(frames, info))
        file = self._folder.file(name)
        reference = self._folder.load(name)
        if reference is None and not self._update:
            raise AssertionError(
                f"{name}: there is no reference {file}. Create it with --bloom-update, view "
                "it, and commit it with the tests"
            )
        if reference is not None:
            verdicts = judge(reference.images, given.images, tolerances)
            if not (self._update and first_failure(verdicts)):
                self._used.setdefault(file, self)
                self._conclude(name, given, reference, verdicts)
                return
            self._check_unused(name, given, reference, verdicts)
        for framebuffer, image in given.images.items():
            if not tolerances.allow_nan and not np.isfinite(image).all():
                raise ValueError(
                    f"{name}: {framebuffer} has NaN or infinity; set allow_nan=True to store "
                    "it as a reference"
                )
        self._folder.write(name, given.images, given.origin)
        self._used[file] = self
        self._written.append(file)

    def _check_unused(
        self,
        name: str,
        given: StoredReference,
        reference: StoredReference,
        verdicts: tuple[Verdict, ...],
    ) -> None:
        """Raise AssertionError if another check of this run has used or written a reference.

        A test that runs again, as plugins let failed ones do, may replace its own.
        """
        other = self._used.get(self._folder.file(name))
        if other is None or (other is not self and other._test == self._test):
            return
        who = "an earlier check of this test" if other is self else f"the test {other._test}"
        raise AssertionError(
            f"{name}: the reference is that of {who}, too, and this one differs; it is not "
            f"replaced: give one of them another name\n"
            + _message(name, given, verdicts, reference)
        )

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
            Name in messages.
        info, expected_info : mapping of str to object, optional
            "adapter" and "driver" that made `actual` and `expected`, for messages: an engine's
            name, or `Frames.info`. `Frames` have their own.
        **limits
            As for `check`.
        """
        tolerances = Tolerances(**limits)
        if name is not None:
            check_name(name)
        given = StoredReference(images=_images("actual", actual), origin=_origin(actual, info))
        reference = StoredReference(
            images=_images("expected", expected), origin=_origin(expected, expected_info)
        )
        verdicts = judge(reference.images, given.images, tolerances)
        self._conclude(name or self._name, given, reference, verdicts)

    def _choose_name(self, name: str | None) -> str:
        if name is not None:
            check_name(name)
            return name
        if self._has_used_name:
            raise ValueError(
                "name: the test already has a check without a name; give this one a name"
            )
        self._has_used_name = True
        return self._name

    def _conclude(
        self,
        name: str,
        given: StoredReference,
        reference: StoredReference,
        verdicts: tuple[Verdict, ...],
    ) -> None:
        """Raise AssertionError if a framebuffer failed."""
        if first_failure(verdicts) is None:
            return
        message = _message(name, given, verdicts, reference)
        try:
            self._write_images(name, given, reference)
        except ValueError as error:
            message += f"\n  the images are not saved: {error}"
        raise AssertionError(message)

    def _write_images(self, name: str, given: StoredReference, reference: StoredReference) -> None:
        if self._save is None:
            return
        for kind, made in (("expected", reference), ("actual", given)):
            folder = ReferenceFolder(self._save / kind / self._folder.path.name)
            folder.write(name, made.images, made.origin)


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
        images[name] = native_order(plain_array(copy_to_host(image), f"{field}: {name}"))
    return images


def _origin(frames: object, info: Mapping[str, Any] | None) -> Origin:
    known: Mapping[str, Any] = info or (frames.info if isinstance(frames, Frames) else {})
    return Origin(
        adapter=known.get("adapter"),
        driver=known.get("driver"),
        version=installed_version(),
    )


def _message(
    name: str, given: StoredReference, verdicts: tuple[Verdict, ...], reference: StoredReference
) -> str:
    before: list[str] = []
    for verdict in verdicts:
        if not verdict.passed:
            break
        before.append(verdict.name)
    lines = [
        f"{name}: the first framebuffer that differs is {verdicts[len(before)].name}"
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
    lines.append(f"  reference: {reference.origin.summary}; now: {given.origin.summary}")
    return "\n".join(lines)
