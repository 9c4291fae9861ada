"""Old names work, with a warning at the caller's line."""

from __future__ import annotations

import pytest

import vkbloom
from vkbloom import deprecations
from vkbloom.deprecations import Renamed, renamed_arguments


@renamed_arguments(levels=Renamed("count", "1.1", "1.3"))
def halved(value: float, *, count: int = 1) -> float:
    """Return a value that is halved some times."""
    return value / 2.0**count


def test_arguments() -> None:
    message = "levels: renamed in vkbloom 1.1 and removed in 1.3; use count"
    with pytest.warns(DeprecationWarning, match=message) as told:
        assert halved(8.0, levels=2) == 2  # type: ignore[call-arg]
    assert [one.filename for one in told] == [__file__]
    assert halved(8.0, count=2) == 2
    assert halved.__doc__ == "Return a value that is halved some times."
    with pytest.raises(TypeError, match="levels: count is its new name; give one of them"):
        halved(8.0, levels=2, count=1)  # type: ignore[call-arg]


def test_names_of_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    old = {"open_image": Renamed("read", "1.1", "1.3"), "OldMethod": Renamed("Pyramid", "1", "2")}
    monkeypatch.setattr(deprecations, "NAMES", old)
    with pytest.warns(DeprecationWarning, match=r"vkbloom.open_image: .* use vkbloom.read") as told:
        assert vkbloom.open_image is vkbloom.read
    assert [one.filename for one in told] == [__file__]
    with pytest.warns(DeprecationWarning, match=r"use vkbloom.Pyramid"):
        from vkbloom import OldMethod
    assert OldMethod is vkbloom.Pyramid
    with pytest.raises(AttributeError, match="no attribute 'open_images'"):
        vkbloom.open_images  # noqa: B018
