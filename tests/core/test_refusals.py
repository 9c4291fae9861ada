"""Wrong values: each is refused by what checks it, and the message is the one of this table.

Wrong types of all arguments: test_argument_types.py. The core's own: test_core_arguments.py.
"""

from __future__ import annotations

import copy
import functools
import math
import pickle
from collections.abc import Iterator
from decimal import Decimal
from typing import Any

import numpy as np
import pytest

import vkbloom
from tests.framebuffers import mixed
from tests.refusals import assert_refused, rows
from vkbloom import FilamentBloom, Frames, Renderer, Scene, Separable, Settings, _core, presets, psf
from vkbloom._renderer.surface import Surface

SIZE = (16, 9)
SETTINGS = """
Separable(True) -> TypeError: Separable.__init__() takes 1 positional argument but 2 were given
Settings() -> TypeError: Settings is abstract; use a method, such as Separable
Separable(loops=17) -> ValueError: loops: 17 is out of range, 1 to 16
Separable().replace(loops=17) -> ValueError: loops: 17 is out of range, 1 to 16
Separable().replace(levels_of_bloom=3) -> TypeError: Separable has no 'levels_of_bloom'; did you...
Separable(loops=1.5) -> ValueError: loops: 1.5 is not an integer
Separable(bloom=0.5) -> ValueError: bloom: 0.5 is not an integer
Separable(knee=np.array([0.5])) -> TypeError: knee: array([0.5]) is not a number
Separable(knee=np.complex64(1)) -> TypeError: knee: np.complex64(1+0j) is not a number
Separable(knee=Decimal("sNaN")) -> TypeError: knee: Decimal('sNaN') is not a number
Separable(loops=np.array([])) -> TypeError: loops: array([], dtype=float64) is not a number
Separable(composite="ADD") -> ValueError: composite: 'ADD' is not one of ...; did you mean 'add'?
Separable(composite=np.zeros(2)) -> ValueError: composite: array([0., 0.]) is not one of add, mi...
Separable(alpha="") -> ValueError: alpha: '' is not one of keep, max, blur
Separable(tonemap="None") -> ValueError: tonemap: 'None' is not one of ...; did you mean 'none'?
Separable(encoding=["srgb"]) -> ValueError: encoding: ['srgb'] is not one of none, gamma22, srgb...
Separable(texel=np.array("own")) -> ValueError: texel: array('own', dtype='<U3') is not one of o...
Separable(format="rgba8") -> ValueError: format: 'rgba8' is not one of rgba8unorm, rgba16float,...
Separable(bloom_size=(0, 1)) -> ValueError: bloom_size: (0, 1) is out of range, integers of at l...
Separable(bloom_size=(1, 0)) -> ValueError: bloom_size: (1, 0) is out of range, integers of at l...
Separable(bloom_size=(1.5, 2)) -> ValueError: bloom_size: (1.5, 2) is out of range, integers of...
Separable(bloom_size=(math.inf, 1)) -> TypeError: bloom_size: (inf, 1) is not a pair (width, hei...
Separable(bloom_size=(math.nan, 1)) -> TypeError: bloom_size: (nan, 1) is not a pair (width, hei...
Separable(bloom_size=(1,)) -> TypeError: bloom_size: (1,) is not a pair (width, height)
Separable(bloom_size=(1, 2, 3)) -> TypeError: bloom_size: (1, 2, 3) is not a pair (width, height)
Separable(bloom_size="ab") -> TypeError: bloom_size: 'ab' is not a pair (width, height)
Separable(weights=()) -> ValueError: weights: 0 weights are out of range, 1 to 65
Separable(weights=(0.1,) * 66) -> ValueError: weights: 66 weights are out of range, 1 to 65
Separable(weights="abc") -> TypeError: weights: 'abc' is not a sequence of numbers
Separable(weights=(1.0, "x")) -> TypeError: weights: (1.0, 'x') is not a sequence of numbers
Separable(weights=(1.0, None)) -> TypeError: weights: (1.0, None) is not a sequence of numbers
Separable(weights=((1.0, 2.0),)) -> TypeError: weights: ((1.0, 2.0),) is not a sequence of numbers
Separable(weights=(math.nan,)) -> ValueError: weights: nan is out of range, -3.40282e+38 to 3.40...
Separable(weights=(1.0, math.inf)) -> ValueError: weights: inf is out of range, -3.40282e+38 to...
Separable(weights=(10**400,)) -> ValueError: weights: inf is out of range, -3.40282e+38 to 3.402...
Separable(weights=(1e39,)) -> ValueError: weights: 1e+39 is out of range, -3.40282e+38 to 3.4028...
Separable(layers=()) -> ValueError: layers: 0 layers are out of range, 1 to 8
Separable(layers=((1.0, 1.0),) * 9) -> ValueError: layers: 9 layers are out of range, 1 to 8
Separable(layers="abc") -> TypeError: layers: ('a',) is not a sequence of numbers
Separable(layers=(1.0, 1.0)) -> TypeError: layers: (1.0, 1.0) is not a sequence of pairs (scale,...
Separable(layers=((1.0,),)) -> ValueError: layers: ((1.0,),) is not a sequence of pairs (scale,...
Separable(layers=((1.0, 1.0, 1.0),)) -> ValueError: layers: ((1.0, 1.0, 1.0),) is not a sequence...
Separable(layers=((1.0, "x"),)) -> TypeError: layers: (1.0, 'x') is not a sequence of numbers
Separable(layers=((math.nan, 1.0),)) -> ValueError: layers: nan is out of range, -3.40282e+38 to...
Separable(layers=((1.0, math.inf),)) -> ValueError: layers: inf is out of range, -3.40282e+38 to...
Separable(layers=((1.0, 1e39),)) -> ValueError: layers: 1e+39 is out of range, -3.40282e+38 to 3...
Separable(layers=((-0.1, 1.0),)) -> ValueError: layers: ((-0.1, 1.0),) has a number out of range...
Separable(layers=((16.1, 1.0),)) -> ValueError: layers: ((16.1, 1.0),) has a number out of range...
gaussian_weights(0.0) -> ValueError: sigma: 0.0 is out of range, above 0
gaussian_weights(-1.0) -> ValueError: sigma: -1.0 is out of range, above 0
gaussian_weights(math.nan) -> ValueError: sigma: nan is out of range, above 0
gaussian_weights(math.inf) -> ValueError: sigma: inf is out of range, above 0
gaussian_weights(10**400) -> ValueError: sigma: 1...
gaussian_weights(1.0, -1) -> ValueError: radius: -1 is out of range, 0 to 64
gaussian_weights(1.0, 65) -> ValueError: radius: 65 is out of range, 0 to 64
gaussian_weights(np.array([1.0, 2.0])) -> TypeError: sigma: array([1., 2.]) is not a number
gaussian_weights(1.0, 2.5) -> TypeError: radius: 2.5 is not an integer
setattr(Separable(), "blur_scale", 3.0) -> FrozenInstanceError: cannot assign to field 'blur_scale'
"""
NAMES = """
Pyramid(treshold=1) -> TypeError: Pyramid has no 'treshold'; did you mean 'threshold'?
Pyramid().replace(scatter=0.3) -> TypeError: Pyramid has no 'scatter', which urp, hdrp have
UrpBloom().replace(Scater=0.3) -> TypeError: UrpBloom has no 'Scater'; did you mean 'scatter'?
Streaks(direction=4) -> TypeError: Streaks has no 'direction'; did you mean 'directions'?
psf.gaussian(sgma=2) -> TypeError: gaussian has no 'sgma'; did you mean 'sigma'?
Settings.from_dict({"method": "pyramid", "treshold": 1})
    -> ValueError: fields: pyramid has no 'treshold'; did you mean 'threshold'?
Settings.from_dict({"method": "piramid"}) -> ValueError: method: 'piramid' is not one of ...; di...
psf.PSF.from_dict({"psf": "gausian", "sigma": 1}) -> ValueError: psf: 'gausian' is not one of...
Pyramid(composite="scren") -> ValueError: composite: 'scren' is not one of ...; did you mean 'sc...
Pyramid(glare="anamorfic") -> ValueError: glare: 'anamorfic' is not one of ...; did you mean 'an...
presets["urp"] -> KeyError: unknown preset 'urp'; did you mean 'unity_urp'? available: tutorial,...
glares["Anamorphic"]
    -> KeyError: unknown glare 'Anamorphic'; did you mean 'anamorphic'? available: filament_flare...
presets.tutorialx -> AttributeError: unknown preset 'tutorialx'; did you mean 'tutorial'? availa...
glares.anamorphicx
    -> AttributeError: unknown glare 'anamorphicx'; did you mean 'anamorphic'? available: filamen...
renderer.apply(image, "Kno") -> ValueError: settings: unknown preset 'Kno'; did you mean 'kino'?...
renderer.apply(image, "pyramid") -> ValueError: settings: 'pyramid' is a method; give vkbloom.Py...
renderer.apply(image, Pyramid) -> TypeError: settings: <class 'vkblo...hain.Pyramid'> is not a S...
renderer.apply(image, {"levels": 3}) -> TypeError: settings: {'levels': 3} is not a Settings; gi...
renderer.apply(image, "?") -> ValueError: settings: unknown preset '?'; available: tutorial, ...
renderer.plan(image, "Kno") -> ValueError: settings: unknown preset 'Kno'; did you mean 'kino'?...
render("Kno") -> ValueError: settings: unknown preset 'Kno'; did you mean 'kino'? available: tut...
renderer.map([image], "Kno") -> ValueError: settings: unknown preset 'Kno'; did you mean 'kino'?...
next(renderer.sweep(image, ["Kno"])) -> ValueError: settings[0]: unknown preset 'Kno'; did you m...
vjp(image, "Kno") -> ValueError: settings: unknown preset 'Kno'; did you mean 'kino'? available:...
grid(image, "Kno", {"intensity": [1]}) -> ValueError: settings: unknown preset 'Kno'; did you me...
vkbloom.apply(image, "kino", blur_scale=2, renderer=renderer)
    -> TypeError: KinoBloom has no 'blur_scale'; did you mean 'bloom_scale'?
renderer.apply(image, framebuffers=["blom"])
    -> ValueError: framebuffers: unknown framebuffer 'blom'; did you mean 'bloom'? available: glo...
renderer.map([image], framebuffers=["blom"])
    -> ValueError: framebuffers: unknown framebuffer 'blom'; did you mean 'bloom'? available: glo...
renderer.apply(image, framebuffers=["bloom", "final"])["blom"]
    -> KeyError: unknown framebuffer 'blom'; did you mean 'bloom'? available: bloom, final
grid(image, Pyramid(), {"intensty": [1]})
    -> ValueError: axes: 'intensty' is not a field of the method pyramid; did you mean 'intensity...
fit(image + 1, image + 1, Pyramid(), ["intensty"])
    -> ValueError: vary: the method pyramid has no field 'intensty'; did you mean 'intensity'? it...
"""
CALLS = """
renderer.render(None) -> TypeError: scene: a Scene is needed, not NoneType
renderer.render(Scene) -> TypeError: scene: a Scene is needed, not type
render(5) -> TypeError: settings: 5 is not a Settings
render(None, (0, 1)) -> ValueError: size: (0, 1) is out of range, integers of at least 1
render(None, (1, 0)) -> ValueError: size: (1, 0) is out of range, integers of at least 1
render(None, (1.5, 2)) -> TypeError: size: (1.5, 2) is not a sequence, tuple[int, int]
render(None, (2**31, 1)) -> ValueError: size: (2147483648, 1) is out of range, integers of at le...
render(None, (2**64, 1)) -> ValueError: size: (18446744073709551616, 1) is out of range, integer...
render(None, (10**400, 1)) -> ValueError: size: (1...
render(None, (math.inf, 1)) -> TypeError: size: (inf, 1) is not a sequence, tuple[int, int]
render(None, (1,)) -> TypeError: size: (1,) is not a sequence, tuple[int, int]
render(None, ("a", 1)) -> TypeError: size: ('a', 1) is not a sequence, tuple[int, int]
render(None, "ab") -> TypeError: size: 'ab' is not a sequence, tuple[int, int]
render(None, (100_000, 1)) -> ValueError: size: a size of 100000 x 1 is out of this adapter's ra...
render(None, (1, 100_000)) -> ValueError: size: a size of 1 x 100000 is out of this adapter's ra...
render(Separable(bloom_size=(100_000, 1)))
    -> ValueError: bloom_size: a size of 100000 x 1 is out of this adapter's range, 1 to ... a si...
render(Separable(bloom_size=(1, 100_000), direct=True))
    -> ValueError: bloom_size: a size of 1 x 100000 is out of this adapter's range, 1 to ... a si...
render(Separable(bloom_scale=4.0), (10_000, 1))
    -> ValueError: glow: a size of 40000 x 4 is out of this adapter's range, 1 to ... a side; it...
render(time=math.nan) -> ValueError: time: nan is out of range, finite numbers
render(time=-math.inf) -> ValueError: time: -inf is out of range, finite numbers
render(time=10**400) -> ValueError: time: 1...
render(time=np.array([1.0])) -> TypeError: time: array([1.]) is not a number
grid(scene, None, {"exposure": [0.0]}, size=(8, 8), time=math.nan)
    -> ValueError: time: nan is out of range, finite numbers
grid(scene, None, {"time": [0.0, math.nan]}, size=(8, 8))
    -> ValueError: time: nan is out of range, finite numbers
grid(scene, None, {"time": [0.0, "1"]}, size=(8, 8)) -> TypeError: time: '1' is not a number
render(shading="Forward") -> ValueError: shading: 'Forward' is not one of forward, deferred
render(None, (8, 8), "forward") -> TypeError: Renderer.render() takes from 2 to 4 positional arg...
render(colour="red") -> TypeError: Renderer.render() got an unexpected keyword argument 'colour'
render(framebuffers=("final", ""))
    -> ValueError: framebuffers: unknown framebuffer ''; available: glow, glow_depth, blur_vertic...
render(framebuffers=("final", "Final"))
    -> ValueError: framebuffers: unknown framebuffer 'Final'; did you mean 'final'? available: gl...
render(framebuffers=("final", "blur_horizontal_0_0"))
    -> ValueError: framebuffers: unknown framebuffer 'blur_horizontal_0_0'; available: glow, glow...
render(Separable(loops=2), framebuffers="blur_horizontal_0_0")
    -> ValueError: framebuffers: unknown framebuffer 'blur_horizontal_0_0'; available: glow, glow...
render(Separable(bloom=False), framebuffers="bloom")
    -> ValueError: framebuffers: unknown framebuffer 'bloom'; available: scene, depth, final
render(Separable(bloom=False), framebuffers="glow")
    -> ValueError: framebuffers: unknown framebuffer 'glow'; available: scene, depth, final
render(Separable(direct=True), framebuffers="blur_vertical")
    -> ValueError: framebuffers: unknown framebuffer 'blur_vertical'; available: glow, glow_depth...
render(framebuffers=5) -> TypeError: framebuffers: 5 is not a str or a sequence, Sequence[str]
render(framebuffers=[5]) -> TypeError: framebuffers: [5] is not a str or a sequence, Sequence[str]
render(framebuffers=[b"final"]) -> TypeError: framebuffers: [b'final'] is not a str or a sequenc...
render(framebuffers=["\\ud800"]) -> UnicodeEncodeError: 'utf-8' codec can't encode character...
render(framebuffers=["x" * 100_000])
    -> ValueError: framebuffers: unknown framebuffer 'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...
render(out=5) -> TypeError: out: 5 is not a mapping, Mapping[str, Any]
render(out=[1]) -> TypeError: out: [1] is not a mapping, Mapping[str, Any]
render(framebuffers="final", out={"nothing": image})
    -> ValueError: out: 'nothing' is not among the framebuffers: final
render(framebuffers="final", out={"depth": image}) -> ValueError: out: 'depth' is not among the...
filled(None) -> TypeError: out: final must be an array, not NoneType
filled([1]) -> TypeError: out: final must be an array, not list
filled(bytearray(10)) -> TypeError: out: final must be an array, not bytearray
filled(u8(16, 9, 4)) -> ValueError: out: final has shape (16, 9, 4) and dtype uint8, it must hav...
filled(u8(9, 16, 3)) -> ValueError: out: final has shape (9, 16, 3) and dtype uint8, it must hav...
filled(np.zeros(9 * 16 * 4, np.uint8)) -> ValueError: out: final has shape (576,) and dtype uint...
filled(u8(0, 0, 4)) -> ValueError: out: final has shape (0, 0, 4) and dtype uint8, it must have...
filled(u8(10, 16, 4)) -> ValueError: out: final has shape (10, 16, 4) and dtype uint8, it must h...
filled(np.zeros((9, 16, 4), np.int8)) -> ValueError: out: final has shape (9, 16, 4) and dtype i...
filled(np.zeros((9, 16, 4), np.float32)) -> ValueError: out: final has shape (9, 16, 4) and dtyp...
filled(np.zeros((9, 16, 4), object)) -> ValueError: out: final has shape (9, 16, 4) and dtype ob...
filled(np.zeros((9, 16, 4), np.uint8, order="F")) -> ValueError: out: final must be C-contiguous...
filled(u8(18, 16, 4)[::2]) -> ValueError: out: final must be C-contiguous and writeable
filled(u8(9, 16, 4)[::-1]) -> ValueError: out: final must be C-contiguous and writeable
filled(np.broadcast_to(np.uint8(0), (9, 16, 4))) -> ValueError: out: final must be C-contiguous...
filled(np.frombuffer(bytes(576), np.uint8).reshape(9, 16, 4))
    -> ValueError: out: final must be C-contiguous and writeable
render(size=(16, 9), out={"depth": np.zeros((9, 16), np.dtype("f4").newbyteorder())})
    -> ValueError: out: depth has shape (9, 16) and dtype >f4, it must have (9, 16) and float32
renderer.plan(image, size=(16, 9)) -> ValueError: size: the source is not a scene; leave the arg...
renderer.plan(image, shading="deferred") -> ValueError: shading: the source is not a scene; leav...
renderer.plan(image, framebuffers=("glare",))
    -> ValueError: framebuffers: unknown framebuffer 'glare'; available: glow, down_0, down_1, do...
renderer.plan(image, Separable(bloom_size=(100_000, 1)))
    -> ValueError: bloom_size: a size of 100000 x 1 is out of this adapter's range, 1 to ... a si...
renderer.plan(scene, shading="toon") -> ValueError: shading: 'toon' is not one of forward, deferred
renderer.plan(scene, size=(0, 9)) -> ValueError: size: (0, 9) is out of range, integers of at le...
renderer.plan(None) -> TypeError: source: a Scene is needed, not NoneType
renderer.plan([image]) -> TypeError: source: a Scene is needed, not list
renderer.plan("image") -> TypeError: source: a Scene is needed, not str
renderer.plan(image.astype(np.int64)) -> TypeError: source: dtype int64 is not one of uint8, flo...
renderer.upload(u8(4, 4)) -> ValueError: image: shape (4, 4) is not (H, W, 3) or (H, W, 4) with...
renderer.upload(np.zeros((4, 4, 3), np.uint16))
    -> TypeError: image: dtype uint16 is not one of uint8, float16, float32, float64; convert it:...
renderer.upload(u8(1, 1 << 20, 3)) -> ValueError: image: a size of 1048576 x 1 is out of this ad...
renderer.upload(renderer.upload(image)) -> TypeError: image: the image was uploaded already; pas...
copy.copy(renderer.upload(image)) -> TypeError: an Image cannot be copied or pickled; it is on o...
copy.deepcopy(renderer.upload(image)) -> TypeError: an Image cannot be copied or pickled; it is...
pickle.dumps(renderer.upload(image)) -> TypeError: an Image cannot be copied or pickled; it is o...
renderer.apply(renderer.upload(image), mask=np.ones((9, 16), np.float32))
    -> ValueError: mask: the image was uploaded already; upload it together with its mask
renderer.apply(renderer.upload(image), emission=image)
    -> ValueError: emission: the image was uploaded already; upload it together with its emission
renderer.map(image) -> TypeError: images: ndarray is not an iterable of images; for one image, c...
renderer.map(7) -> TypeError: images: int is not an iterable of images; for one image, call appl...
renderer.map([image], [Separable()] * 2) -> ValueError: settings: 2 Settings do not match the 1...
renderer.map([image], 3) -> TypeError: settings: 3 is not a Settings
renderer.map([image], [Separable(), 3]) -> TypeError: settings[1]: 3 is not a Settings
renderer.map([image], framebuffers=3) -> TypeError: framebuffers: 3 is not a str or a sequence,...
list(renderer.map((image for _ in range(2)), [Separable()]))
    -> ValueError: settings: 1 Settings are fewer than the images
list(renderer.map((image for _ in range(2)), [Separable()] * 3))
    -> ValueError: settings: 3 Settings are more than the 2 images
renderer.sweep(image, Separable())
    -> TypeError: settings: Separable(bloom=True, threshold=None, knee=0.0, composite='add', inte...
renderer.sweep([[0.0]], [Separable()]) -> TypeError: source: a Scene is needed, not list
renderer.sweep(image, [Separable()], framebuffers=[[0.0]])
    -> TypeError: framebuffers: [[0.0]] is not a str or a sequence, Sequence[str]
renderer.sweep(scene, [Separable()], shading=[[0.0]])
    -> ValueError: shading: [[0.0]] is not one of forward, deferred
copy.copy(renderer) -> TypeError: a Renderer cannot be copied or pickled; create another one
"""
OTHERS = """
other.apply(handle) -> ValueError: image: it was uploaded to another renderer, or to one that is...
other.plan(handle) -> ValueError: image: it was uploaded to another renderer, or to one that is...
next(other.map([handle])) -> ValueError: image: it was uploaded to another renderer, or to one t...
renderer.apply(of_closed) -> ValueError: image: it was uploaded to another renderer, or to one t...
closed.apply(of_closed) -> ValueError: the renderer is closed
closed.plan(of_closed) -> ValueError: the renderer is closed
closed.apply(image) -> ValueError: the renderer is closed
closed.plan(image) -> ValueError: the renderer is closed
closed.upload(image) -> ValueError: the renderer is closed
closed.map([image]) -> ValueError: the renderer is closed
closed.sweep(image, [Separable()]) -> ValueError: the renderer is closed
closed.render(scene) -> ValueError: the renderer is closed
closed.render(scene, framebuffers=()) -> ValueError: the renderer is closed
closed.__enter__() -> ValueError: the renderer is closed
closed._core.pages(1 << 20) -> ValueError: the renderer is closed
closed._core.plan(_core.image_source(image), Separable(), None)
    -> ValueError: the renderer is closed
Surface(closed) -> ValueError: the renderer is closed
Renderer("") -> ValueError: adapter: "" is not a part of a name; use "auto" for the best adapter
Renderer("%s%n%d")
    -> AdapterNotFoundError: no Vulkan adapter for "%s%n%d"; found: ...
Renderer("x" * 5000)
    -> AdapterNotFoundError: no Vulkan adapter for "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...
Renderer("lav\\0apipe") -> ValueError: embedded null character
frames_of({"final": [[1.0]]}) -> TypeError: arrays['final']: list is not a NumPy array
frames_of({3: u8(1, 1, 3)}) -> TypeError: arrays: 3 is not a name; use a str
frames_of({"../final": u8(1, 1, 3)}) -> ValueError: arrays: '../final' is not an identifier, as...
frames_of({"final": np.zeros((2, 2, 3))})
    -> ValueError: arrays['final']: float64 of shape (2, 2, 3) is neither an image, (H, W, 3) or...
frames_of({"final": u8(2, 2, 2)})
    -> ValueError: arrays['final']: uint8 of shape (2, 2, 2) is neither an image, (H, W, 3) or (H...
frames_of({"final": np.zeros((2, 2, 1), np.float32)})
    -> ValueError: arrays['final']: float32 of shape (2, 2, 1) is neither an image, (H, W, 3) or...
frames_of({"final": u8(0, 2, 3)})
    -> ValueError: arrays['final']: uint8 of shape (0, 2, 3) is neither an image, (H, W, 3) or (H...
frames_of({"depth": u8(2, 2)})
    -> ValueError: arrays['depth']: uint8 of shape (2, 2) is neither an image, (H, W, 3) or (H, W...
frames_of({"depth": np.zeros((2, 2), np.float16)})
    -> ValueError: arrays['depth']: float16 of shape (2, 2) is neither an image, (H, W, 3) or (H,...
frames["bloom"] -> KeyError: unknown framebuffer 'bloom'; available: glow, glow_depth, blur_vert...
Surface(renderer, "x") -> TypeError: window: 'x' is not a glfw window or None
Surface(renderer, size=(0, 1)) -> ValueError: size: (0, 1) is out of range, integers of at least 1
"""


@pytest.fixture(scope="module")
def names(renderer: Renderer, scene: Scene) -> Iterator[dict[str, Any]]:
    """The names that the tables use."""
    image = np.zeros((9, 16, 4), np.float32)
    closed = Renderer()
    of_closed = closed.upload(image)
    closed.close()
    public = {name: getattr(vkbloom, name) for name in vkbloom.__all__}
    on_renderer = {
        name: functools.partial(public[name], renderer=renderer) for name in ("fit", "grid", "vjp")
    }
    render = functools.partial(renderer.render, scene)
    with Renderer() as other:
        yield {
            **public,
            **on_renderer,
            **{"vkbloom": vkbloom, "np": np, "math": math, "copy": copy, "pickle": pickle},
            **{"Decimal": Decimal, "psf": psf, "_core": _core, "Surface": Surface},
            **{"renderer": renderer, "other": other, "closed": closed, "of_closed": of_closed},
            **{"frames": mixed(), "image": image, "scene": scene},
            "handle": renderer.upload(image),
            "render": render,
            "filled": lambda array: render(size=SIZE, out={"final": array}),
            "frames_of": functools.partial(Frames, timings={}, settings=Separable(), info={}),
            "u8": lambda *shape: np.zeros(shape, np.uint8),
        }


@pytest.mark.parametrize(("call", "error"), rows(SETTINGS + NAMES + OTHERS))
def test_a_wrong_value_is_refused(names: dict[str, Any], call: str, error: str) -> None:
    assert_refused(call, error, names)


@pytest.fixture(scope="module")
def right(scene: Scene) -> Frames:
    with Renderer() as renderer:
        return renderer.render(scene, None, SIZE)


@pytest.mark.parametrize(("call", "error"), rows(CALLS))
def test_a_refused_call_leaves_the_renderer_usable(
    names: dict[str, Any], right: Frames, call: str, error: str
) -> None:
    assert_refused(call, error, names)
    for name, array in names["render"](None, SIZE).items():
        np.testing.assert_array_equal(array, right[name])


@pytest.mark.parametrize("settings", [*presets.values(), FilamentBloom(resolution=2048)])
def test_sizes_whose_levels_would_overflow(
    renderer: Renderer, scene: Scene, settings: Settings
) -> None:
    """Once a loop without an end: a level of 2^31 pixels, twice as wide, is not 0 pixels wide."""
    for size in ((2**20, 1), (2**31 - 1, 1), (1, 2**31 - 1)):
        with pytest.raises(ValueError, match=rf"^size: a size of {size[0]} x {size[1]} "):
            renderer.render(scene, settings, size)
        with pytest.raises(ValueError, match=rf"bloom_size: a size of {size[0]} x {size[1]} "):
            renderer.render(scene, settings.replace(bloom_size=size), SIZE)


def test_a_mistake_before_the_first_frame(scene: Scene, right: Frames) -> None:
    with Renderer(validation=True) as renderer:
        with pytest.raises(ValueError, match="framebuffers"):
            renderer.render(scene, None, SIZE, framebuffers="nope")
        np.testing.assert_array_equal(renderer.render(scene, None, SIZE)["final"], right["final"])


@pytest.mark.parametrize(
    ("name", "base"),
    [
        ("AdapterNotFoundError", RuntimeError),
        ("DeviceLostError", Exception),
        ("OutOfMemoryError", MemoryError),
        ("ValidationError", Exception),
        ("ShaderError", Exception),
    ],
)
def test_the_tree_of_exceptions(name: str, base: type[Exception]) -> None:
    error = getattr(vkbloom, name)
    assert issubclass(error, vkbloom.Error)
    assert issubclass(error, base)
    assert not issubclass(error, ValueError)
    assert (error.__name__, error("text").vk_call, error("text").vk_result) == (name, None, None)
    assert error.__doc__
