"""A requested grid, and its layout: variables, shapes and dtypes, before anything is rendered."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from vkbloom import _core
from vkbloom._extras import import_extra
from vkbloom._framebuffers import check_framebuffers, dimensions, leading
from vkbloom._grid.axes import Axis, read_axes, settings_of
from vkbloom._grid.order import Index, ranking_of, walk
from vkbloom._grid.sources import Point, Source, digest, read_source, visit
from vkbloom._renderer.frames import Frames
from vkbloom._renderer.plans import Framebuffer
from vkbloom._renderer.renderer import Renderer
from vkbloom._renderer.sources import Geometry
from vkbloom._renderer.state import Continued, State, advance_moment
from vkbloom._settings.antialiasing import Antialiasing, check_antialiasing, check_use
from vkbloom._settings.exposed import expose
from vkbloom._settings.exposure import Exposure, check_exposure, check_seconds
from vkbloom._settings.settings import Settings, check_settings
from vkbloom._version import installed_version

if TYPE_CHECKING:
    import xarray

Reduce = Mapping[str, Callable[[Frames], Any]]

_CHANNELS: Final = ("r", "g", "b", "a")


@dataclass(frozen=True, eq=False)
class Grid:
    """A requested grid, with checked arguments.

    - `settings`: The settings that the axes change, unless an axis has the settings.
    - `axes`: The axes, in the order of the result's dimensions.
    - `framebuffers`: The framebuffers to keep.
    - `exposure`, `antialiasing`, `dt`: Those of all points, unless an axis has them.
    - `before`: The state that each point continues; None: there is no stage in time.
    """

    source: Source
    settings: Settings
    axes: tuple[Axis, ...]
    framebuffers: str | tuple[str, ...]
    reduce: Reduce
    exposure: Exposure | None
    antialiasing: Antialiasing | None
    dt: float
    before: Continued | None

    @property
    def shape(self) -> Index:
        """Number of values by axis."""
        return tuple(len(axis) for axis in self.axes)

    @property
    def wanted(self) -> str | tuple[str, ...]:
        """The framebuffers to ask the renderer for."""
        names = self.framebuffers
        for reduction in self.reduce.values():
            needed = getattr(reduction, "framebuffers", "all")
            if "all" in (names, needed):
                return "all"
            names = tuple(dict.fromkeys((*names, *needed)))
        return names

    def point(self, index: Index) -> Point:
        """Return the point at an index."""
        time = self.source.time
        base = self.settings
        changes = {}
        stages: dict[str, Any] = {"exposure": self.exposure, "taa": self.antialiasing}
        stages["dt"] = self.dt
        for axis, number in zip(self.axes, index, strict=True):
            if axis.kind == "preset":
                base = settings_of(axis)[number]
            elif axis.kind == "settings":
                changes[axis.name] = axis.values[number]
            elif axis.kind == "stage":
                stages[axis.name] = axis.values[number]
            else:
                time = axis.values[number]
        chosen = base.replace(**changes) if changes else base
        if stages["exposure"] is not None:
            stages["exposure"] = check_exposure(stages["exposure"])
        moment = None
        if stages["taa"] is not None:
            stages["taa"] = check_antialiasing(stages["taa"])
            if self.source.has_time and self.before is not None:
                moment, _ = advance_moment(stages["taa"], time, self.before.state)
        return Point(index, expose(chosen, **stages), time, moment)

    def describe_point(self, index: Index) -> str:
        """Return a point's axis values as text for messages."""
        values = (f"{axis.name}={axis.label(i)}" for axis, i in zip(self.axes, index, strict=True))
        return ", ".join(values) or "the only point"

    @property
    def remaining_settings(self) -> dict[str, Any]:
        """The settings that no axis changes, and the method; empty if an axis has the settings."""
        if any(axis.kind == "preset" for axis in self.axes):
            return {}
        varied = {axis.name for axis in self.axes if axis.kind == "settings"}
        return {k: v for k, v in self.settings.to_dict().items() if k not in varied}

    @property
    def remaining_stages(self) -> dict[str, Any]:
        """The stages in time that no axis changes, as JSON has them; empty if there are none."""
        if self.before is None:
            return {}
        varied = {axis.name for axis in self.axes if axis.kind == "stage"}
        exposure = None if self.exposure is None else self.exposure.to_dict()
        # Of a history, which is too long, what tells it from others.
        state = {
            name: array.tolist() if array.shape[:2] == (1, 1) else digest(np.asarray(array))
            for name, array in self.before.state.items()
        }
        record: dict[str, Any] = {"exposure": exposure, "dt": self.dt, "state": state}
        if self.antialiasing is not None:
            record["taa"] = self.antialiasing.to_dict()
        return {name: value for name, value in record.items() if name not in varied}


@dataclass(frozen=True)
class Variable:
    """A variable of the Dataset: a framebuffer or a figure of every point."""

    dims: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    attributes: Mapping[str, str]

    @property
    def size(self) -> int:
        """Bytes of one point."""
        return int(np.prod(self.shape, dtype=np.int64)) * self.dtype.itemsize


@dataclass(frozen=True)
class Layout:
    """The layout of a grid on a renderer.

    - `ranking`: The axes from the slowest to the fastest.
    - `origin`: As the function of this name returns it.
    """

    ranking: tuple[int, ...]
    variables: Mapping[str, Variable]
    origin: Mapping[str, str]

    @property
    def point_size(self) -> int:
        """Bytes of memory per point."""
        return sum(variable.size for variable in self.variables.values())


def ask(
    source: object,
    settings: Settings | str | None,
    axes: Mapping[str, Any] | None,
    *,
    size: tuple[int, int] | None,
    shading: str,
    time: float,
    framebuffers: str | Sequence[str],
    reduce: Reduce | None,
    mask: object = None,
    emission: object = None,
    exposure: Exposure | str | None = None,
    taa: Antialiasing | str | None = None,
    dt: float | None = None,
    motion: object = None,
    depth: object = None,
    state: Mapping[str, Any] | None = None,
) -> Grid:
    """Check the arguments that all grids share."""
    if settings is not None:
        settings = check_settings(settings)
    beside: Any = {"mask": mask, "emission": emission, "geometry": Geometry(motion, depth)}
    checked = read_source(source, size, shading, time, **beside)
    grid_axes = read_axes(settings, {} if axes is None else axes, has_time=checked.has_time)
    names = check_framebuffers(framebuffers)
    reductions = {} if reduce is None else dict(reduce)
    taken = {"y", "x", "channel", "done", *(axis.name for axis in grid_axes), *(names or ())}
    for name, reduction in reductions.items():
        if not isinstance(name, str) or not name.isidentifier() or name in taken:
            raise ValueError(f"reduce: {name!r} is not a possible name of a variable of this grid")
        if not callable(reduction):
            raise TypeError(f"reduce: {name}: {reduction!r} is not callable")
    if names == () and not reductions:
        raise ValueError("framebuffers: there are no framebuffers and no reductions; request some")
    has_taa = taa is not None or any(axis.name == "taa" for axis in grid_axes)
    check_use(True if has_taa else None, motion=motion, depth=depth)
    given = {"exposure": exposure, "taa": taa, "dt": dt, "state": state}
    return Grid(
        checked,
        check_settings(settings, of_image=not checked.has_time),
        grid_axes,
        "all" if names is None else names,
        reductions,
        None if exposure is None else check_exposure(exposure),
        None if taa is None else check_antialiasing(taa),
        check_seconds("dt", dt),
        _read_before({name: value is not None for name, value in given.items()}, grid_axes, state),
    )


def _read_before(
    is_given: Mapping[str, bool], axes: Sequence[Axis], state: Mapping[str, Any] | None
) -> Continued | None:
    """Return what each point continues; raise ValueError for arguments that do not fit."""
    varied = {axis.name for axis in axes if axis.kind == "stage"}
    for name in varied:
        if is_given[name]:
            raise ValueError(f"{name}: an axis has it; leave the argument out")
    found = {name for name in is_given if is_given[name] or name in varied}
    if "exposure" not in found and "dt" in found:
        raise ValueError("dt: only an exposure has it; give exposure, too")
    if found & {"exposure", "taa"}:
        # Its arrays, so that the grid can be sent to other processes.
        return Continued(State(dict(state or {})), is_chain=False)
    if "state" in found:
        raise ValueError("state: only a stage in time continues one; give exposure or taa, too")
    return None


def lay_out(
    grid: Grid,
    renderer: Renderer,
    check: Callable[[Mapping[str, Variable]], object] = lambda variables: None,
) -> Layout:
    """Determine the layout of a grid on a renderer before its points are rendered."""
    variables = _frame_variables(_survey(grid, renderer))
    for axis in grid.axes:
        if axis.name in variables:
            raise ValueError(
                f"framebuffers: {axis.name!r} is an axis of this grid as well; name the "
                "framebuffers to keep without it"
            )
    check(variables)
    if grid.reduce:
        sample = _sample(grid, renderer)
        for name, reduction in grid.reduce.items():
            value = check_value(name, reduction(sample))
            dims = tuple(f"{name}_dim_{number}" for number in range(value.ndim))
            attributes = {"long_name": name, "units": "1"}
            variables[name] = Variable(dims, value.shape, value.dtype, attributes)
    return Layout(ranking(grid), variables, origin(renderer))


def origin(renderer: Renderer) -> dict[str, str]:
    """Return what may change the bits of a result: the adapter, its driver, and the version."""
    return {
        "adapter": renderer.info.name,
        "driver": renderer.info.driver_info or renderer.info.driver,
        "version": installed_version(),
    }


def ranking(grid: Grid) -> tuple[int, ...]:
    """Return the axes from the one whose steps run the most passes to the one with the fewest.

    The sum of all passes is smallest if axes with more passes for a step are slower, whatever their
    numbers of values. Proof: let two adjacent axes a, b have n_a, n_b values and c_a, c_b passes
    for a step. With a as the slower one, the cost is c_a (n_a - 1) + n_a c_b (n_b - 1). This is
    less than for the other order exactly if c_a > c_b.
    """
    costs = [0] * len(grid.axes)
    if sum(len(axis) > 1 for axis in grid.axes) > 1:
        # From both corners, since an axis may have no effect at one of them, such as a field of the
        # blur while the bloom is off.
        for backwards in (False, True):
            steps = list(walk(grid.shape, backwards=backwards))
            passes = _core.dry_run(_plan_points(grid, [index for _, index in steps]))
            for (stepped, _), ran in zip(steps, passes, strict=True):
                if stepped is not None:
                    costs[stepped] += len({name for name, *_ in ran})
    return ranking_of(costs, [axis.kind != "time" for axis in grid.axes])


def _plan_points(grid: Grid, path: list[Index]) -> tuple[tuple[_core.Source, _core.Plan], ...]:
    """Return the points of a path with plans for all framebuffers, so that no pass is fused."""
    points = [grid.point(index) for index in path]
    sources: dict[object, _core.Source] = {}
    planned = []
    for point in points:
        time = point.time, point.moment
        if time not in sources:
            sources[time] = grid.source.for_core(point)
        planned.append((sources[time], _core.plan(sources[time], point.settings, None)))
    return tuple(planned)


def _framebuffers_at(grid: Grid, renderer: Renderer, index: Index) -> Mapping[str, Framebuffer]:
    return grid.source.plan(renderer, grid.point(index).settings).framebuffers


def _survey(grid: Grid, renderer: Renderer) -> Mapping[str, Framebuffer]:
    """Return the framebuffers to keep.

    Plans every value of every axis from the first and from the last corner of the grid, then every
    combination along the axes that change something. Nothing is rendered.
    """
    first = tuple(0 for _ in grid.axes)
    structural: set[int] = set()
    for corner in {first, tuple(count - 1 for count in grid.shape)}:
        basis = _framebuffers_at(grid, renderer, corner)
        for number, axis in enumerate(grid.axes):
            for step in range(len(axis)):
                index = (*corner[:number], step, *corner[number + 1 :])
                if index != corner and _framebuffers_at(grid, renderer, index) != basis:
                    structural.add(number)
                    break
    expected = _framebuffers_at(grid, renderer, first)
    names = tuple(expected) if grid.framebuffers == "all" else grid.framebuffers
    ranges = (range(len(axis)) if i in structural else (0,) for i, axis in enumerate(grid.axes))
    promoted: dict[str, Framebuffer] = dict(expected)
    for index in itertools.product(*ranges):
        planned = _framebuffers_at(grid, renderer, index)
        if grid.framebuffers == "all" and set(planned) != set(expected):
            names = tuple(sorted(set(planned) ^ set(expected)))
        for name in (name for name in names if name in expected or name in planned):
            common = _common(promoted.get(name), planned.get(name))
            if common is None:
                _refuse(grid, name, (first, expected.get(name)), (index, planned.get(name)))
            else:
                promoted[name] = common
    for name in names:
        if name not in expected:
            raise ValueError(f"framebuffers: there is no {name!r} here, only {', '.join(expected)}")
    return {name: promoted[name] for name in names}


def _common(first: Framebuffer | None, second: Framebuffer | None) -> Framebuffer | None:
    """Return a framebuffer that can hold both: floats of the larger dtype; None if there is none.

    uint8 and floats have no common one, since a level is not the same value as a float.
    """
    if first is None or second is None or first[0] != second[0]:
        return None
    if first[1] != second[1] and "u" in (first[1].kind, second[1].kind):
        return None
    return first[0], np.promote_types(first[1], second[1])


def _refuse(
    grid: Grid, name: str, *points: tuple[Index, tuple[tuple[int, ...], np.dtype[Any]] | None]
) -> None:
    """Raise ValueError for a framebuffer that is not the same at two points."""
    (first, _), (second, _) = points
    varied = [number for number, step in enumerate(second) if step != first[number]]
    names = " and ".join(grid.axes[number].name for number in varied)
    reasons = []
    for index, framebuffer in points:
        where = ", ".join(f"{grid.axes[i].name}={grid.axes[i].label(index[i])}" for i in varied)
        what = f"{framebuffer[0]} {framebuffer[1]}" if framebuffer else "not there"
        reasons.append(f"{what} at {where}")
    raise ValueError(
        f"axes: {name} changes its shape or dtype along {names}: {'; '.join(reasons)}; request "
        "framebuffers that are the same at all points, or make a grid for each"
    )


def _frame_variables(framebuffers: Mapping[str, Framebuffer]) -> dict[str, Variable]:
    if not framebuffers:
        return {}
    # Only the shapes are used. Memory that is never touched costs nothing.
    shapes = {name: np.empty(shape, dtype) for name, (shape, dtype) in framebuffers.items()}
    dims = dimensions(shapes)
    lead = leading(shapes)
    frame_variables = {}
    for name, array in shapes.items():
        scale = ", 255 being 1" if array.dtype == np.uint8 else ""
        kind = "Depth" if array.ndim == 2 else "Framebuffer"
        attributes = {
            "long_name": name,
            "units": "1",
            "description": f"{kind} {name}{scale}" + (", the picture" * (name == lead == "final")),
        }
        frame_variables[name] = Variable(dims[name], array.shape, array.dtype, attributes)
    return frame_variables


def _sample(grid: Grid, renderer: Renderer) -> Frames:
    """Render the first point."""
    first = tuple(0 for _ in grid.axes)
    ((_, frames),) = visit(renderer, grid.source, [grid.point(first)], grid.wanted, grid.before)
    return frames


def check_value(name: str, value: Any) -> NDArray[Any]:
    """Convert the value of a reduction to an array of numbers."""
    array = np.asarray(value)
    if array.dtype.kind not in "biuf":
        raise ValueError(f"reduce: {name}: {value!r} is not a number or an array of numbers")
    # One dtype per kind of number, so that all points of a variable have the same.
    widest = {"b": np.bool_, "i": np.int64, "u": np.uint64, "f": np.float64}[array.dtype.kind]
    return array.astype(widest)


def make_dataset(grid: Grid, layout: Layout, arrays: Mapping[str, Any]) -> xarray.Dataset:
    """Return the grid's Dataset with these arrays."""
    xr = import_extra("xarray", "grid", "grid")
    dims = tuple(axis.name for axis in grid.axes)
    facts = {k: v for k, v in grid.source.description.items() if k not in ("images", "sha256")}
    channels = {
        dim: ((dim,), np.array(_CHANNELS[: variable.shape[2]]), {"long_name": "channel"})
        for name, variable in layout.variables.items()
        for dim in variable.dims[2:]
        if name not in grid.reduce
    }
    dataset: xarray.Dataset = xr.Dataset(
        {
            name: ((*dims, *variable.dims), arrays[name], dict(variable.attributes))
            for name, variable in layout.variables.items()
        },
        coords={
            **{axis.name: ((axis.name,), axis.coordinate, axis.attributes) for axis in grid.axes},
            **channels,
        },
        attrs={
            **layout.origin,
            "axes": json.dumps(dims),
            "settings": json.dumps(grid.remaining_settings),
            **({"stages": json.dumps(stages)} if (stages := grid.remaining_stages) else {}),
            "source": json.dumps(facts),
        },
    )
    return dataset
