"""Wrong use and failures of all commands: one line on standard error, a status, and no file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import vkbloom
from tests.grid.stores import contents
from tests.images import noise_image
from tests.io.parts import written
from vkbloom._cli.program import program

pytestmark = pytest.mark.usefixtures("kept_renderers")

oiio = pytest.importorskip("OpenImageIO")

#: The status, the words, and what the line has. What a field refuses is tested with the fields.
ERRORS = """
2 : => Missing command
2 : rendr => No such command 'rendr'; did you mean 'render'?
2 : zzz => No such command 'zzz' (see
2 : a.png out.jpg => is a file, not a command; did you mean program apply?
2 : presets --gpu => No such option '--gpu' (see
2 : adapters more => more
2 : render => Missing option '-o'
2 : render -o x.png --nonsense => --nonsense
2 : render -o - => give --out a file or a folder
2 : render -o out.png --blur-scale 17 => blur_scale: 17.0 is out of range, 0 to 16
2 : render -o out.png --blur-scale wide => '--blur-scale': 'wide'
2 : render -o out.png --loops 1.5 => '--loops': '1.5'
2 : render -o out.png --weights 1,x => '--weights': '1,x' is not A,B,...
2 : render -o out.png --layers 1,2 => layers: ((1.0,), (2.0,)) is not a sequence of pairs
2 : render -o out.png --bloom-size 256 => '--bloom-size': '256' is not WxH|none
2 : render -o out.png --format rgba8 => '--format': 'rgba8' is not rgba8unorm|
2 : render -o out.png --glare rain => '--glare': 'rain': 'rain' is not one of streaks, ghosts,
2 : render -o out.png --glare streaks:base=9 => 'streaks:base=9': base: 9 is out of range, 2 to 8
2 : render -o out.png --glare streaks:base=a => 'streaks:base=a': base: 'a' is not a number
2 : render -o out.png --glare streaks:base => 'streaks:base': 'base' is not NAME=VALUE
2 : render -o out.png --glare godot_dirt:seed=1 => godot_dirt is a published glare, which takes no
2 : render -o out.png --glare Streks => godot_dirt; did you mean 'streaks'?
2 : render -o out.png --psf gaussian => '--psf': 'gaussian': psf: gaussian needs a value for sigma
2 : render -o out.png --psf gauss => '--psf': 'gauss': is neither a file nor one of
2 : render -o out.png --psf spenser => ; did you mean 'spencer'?
2 : render -o out.png --streaks 17 => '--streaks': 17 is not in the range
2 : render -o out.png --tonemap filmic => '--tonemap': 'filmic' is not one of 'none'
2 : render -o out.png --threshold high => '--threshold': 'high' is not float|none
2 : render -o out.png --method box => '--method': unknown method 'box'; available: separable
2 : render -o out.png --method Pyramids => unknown method 'Pyramids'; did you mean 'pyramid'?
2 : render -o out.png --preset kinno => '--preset': unknown preset 'kinno'; did you mean 'kino'?
2 : render -o out.png --treshold 1 => No such option '--treshold'; did you mean '--threshold'?
2 : render -o out.png --framebuffers finl => 'finl'; did you mean 'final'? available: glow
2 : render -o out.png --framebuffers final,glare => unknown framebuffer 'glare'; available: glow
2 : render -o out.png --size 48 => '--size': '48' is not WxH
2 : render -o out.png --size 0x8 => size: (0, 8) is out of range
2 : render -o out.png --time nan => time: nan is out of range
2 : render -o out.png --frames 0 => '--frames': 0 is not in the range x>=1
2 : render -o out.png --camera-fov 180 => fov: 180.0 is out of range, above 0 and below 180
2 : render -o out.png --camera-position 1,2 => position: (1.0, 2.0) is not three numbers
2 : render -o out.png --glow-intensity -1 => glow_intensity: -1.0 is out of range
2 : render -o out.png --shading flat => '--shading': 'flat' is not one of 'forward', 'deferred'
2 : render -o out.png --skybox a.png --skybox b.png => --skybox: given 2 times
2 : render -o out.foo => '.foo'
1 : render -o out.png --scene no.gltf => no.gltf: No such file
1 : render -o out.png --scene bad.gltf => bad.gltf
1 : render -o out.png --glow no.gltf => no.gltf: No such file
1 : render -o out.png --skybox bad.gltf => bad.gltf
1 : render -o none/out.png => none/out_glow.png: there is no folder
1 : render -o out.png --adapter none => no Vulkan adapter for "none"
1 : apply a.exr b.png --adapter none => no Vulkan adapter for "none"
1 : apply no.png b.png => no.png: No such file or directory
2 : apply two b.png => images; name a folder or a pattern
1 : apply f.%04d.exr b.png => f.%04d.exr: no file was found
1 : apply bad.png b.png => bad.png: is not a readable image
1 : apply bad.exr b.png => bad.exr: is not a readable image
1 : apply cut.exr b.png => cut.exr: damaged
1 : apply a.exr b.png --dirt cut.png => cut.png: damaged
1 : apply a.exr b.png --method convolution --psf cut.exr => cut.exr: damaged
1 : apply xyz.exr b.png => xyz.exr: the channels X, Y, Z are not R, G, B or a single one
1 : apply a.exr none/b.png => none/b.png: there is no folder none
1 : apply a.exr b.zfile --composite add => b.zfile: zfile cannot hold this picture
1 : apply a.exr b.png --subimage 1 => a.exr: subimage 1 is not in 0..0
2 : apply a.exr b.png --subimage -1 => --subimage
2 : apply a.exr b.unknown => b.unknown: '.unknown' is not the extension of a writable
2 : apply a.exr b => '' is not the extension of a writable
2 : apply a.exr => Missing argument 'OUT'
2 : apply a.exr b.png c.png => c.png: one file cannot hold 2 images
2 : apply a.exr b.png --levels 3 => the method bevy has no --levels; give --method pyramid or
2 : apply a.exr b.png --input-colour red => --input-colour: colour: 'red' is not linear
2 : apply a.exr b.png --raw => a.exr has float, not 8-bit integers
2 : apply a.exr b.png --raw --input-colour srgb => --raw does not convert colours
2 : apply a.exr b.png --encoding srgb --output-colour srgb => already encodes the output
2 : apply a.exr b.png --framebuffers bloom --no-bloom => framebuffers
2 : apply a.exr b.png --mask small.png => mask: shape (6, 24) is not the image's, (16, 24)
1 : apply a.exr b.png --mask a.png => a.png: a mask must be grey, but this image has colours
2 : apply a.exr b.png --alpha blur => alpha: 'blur' needs an image of 4 channels
2 : apply alpha.png b.png --alpha blur --encoding srgb => encoding
1 : apply a.png b.png --settings a.png => a.png: holds no settings
1 : apply a.png b.png --settings no.json => no.json: No such file or directory
1 : apply a.png b.png --settings {} => {}: method: None is not one of
1 : apply a.png b.png --settings half.json => half.json:
1 : apply a.png b.png --settings x.json => x.json: fields: kino has no 'x'
2 : apply a.png b.png --settings kino.json --preset kino => exclude each other
2 : apply a.png b.png --settings kino.json --method urp => is of the method kino, not urp
2 : apply a.exr out.jpg --bits 16 => jpeg has no numbers of 16 bits
2 : apply a.exr out.exr --bits 8 => openexr has no numbers of 8 bits
2 : apply a.png out.png --quality 90 => quality: png has no quality
2 : apply a.png out.png --view none => view: 'none' is not a view of OpenColorIO's
2 : apply a.png out.png --primaries p3 --raw => leave out --input-colour and --primaries
2 : apply a.png out.avif => this OpenImageIO is built without libheif; PNG can name
2 : apply a.png ./a.png out => two images have the same name
1 : compare no.png a.png => no.png: No such file or directory
1 : compare a.png bad.png => bad.png: is not a readable image
1 : compare a.png b.png --subimage 1 => a.png: subimage 1 is not in 0..0
2 : compare a.png b.png --subimage -1 => --subimage
2 : compare a.png => Missing argument 'B'
2 : compare a.png b.png --min-ssim 2 => ssim: 2.0 is out of range, -1 to 1
2 : compare a.png b.png --min-ssim high => '--min-ssim': 'high'
2 : compare a.png b.png --max-error nan => max_error: nan is out of range
2 : compare a.png b.png --diff d.unknown => '.unknown' is not the extension of a writable
1 : compare a.png b.png --diff none/d.png => none/d.png: there is no folder none
2 : grid a.exr -o g => there is no --axis; give one
2 : grid -o g --axis blur_scale => NAME=FIRST:LAST:COUNT
2 : grid -o g --axis blur_scale=; => NAME=FIRST:LAST:COUNT
2 : grid -o g --axis blur_scale=0:1:2000000 => count 2000000 is not in 1..1000000
2 : grid -o g --axis blur_sale=1 => has no field 'blur_sale'; did you mean 'blur_scale'?
2 : grid -o g --axis radius=1 => has no field
2 : grid -o g --axis blur_scale=1:2 => a range is FIRST:LAST:COUNT
2 : grid -o g --axis blur_scale=1:2:0 => is not in 1..1000000
2 : grid -o g --axis blur_scale=0:2:3:log => above 0
2 : grid -o g --axis blur_scale=0:2:3:lin => 'lin' is not log; a range is FIRST:LAST:COUNT
2 : grid -o g --axis tonemap=nice => is not one of
2 : grid -o g --axis blur_scale=1,99 => blur_scale: 99.0 is out of range
2 : grid -o g --axis loops=1:2:4 => is not an integer
2 : grid -o g --axis preset=kino,fimalent => unknown preset 'fimalent'; did you mean 'filament'?
2 : grid a.exr -o g.zarr --axis exposure=1 --size 3x3 => the source is not a scene
2 : grid a.exr -o g.zarr --axis exposure=1 --size 3 => is not WxH
2 : grid a.exr -o g.zarr --axis exposure=1 --part 3/2 => part: 3 of 2 is not 1 to 2
2 : grid a.exr -o g --axis exposure=0 --axis exposure=1 => exposure is given twice
2 : grid a.exr -o g --axis preset=kino --intensity 0.5 => leave out options of settings
2 : grid a.exr -o g --axis preset=kino,filament --axis levels=1,2 => kino has no field 'levels'
2 : grid a.exr -o g --axis exposure=0:1:600000 --axis knee=0:1:600000 => not in 1..400000
2 : grid a.exr -o g --glare dirt --axis glare.0.image=a.png => has no option
2 : grid a.exr -o g --axis exposure=0 --image-format no => '.no' is not the extension of a writable
2 : grid a.exr -o g.exr --axis exposure=0 => name a folder, and give --image-format exr
2 : grid -o g --axis intensity=0.5,1 --mask a.png => --mask and --emission need an IMAGE
2 : grid a.exr a.png -o g --axis intensity=0.5 => give --preset NAME for all
2 : explore --no-open --mask a.png => --mask and --emission need an IMAGE
2 : explore --no-open a.exr --scene ufo => leave it out with an IMAGE
2 : explore --no-open --size 0x3 => size
1 : explore --no-open no.exr => no.exr
2 : fit a.exr a.exr --vary scatter => vary: the method bevy has no field 'scatter'
2 : fit a.exr a.exr --loss ssim => 'ssim' is not one of 'relative'
2 : translate --to kino => give what to translate: --preset NAME, --method NAME
2 : translate --preset kino => Missing option '--to'
2 : translate --preset kino --to pyramids => 'pyramids'; did you mean 'pyramid'?
2 : translate --preset kino --to pyramid --vary levls => did you mean 'levels'?
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with pictures, damaged files and settings."""
    made = tmp_path_factory.mktemp("errors")
    levels = noise_image(16, 24, 3, dtype="uint8")
    (made / "two").mkdir()
    for name in ("a.png", "b.png", "two/a.png", "two/b.png"):
        vkbloom.write(made / name, levels)
    vkbloom.write(made / "small.png", levels[:6, :, :1])
    vkbloom.write(made / "alpha.png", np.dstack([levels, levels[..., :1]]))
    vkbloom.write(made / "a.exr", noise_image(16, 24, 3))
    spec = oiio.ImageSpec(2, 2, 3, "float")
    spec.channelnames = ("X", "Y", "Z")
    written(made / "xyz.exr", spec, noise_image(2, 2, 3))
    files = {"{}": b"{}", "half.json": b"", "bad.gltf": b"{broken"}
    files["x.json"] = b'{"method": "kino", "x": 1}'
    files["kino.json"] = b'{"method": "kino"}'
    for suffix in ("png", "exr"):
        content = (made / f"a.{suffix}").read_bytes()
        files[f"cut.{suffix}"] = content[: len(content) // 2]
        files[f"bad.{suffix}"] = b"nothing of the kind"
    for name, content in files.items():
        (made / name).write_bytes(content)
    return made


@pytest.fixture
def unchanged(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The working folder, in which nothing changes."""
    monkeypatch.chdir(folder)
    before = contents(folder)
    yield
    assert contents(folder) == before


@pytest.mark.parametrize("row", ERRORS.strip().splitlines())
@pytest.mark.usefixtures("unchanged")
def test_errors_are_one_line_and_leave_nothing(row: str) -> None:
    status, rest = row.split(" : ", 1) if " : =>" not in row else (row[:1], row[4:])
    words, message = rest.split("=> ", 1)
    result = CliRunner().invoke(program, words.split())
    assert result.exit_code == int(status), result.output
    assert all(line.startswith("Rendering on ") for line in result.stdout.splitlines())
    assert result.stderr.startswith("vkbloom: ")
    assert result.stderr.count("\n") == 1
    assert message in result.stderr
