"""The exposures of engines in NumPy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.refusals import assert_refused, rows

from .sequences import MODEL_ERRORS, Sequence, read_sequences

SEQUENCES = read_sequences()
ENGINES = tuple(vkbloom.exposures)
METERING = tuple(name for name in ENGINES if name != "fixed")
GREY = np.full((12, 18, 3), 0.18)


def _run(
    exposure: Any, *frames: NDArray[Any], dt: float = 0.1
) -> list[dict[str, NDArray[np.float64]]]:
    states: list[dict[str, NDArray[np.float64]]] = []
    for frame in frames:
        before = states[-1] if states else None
        states.append(vkbloom.reference.expose(frame, exposure, dt=dt, state=before))
    return states


def _stops(state: dict[str, NDArray[np.float64]]) -> float:
    """Return the stops of the picture with its bloom."""
    return float(np.log2(state["exposure"][0, 0, 1] * state["exposure"][0, 0, 2]))


@pytest.mark.skipif(not SEQUENCES, reason="the engines' sequences (../shared/data) are not here")
@pytest.mark.parametrize("sequence", SEQUENCES, ids=lambda sequence: sequence.key)
def test_the_engines_sequences(sequence: Sequence) -> None:
    state, values, bins = None, [], []
    for frame, dt in sequence.frames():
        state = vkbloom.reference.expose(frame, sequence.exposure, dt=dt, state=state)
        values.append(state["exposure"][0, 0, 0])
        bins.append(state["histogram"][0, :, 0] if "histogram" in state else None)

    assert sequence.deviation(np.array(values)) <= 2 * MODEL_ERRORS[sequence.engine]
    if sequence.histogram is not None:
        np.testing.assert_array_equal(bins, sequence.histogram)


@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize("dt", [0.0, 1 / 240, 3.0])
@pytest.mark.parametrize("size", [(1, 1), (1, 7), (5, 3), (33, 17)])
def test_any_step_and_size(name: str, dt: float, size: tuple[int, int]) -> None:
    frames = [np.full((*size, 3), light) for light in (0.18, 2.0)]
    first, second = _run(name, *frames, dt=dt)
    again = vkbloom.reference.expose(frames[1], name, dt=0, state=second)
    assert np.isfinite(second["exposure"]).all()
    assert again["exposure"][0, 0, 0] == second["exposure"][0, 0, 0]
    if dt == 0 and name != "ppv2":
        assert first["exposure"][0, 0, 0] == second["exposure"][0, 0, 0]


# The stops of a picture after two frames that are black.
@pytest.mark.parametrize(
    ("name", "black"),
    [
        ("bevy", 2 * 0.1),
        ("hdrp", 1 - np.log2(1.2)),
        ("hdrp_automatic", 1 - np.log2(1.2)),
        ("ppv2", 0.0),
        ("godot", np.inf),
        ("o3de", 16 * (1 - 0.9**2)),
        ("granite", 3 * (1 - 0.5**0.2)),
    ],
)
def test_black(name: str, black: float) -> None:
    with np.errstate(divide="ignore"):
        assert _stops(_run(name, *[np.zeros((9, 7, 3))] * 2)[-1]) == pytest.approx(black)


@pytest.mark.parametrize(
    ("name", "moved"),
    [
        ("bevy", 0.01),
        ("hdrp", 0.01),
        ("ppv2", 0.0),
        # These goals are 0.18, and the lower limits.
        ("o3de", np.log2(0.18 / 0.5)),
        ("granite", -3 - np.log2(0.5)),
        ("godot", 0 - 0.5),
    ],
)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_one_pixel_that_is_not_finite(name: str, moved: float, value: float) -> None:
    frame = np.full((24, 32, 3), 0.5)
    broken = frame.copy()
    broken[2, 4] = value
    whole, partly = _run(name, *[frame] * 60), _run(name, *[frame] * 20, *[broken] * 40)
    distance = partly[-1]["exposure"][0, 0, 0] - whole[-1]["exposure"][0, 0, 0]
    if name == "godot" and value == np.inf:
        assert partly[-1]["exposure"][0, 0, 0] == 1  # the upper limit
    elif abs(moved) > 0.01:
        # Part of the way, within 4 seconds.
        assert 0.5 * abs(moved) < np.copysign(distance, moved * distance) <= abs(moved) + 1e-6
    else:
        assert abs(distance) <= 0.01
    # (Godot's multiplier is infinite at its lower limit.)
    assert np.isfinite(partly[-1]["exposure"][0, 0, 0])


def test_an_oscillation_grows_beyond_floats() -> None:
    """Euler steps of 19 times the distance: multipliers become 0 and infinite, and are no error."""
    for exposure in (
        vkbloom.O3deExposure(speed_up=20, speed_down=20),
        vkbloom.BevyExposure(speed_brighten=20, speed_darken=20, transition=1),
    ):
        states = _run(exposure, *[GREY * 8] * 4, dt=1e3)
        assert {state["exposure"][0, 0, 2] for state in states} & {0.0, np.inf}


def test_orders() -> None:
    """HDRP and Granite expose the light of the bloom as of the frame before."""
    frames = [GREY, GREY * 8]
    for name, before in {"bevy": 0.0, "o3de": 0.0}.items():
        assert np.log2(_run(name, *frames)[1]["exposure"][0, 0, 1]) == before
    first, second = _run("hdrp", *frames)
    assert first["exposure"][0, 0, 1] == 1
    assert second["exposure"][0, 0, 1] == 1 / (1.2 * 2 ** first["exposure"][0, 0, 0])
    first, second = _run("granite", *frames)
    assert np.log2(second["exposure"][0, 0, 1]) == pytest.approx(-first["exposure"][0, 0, 0])
    assert _stops(second) == pytest.approx(-second["exposure"][0, 0, 0])
    np.testing.assert_allclose(second["exposed"], GREY * 8 * 2 ** _stops(second))


def test_exposures_without_a_meter() -> None:
    fixed = vkbloom.FixedExposure(value=2, unit="ev100")
    assert _stops(_run(fixed, GREY)[0]) == pytest.approx(-2 - np.log2(1.2))
    keyframed = vkbloom.KeyframedExposure(keys=((1, 0), (3, 4)))
    stops = [_stops(state) for state in _run(keyframed, *[GREY] * 6, dt=0.75)]
    np.testing.assert_allclose(stops, [0, 0, 1, 2.5, 4, 4], atol=1e-12)


def test_bytes_of_a_compensation() -> None:
    """Whole numbers stay: those of the engine's table for a line are 0 to 255."""
    for ends in ((0, 2), (-3.4, 3.2), (0.1, 0.7)):
        rising = vkbloom.BevyExposure(compensation=tuple(zip((-2.3, 9.9), ends, strict=True)))
        np.testing.assert_array_equal(rising.compensation_table()[0], np.arange(256))
        falling = vkbloom.BevyExposure(compensation=tuple(zip((-8, 8), ends[::-1], strict=True)))
        np.testing.assert_array_equal(falling.compensation_table()[0], np.arange(256)[::-1])


def test_records() -> None:
    for name, exposure in vkbloom.exposures.items():
        assert vkbloom.Exposure.from_json(exposure.to_json()) == exposure
        assert vkbloom.reference.expose(GREY, name)["exposed"].shape == GREY.shape
    masked = vkbloom.BevyExposure(mask=np.eye(4, dtype=np.float32))
    assert vkbloom.Exposure.from_dict(masked.to_dict()) == masked


@pytest.mark.parametrize(("call", "error"), rows(__file__, "exposures"))
def test_refused(call: str, error: str) -> None:
    names = {"vkbloom": vkbloom, "expose": vkbloom.reference.expose, "GREY": GREY, "np": np}
    assert_refused(call, error, names)
