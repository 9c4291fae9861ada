"""The benchmarks' harness: what is compared, what is timed, and what is written."""

from __future__ import annotations

import importlib
import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks import BENCHMARKS, Plan, Report, peers, run, write
from benchmarks.__main__ import command as program
from benchmarks.cost import Line
from benchmarks.image import SETTINGS, _time_one, full_kernel
from benchmarks.inputs import THRESHOLD, pictures
from benchmarks.plan import VARIANTS_VARIABLE
from benchmarks.results import Goal, Section, Table, agreement
from benchmarks.spread import spread
from benchmarks.timing import (
    MIN_ROUNDS,
    Contender,
    Estimate,
    Rounds,
    Times,
    _overhead,
    alternate,
    alternate_seconds,
    estimate,
    wall_clock,
)
from click.testing import CliRunner, Result
from numpy.typing import NDArray

import vkbloom
from tests.conftest import ADAPTER
from tests.exhaustive import EXHAUSTIVE

# The tests do not require the peers. SciPy is installed with scikit-image, which the tests require.
scipy_peer = importlib.import_module("benchmarks.peers.scipy")


def bench(*arguments: str | Path) -> Result:
    return CliRunner().invoke(program, ["--adapter", ADAPTER, *map(str, arguments)])


def last(plan: Plan) -> Report:
    *_, report = run(plan)
    return report


def quick(*only: str, **changes: Any) -> Plan:
    return Plan(adapter=ADAPTER, quick=True, only=only, **changes)


# Timing


def rounds(count: int) -> Rounds:
    return Rounds(count, count, math.inf)


def test_contenders_are_timed_in_turn() -> None:
    calls: list[tuple[str, int]] = []

    def contender(name: str) -> Contender:
        return Contender(name, lambda turn: calls.append((name, turn)))

    times = alternate([contender("a"), contender("b")], rounds(3), warm_up=2)
    assert calls == [(name, turn) for turn in range(5) for name in "ab"]
    assert list(times) == ["a", "b"]
    assert all(len(measured.seconds) == 3 for measured in times.values())


def test_rounds_go_on_while_an_interval_is_wide() -> None:
    def noisy(turn: int) -> float:
        return 1.0 + turn % 2

    calls = {"narrow": lambda _: 1.0}
    limits = Rounds(6, 10, math.inf)
    assert len(alternate_seconds(calls, limits)["narrow"].seconds) == 6
    assert len(alternate_seconds(calls | {"noisy": noisy}, limits)["noisy"].seconds) == 10
    # Too little time: the least number of all.
    times = alternate_seconds({"noisy": noisy}, limits._replace(seconds=0.0))
    assert len(times["noisy"].seconds) == MIN_ROUNDS


def test_what_the_clock_takes_is_subtracted(monkeypatch: pytest.MonkeyPatch) -> None:
    _overhead.cache_clear()
    now = iter(range(10_000))
    monkeypatch.setattr("benchmarks.timing.time.perf_counter", lambda: float(next(now)))
    # Each reading of this clock takes a second, and the call one reading more.
    assert wall_clock(lambda _: next(now))(0) == 1.0
    _overhead.cache_clear()


@pytest.mark.parametrize(
    ("count", "place"), [(1, 0), (3, 0), (5, 0), (6, 0), (8, 0), (9, 1), (15, 3), (25, 7)]
)
def test_an_interval_lies_between_two_values(count: int, place: int) -> None:
    """The places are those of published tables of the sign test at 5 %."""
    values = [float(value) for value in range(count)]
    middle = (count - 1) / 2
    expected = Estimate(middle, place, count - 1 - place)
    assert estimate(values[::-1]) == expected


def test_an_interval_contains_the_median_as_often_as_it_says() -> None:
    random = np.random.default_rng(0)
    found = [estimate(list(row)) for row in random.lognormal(0, 1, (2000, 15))]
    inside = np.mean([one.low <= 1 <= one.high for one in found])
    # 0.965 is the probability for 15 values.
    assert inside == pytest.approx(0.965, abs=0.015)


def test_a_device_can_be_the_clock() -> None:
    contender = Contender("device", lambda turn: turn + 1, lambda result: result / 4)
    assert alternate([contender], rounds(3), warm_up=1)["device"].seconds == (0.5, 0.75, 1.0)


def test_a_ratio_is_of_rounds() -> None:
    slow, fast = Times((2.0, 8.0, 6.0, 40.0, 5.0)), Times((1.0, 2.0, 2.0, 4.0, 5.0))
    ratio = slow.over(fast)
    # The ratios of the rounds are 2, 4, 3, 10, 1, too few for a narrower interval.
    assert ratio == (3.0, 1.0, 10.0)
    assert str(ratio) == "3 (1 to 10)"
    assert slow.least == 2.0
    assert slow.minus(fast).seconds == (1.0, 6.0, 4.0, 36.0, 0.0)
    assert slow.plus(fast).seconds == (3.0, 10.0, 8.0, 44.0, 10.0)


def test_a_line_is_found() -> None:
    x = [1.0, 4.0, 16.0]
    line = Line.through(x, [2.0 + 3.0 * place for place in x])
    assert (line.start, line.slope) == pytest.approx((2.0, 3.0))
    assert line.deviation(2.0, 8.8) == pytest.approx(0.1)


# Agreement of pictures


@pytest.mark.parametrize("dtype", [np.uint8, np.float16, np.float32])
def test_one_wrong_pixel_is_a_disagreement(dtype: Any) -> None:
    ours = pictures((40, 30), dtype)[0]
    theirs = ours.copy()
    assert agreement("", ours, theirs, 0.0, "").agrees
    theirs[7, 5, 1] += 3
    found = agreement("", ours, theirs, 2.0, "")
    assert not found.agrees
    # 3e-3 is a half's rounding at 3.
    assert found.largest == pytest.approx(3.0, abs=3e-3)


def test_colours_are_compared_and_not_alpha() -> None:
    ours = pictures((8, 8), np.float32)[0]
    same, nan = ours.copy(), ours.copy()
    same[..., 3], nan[0, 0, 0] = 7, np.nan
    for theirs in (same, same[..., :3]):
        assert agreement("", ours, theirs, 0.0, "").agrees
    for theirs in (ours[:4], ours.astype(np.float16), nan):
        assert not agreement("", ours, theirs, math.inf, "").agrees


def spoil(image: NDArray[Any], *_: Any) -> dict[str, peers.ImageBloom]:
    """A peer that blurs nothing."""
    return {"SciPy": lambda picture: picture.copy()}


def test_a_wrong_peer_is_told_and_not_timed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(scipy_peer, "image_bloom", spoil)
    monkeypatch.setattr(
        "benchmarks.image.run",
        lambda plan, section: _time_one(plan, section, (64, 36), np.dtype("float16"), 4),
    )
    result = bench("--quick", "--only", "image", "-o", tmp_path / "b.md")
    assert result.exit_code == 1
    assert "float16, RGBA: SciPy: pictures differ by" in result.stderr
    assert "Traceback" not in result.stderr
    (section,) = json.loads((tmp_path / "b.json").read_text())["sections"]
    wrong = [found for found in section["agreements"] if not found["agrees"]]
    assert {found["what"].split(": ")[1] for found in wrong} == {"SciPy"}
    assert "SciPy" not in section["times"]["float16, RGBA"]
    assert "scikit-image" in section["times"]["float16, RGBA"]
    assert "| **no** |" in (tmp_path / "b.md").read_text()


# Peers


@pytest.mark.parametrize("error", [None, ImportError, OSError, RuntimeError, AttributeError])
def test_a_peer_that_is_missing_or_fails_is_listed(
    monkeypatch: pytest.MonkeyPatch, error: type[Exception] | None
) -> None:
    def make(_: Any) -> dict[str, Any]:
        assert error is not None
        raise error("libcuda.so.1:\n no such file")

    monkeypatch.setattr(peers, "find_spec", lambda name: error)
    missing: list[str] = []
    assert peers.gather(("CuPy",), make, missing) == {}
    fails = "CuPy does not run here: libcuda.so.1: no such file"
    assert missing == [fails if error else "CuPy is not installed"]


@pytest.mark.parametrize("dtype", [np.uint8, np.float16, np.float32])
@pytest.mark.parametrize("channels", [3, 4])
@pytest.mark.parametrize("name", ["scipy", "scikit_image"])
def test_peers_make_the_references_picture(name: str, channels: int, dtype: Any) -> None:
    image = pictures((50, 37), dtype, channels)[1]
    module = importlib.import_module(f"benchmarks.peers.{name}")
    ((_, bloom),) = module.image_bloom(image, full_kernel(SETTINGS), THRESHOLD, 1).items()
    kept = image.copy()
    result = bloom(image)
    assert result.dtype == dtype
    np.testing.assert_array_equal(image, kept)
    # The reference gives 0 to 1, unclamped; half a level, half a half's step at 2.
    expected = vkbloom.reference.apply(image, SETTINGS)["final"][..., :3]
    scale = 255 if dtype == np.uint8 else 1
    allowed = {"uint8": 0.5 + 1e-3, "float16": 1e-3, "float32": 1e-6}[np.dtype(dtype).name]
    difference = result[..., :3] - np.clip(expected * scale, 0, 255)
    assert np.abs(difference).max() <= allowed


# Inputs


def test_the_spread_of_a_known_blur() -> None:
    ndimage = pytest.importorskip("scipy.ndimage")

    def blur(image: NDArray[Any]) -> NDArray[Any]:
        single = image.astype(np.float32)
        return 3 * np.asarray(ndimage.gaussian_filter(single, (6.0, 6.0, 0.0)))

    # The Gaussian is cut off at 4 sigma.
    assert spread(blur, (256, 128)) == pytest.approx((6.0, 3.0), rel=2e-3)


# Plans


def test_a_renderer_is_made_under_the_variant(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[str, str | None]] = []
    monkeypatch.setattr(
        vkbloom, "Renderer", lambda name: seen.append((name, os.environ.get(VARIANTS_VARIABLE)))
    )
    monkeypatch.delenv(VARIANTS_VARIABLE, raising=False)
    Plan(adapter="software").renderer("fragment")
    assert VARIANTS_VARIABLE not in os.environ
    monkeypatch.setenv(VARIANTS_VARIABLE, "mine")
    Plan().renderer()
    assert os.environ[VARIANTS_VARIABLE] == "mine"
    assert seen == [("software", "fragment"), ("auto", "auto")]


# Reports


def test_report_has_page_and_json(tmp_path: Path) -> None:
    machine = {"date": "a day", "command": "make bench", "adapter": "X", "adapter type": "cpu"}
    machine |= {"peers": {"SciPy": "1", "CuPy": None}}  # type: ignore[dict-item]
    section = Section(
        "id",
        "A title",
        ["What it is."],
        [Table("Rows", ("a", "b"), (("1|2", "3"),))],
        [
            Goal("x / y", Estimate(2.0, 1.5, 2.5), 3.0),
            Goal("y / x", Estimate(math.nan, math.nan, math.nan), 3.0, at_most=True),
        ],
        missing=["CuPy is not installed"],
        times={"group": {"one": Times((0.5, 1.5, 1.0))}},
    )
    written = write(Report(machine, (section,)), tmp_path / "new" / "b.md")
    assert [path.name for path in written] == ["b.md", "b.json"]
    page = written[0].read_text()
    rows = [
        "| CuPy | not installed |",
        "| 1\\|2 | 3 |",
        "| x / y | at least 3 | 2 (1.5 to 2.5) | no | id |",
    ]
    rows += ["| y / x | at most 3 | nan (nan to nan) | no | id |", "- CuPy is not installed"]
    assert {*rows, "Written by `make bench`, a day.", "## A title (`id`)"} <= {*page.splitlines()}
    values = json.loads(written[1].read_text(), parse_constant=pytest.fail)
    (found,) = values["sections"]
    assert values["machine"] == machine
    one = {"median": 1, "least": 0.5, "interval": [0.5, 1.5], "seconds": [0.5, 1.5, 1]}
    assert found["times"]["group"]["one"] == one
    assert [goal["ratio"] for goal in found["goals"]] == [[2.0, 1.5, 2.5], [None] * 3]


def test_results_are_written_before_a_later_failure(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def fail(*_: object) -> None:
        raise vkbloom.Error("the device went away")

    monkeypatch.setattr(importlib.import_module("benchmarks.cost"), "run", fail)
    result = bench("--quick", "--only", "requests", "--only", "cost", "-o", tmp_path / "b.md")
    assert isinstance(result.exception, vkbloom.Error)
    (section,) = json.loads((tmp_path / "b.json").read_text())["sections"]
    assert section["id"] == "requests"


# All of it


#: Those that take two seconds at most; make exhaustive runs all.
RUN = [*BENCHMARKS] if EXHAUSTIVE else ["forward", "requests", "cost"]
OF_GPUS = ("image-gpu", "convolution-gpu", "transfers")
RUN += [] if EXHAUSTIVE else OF_GPUS


@pytest.fixture(scope="module")
def smoke(tmp_path_factory: pytest.TempPathFactory) -> tuple[Result, dict[str, Any], str]:
    """A quick run, its JSON and its page."""
    path = tmp_path_factory.mktemp("bench") / "all.md"
    result = bench("--quick", "-o", path, *(word for name in RUN for word in ("--only", name)))
    return result, json.loads(path.with_suffix(".json").read_text()), path.read_text()


def test_everything_runs(smoke: tuple[Result, dict[str, Any], str]) -> None:
    result, values, page = smoke
    assert (result.exit_code, result.stderr) == (0, "")
    assert [section["id"] for section in values["sections"]] == RUN
    for section in values["sections"]:
        if section["id"] == "training" and "PyTorch is not installed" in section["missing"]:
            continue
        assert f"(`{section['id']}`)" in page
        assert all(found["agrees"] for found in section["agreements"])
        # Its figures mean nothing.
        assert section["goals"] == []
        if values["machine"]["adapter type"] == "cpu" and section["id"] in OF_GPUS:
            assert "is no GPU" in section["missing"][0]
            continue
        assert section["tables"]
        assert section["records"]
        for group in section["times"].values():
            rounds = {len(times["seconds"]) for times in group.values()}
            assert len(rounds) == 1, "all contenders of a group run equally often"


# The command


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--only", "speed"), "speed"),
        (("--rounds", "2"), "rounds: 2 is out of range, 3 or more"),
        (("--requests", "0"), "requests: 0 is out of range"),
        (("--threads", "0"), "threads: 0 is out of range"),
        (("-o", "table.txt"), "does not end in .md"),
        (("--beside", __file__), "test_bench.py is not a result of the benchmarks"),
        (("--keep", __file__), "test_bench.py is not a result of the benchmarks"),
        (("extra",), "extra"),
    ],
)
def test_wrong_use(arguments: tuple[str, ...], message: str, tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path)
        result = bench(*arguments)
    assert result.exit_code == 2
    assert message in result.stderr
    assert list(tmp_path.iterdir()) == []
