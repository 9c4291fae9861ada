"""``vkbloom apply`` of videos, and `vkbloom.sequence`: code values, tags, times, audio, damage."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

import vkbloom
from tests.cli.calls import one_line, run
from tests.processes import output

av = pytest.importorskip("av")
pytest.importorskip("OpenImageIO")

pytestmark = pytest.mark.usefixtures("kept_renderers")

WIDTH, HEIGHT = 24, 16
RATE = Fraction(24)
#: Of QuickTime and H.273: a quarter turn clockwise, and mirrored left to right.
CLOCKWISE = (0, 65536, 0, -65536, 0, 0, 0, 0, 1 << 30)
MIRRORED = (-65536, 0, 0, 0, 65536, 0, 0, 0, 1 << 30)


class Clip(NamedTuple):
    """A frame of a video: planes, tags (primaries, curve, matrix, range), time, format."""

    planes: list[NDArray[Any]]
    tags: tuple[int, ...]
    time: Fraction
    format: str


def gradient(name: str, number: int) -> list[NDArray[Any]]:
    """Return planes inside the gamut."""
    frame = av.VideoFrame(WIDTH, HEIGHT, name)
    scale = 4 if "10" in name else 1
    planes = []
    for index, plane in enumerate(frame.planes):
        y, x = np.mgrid[0 : plane.height, 0 : plane.width]
        luma, blue = 70 + 90 * x / plane.width + 10 * number, 118 + 20 * y / plane.height
        values = (luma, blue, 120 + 16 * x / plane.width)[index] * scale
        planes.append(np.rint(values).astype(np.uint8 if scale == 1 else np.uint16))
    return planes


def write_clip(
    path: Path,
    codec: str,
    name: str,
    tags: Sequence[int] = (1, 1, 1, 1),
    *,
    count: int = 3,
    times: Sequence[int] | None = None,
    matrix: Sequence[int] | None = None,
    audio: bool = False,
    planes: Callable[[str, int], list[NDArray[Any]]] = gradient,
) -> Path:
    """Write a video by PyAV alone; `times` in units of a 24th."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, RATE)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, name
        context = stream.codec_context
        context.color_primaries, context.color_trc, context.colorspace, context.color_range = tags
        if matrix is not None:
            stream.set_display_matrix(matrix)
        sound: Any = container.add_stream("aac", rate=48000, layout="mono") if audio else None
        container.start_encoding()
        for number in range(count):
            frame = av.VideoFrame(WIDTH, HEIGHT, name)
            for plane, values in zip(frame.planes, planes(name, number), strict=True):
                rows = np.frombuffer(plane, np.uint8).reshape(-1, plane.line_size)
                content = np.ascontiguousarray(values).view(np.uint8)
                rows[: plane.height, : content.shape[1]] = content
            frame.pts, frame.time_base = (times or range(count))[number], 1 / RATE
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
        for number in range(2 * count if sound is not None else 0):
            samples = av.AudioFrame("fltp", "mono", 1024)
            samples.sample_rate, samples.pts = 48000, number * 1024
            samples.time_base = Fraction(1, 48000)
            samples.planes[0].update(np.zeros(1024, np.float32).tobytes())
            container.mux(sound.encode(samples))
        if sound is not None:
            container.mux(sound.encode())
    return path


def read_clip(path: Path) -> list[Clip]:
    """Return the frames of a video as PyAV has them."""
    clips = []
    with av.open(str(path)) as container:
        for frame in container.decode(video=0):
            dtype = np.dtype(np.uint16 if "10" in frame.format.name else np.uint8)
            planes = [
                np.frombuffer(plane, np.uint8)
                .reshape(-1, plane.line_size)
                .view(dtype)[: plane.height, : plane.width]
                .astype(int)
                for plane in frame.planes
            ]
            tags = frame.color_primaries, frame.color_trc, frame.colorspace, frame.color_range
            time = Fraction(frame.pts * frame.time_base)
            clips.append(Clip(planes, (*map(int, tags),), time, frame.format.name))
    return clips


def apply(source: object, target: Path, *options: object) -> None:
    """Copy a video, or more, by the command; that must succeed."""
    result = run("apply", source, "-o", target, "-q", *options)
    assert (result.exit_code, result.stderr) == (0, "")


def command(source: Path, target: Path) -> list[str]:
    """Return the words of `apply` as a process of its own."""
    words = ("-m", "vkbloom", "apply", str(source), "-o", str(target), "-q")
    return [sys.executable, *words]


PQ, HLG = (9, 16, 9, 1), (9, 18, 9, 1)


@pytest.mark.parametrize(
    ("codec", "name", "tags", "suffix"),
    [
        ("ffv1", "yuv420p", (1, 1, 1, 1), "mkv"),
        ("ffv1", "yuv420p10le", PQ, "mkv"),
        ("ffv1", "yuv444p10le", HLG, "mkv"),
        ("ffv1", "yuv422p", (1, 13, 5, 2), "mkv"),
        ("libx264", "yuv420p", (6, 6, 6, 1), "mp4"),
        ("libx264", "yuv444p", (1, 1, 1, 2), "mov"),
        ("libx265", "yuv420p10le", HLG, "mp4"),
    ],
)
def test_code_values_and_tags_are_kept(
    tmp_path: Path, codec: str, name: str, tags: tuple[int, ...], suffix: str
) -> None:
    source, target = tmp_path / f"in.{suffix}", tmp_path / f"out.{suffix}"
    write_clip(source, codec, name, tags)
    before = read_clip(source)
    apply(source, target, "--no-bloom", *(["--quality", 100] if suffix != "mkv" else []))
    after = read_clip(target)
    assert len(after) == len(before) == 3
    for one, other in zip(before, after, strict=True):
        assert (other.tags, other.time, other.format) == (tags, one.time, one.format)
        for old, new in zip(one.planes, other.planes, strict=True):
            assert np.abs(old - new).max() <= 1


@pytest.mark.parametrize("number", [1, 9])
def test_the_matrix_is_that_of_the_recommendation(tmp_path: Path, number: int) -> None:
    # Rec. ITU-R BT.709-6, item 3.2, and BT.2020-2, table 4: of red, 1, 0, 0 in narrow range.
    red_share, blue_share = {1: (0.2126, 0.0722), 9: (0.2627, 0.0593)}[number]
    codes = (16 + 219 * red_share, 128 - 112 * red_share / (1 - blue_share), 128 + 112)

    def red(name: str, _: int) -> list[NDArray[Any]]:
        ones = np.ones((HEIGHT, WIDTH))
        return [np.rint(ones * code).astype(np.uint8) for code in codes]

    # Linear light, with the primaries of Rec. 709: colours stay as they are.
    clip = write_clip(tmp_path / "a.mkv", "ffv1", "yuv444p", (1, 8, number, 1), planes=red)
    frames = vkbloom.sequence(clip, vkbloom.Separable(bloom=False), framebuffers="final")
    np.testing.assert_allclose(frames[0]["final"][0, 0], (1, 0, 0), atol=0.006)


def test_curves_are_those_of_images(tmp_path: Path) -> None:
    # PQ: 1 is 203 cd/m2, the signal 0.581 (Rec. ITU-R BT.2408), in narrow range of 10 bits.
    def white(name: str, _: int) -> list[NDArray[Any]]:
        code, sides = round(64 + 876 * 0.5807), [(HEIGHT, WIDTH), *[(HEIGHT // 2, WIDTH // 2)] * 2]
        return [np.full(side, code if not n else 512, np.uint16) for n, side in enumerate(sides)]

    clip = write_clip(tmp_path / "a.mkv", "ffv1", "yuv420p10le", PQ, planes=white)
    frames = vkbloom.sequence(clip, framebuffers="final", intensity=0)
    assert frames.settings.method == "bevy"
    np.testing.assert_allclose(frames[0]["final"], 1, rtol=0.01)


@pytest.mark.parametrize("suffix", ["mp4", "mkv"])
def test_times_that_vary_are_kept(tmp_path: Path, suffix: str) -> None:
    source = write_clip(tmp_path / "in.mp4", "libx264", "yuv420p", count=4, times=[0, 1, 3, 7])
    apply(source, tmp_path / f"out.{suffix}")
    # Matroska counts milliseconds.
    tolerance = 5e-4 if suffix == "mkv" else 0
    for before, after in zip(read_clip(source), read_clip(tmp_path / f"out.{suffix}"), strict=True):
        assert abs(before.time - after.time) <= tolerance
    sequence = vkbloom.sequence(source, framebuffers="final")
    assert len(sequence) == 4
    times = [frames.info["time"] for frames in sequence]
    np.testing.assert_allclose(times, np.array([0, 1, 3, 7]) / 24, atol=1e-9)
    assert sequence[-1].info["time"] == times[-1]


@pytest.mark.parametrize("matrix", [CLOCKWISE, MIRRORED])
def test_frames_are_upright(tmp_path: Path, matrix: tuple[int, ...]) -> None:
    plain = write_clip(tmp_path / "a.mkv", "ffv1", "yuv444p")
    turned = write_clip(tmp_path / "b.mkv", "ffv1", "yuv444p", matrix=matrix)
    before, after = (
        vkbloom.sequence(clip, framebuffers="final", intensity=0)[0]["final"]
        for clip in (plain, turned)
    )
    upright = np.rot90(before, -1) if matrix is CLOCKWISE else before[:, ::-1]
    np.testing.assert_array_equal(after, upright)
    apply(turned, tmp_path / "c.mkv", "--no-bloom")
    assert read_clip(tmp_path / "c.mkv")[0].planes[0].shape == upright.shape[:2]


def test_audio_is_copied(tmp_path: Path) -> None:
    source = write_clip(tmp_path / "in.mp4", "libx264", "yuv420p", audio=True)
    apply(source, tmp_path / "out.mp4")

    def packets(path: Path) -> list[tuple[bytes, Any]]:
        with av.open(str(path)) as container:
            return [(bytes(packet), packet.pts) for packet in container.demux(audio=0)]

    assert packets(source) == packets(tmp_path / "out.mp4") != []
    result = run("apply", source, "-o", tmp_path / "b.mp4", "--fps", 12)
    assert "its audio is left out" in result.stderr


def test_images_to_a_video_and_back(tmp_path: Path) -> None:
    levels = np.random.default_rng(3).integers(0, 256, (2, HEIGHT, WIDTH, 3), np.uint8)
    for number, picture in zip((5, 8), levels, strict=True):
        vkbloom.write(tmp_path / f"f.{number:03d}.png", picture)
    natural = ("--no-bloom", "--preset", "bevy_natural")
    result = run(
        "apply", tmp_path / "f.%03d.png", "-o", tmp_path / "a.mkv", *natural, "--fps", "23.976"
    )
    assert result.exit_code == 0
    assert "2 of 4 frames are missing: 6 to 7" in result.stderr
    clip = read_clip(tmp_path / "a.mkv")
    # Numbers that are missing are time. sRGB, as the images are.
    assert clip[1].time == Fraction(round(Fraction(3003, 24000) * 1000), 1000)
    assert clip[0].tags == (1, 13, 0, 2)
    apply(tmp_path / "a.mkv", tmp_path / "g.%02d.png", *natural)
    for old, new in (("f.005.png", "g.00.png"), ("f.008.png", "g.01.png")):
        back, before = (vkbloom.read(tmp_path / name) for name in (new, old))
        np.testing.assert_array_equal(back, before)
    (tmp_path / "f.005.png").unlink()
    colours = ("--output-colour", "pq", "--primaries", "rec2020")
    apply(tmp_path / "f.%03d.png", tmp_path / "b.mp4", *colours)
    (frame,) = read_clip(tmp_path / "b.mp4")
    assert (frame.tags, frame.format) == (PQ, "yuv420p10le")


def test_a_video_that_is_cut_off(tmp_path: Path) -> None:
    for suffix, codec in (("mkv", "ffv1"), ("mp4", "libx264")):
        content = write_clip(tmp_path / f"a.{suffix}", codec, "yuv420p", count=24).read_bytes()
        cut = tmp_path / f"cut.{suffix}"
        for share in (0, 0.02, 0.5, 0.9):
            cut.write_bytes(content[: int(share * len(content))])
            result = run("apply", cut, "-o", tmp_path / "out.mkv", "-q")
            assert result.exit_code == 1
            assert one_line(result.stderr).startswith(f"{cut}: damaged")
            with pytest.raises(ValueError, match=f"cut.{suffix}: damaged"):
                list(vkbloom.sequence(cut, framebuffers="final"))
            assert not list(tmp_path.glob("out.mkv")) + list(tmp_path.glob(".vkbloom-*"))


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="/dev/full is of Linux")
def test_a_full_disk(tmp_path: Path) -> None:
    source = write_clip(tmp_path / "a.mkv", "ffv1", "yuv420p")
    (tmp_path / "full.mkv").symlink_to("/dev/full")
    result = run("apply", source, "-o", tmp_path / "full.mkv", "-q")
    assert result.exit_code == 1
    assert one_line(result.stderr) == f"{tmp_path / 'full.mkv'}: No space left on device\n"


def words_of(source: Path, out: Path) -> list[str]:
    """Return the words of the command in a process of its own."""
    return [sys.executable, "-m", "vkbloom", "apply", str(source), "-o", str(out), "-q"]


def test_a_disk_that_fills_up(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)

    def noise(name: str, _: int) -> list[NDArray[Any]]:
        return [rng.integers(90, 160, plane.shape, np.uint8) for plane in gradient(name, 0)]

    source = write_clip(tmp_path / "a.mkv", "ffv1", "yuv444p", count=40, planes=noise)
    limit = source.stat().st_size // 2

    def limit_files() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    words = words_of(source, tmp_path / "out.mkv")
    ended = subprocess.run(
        words, preexec_fn=limit_files, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1
    assert one_line(ended.stderr) == f"{tmp_path / 'out.mkv'}: File too large\n"
    assert [*tmp_path.iterdir()] == [source]


def test_interrupt_leaves_no_file(tmp_path: Path) -> None:
    source = write_clip(tmp_path / "a.mkv", "ffv1", "yuv420p", count=2000)
    words = words_of(source, tmp_path / "out.mkv")
    with subprocess.Popen(words, stderr=subprocess.PIPE, text=True) as process:
        until = time.monotonic() + 60
        while not list(tmp_path.glob(".vkbloom-*")) and time.monotonic() < until:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        assert process.communicate()[1] == "vkbloom: interrupted\n"
    assert process.returncode == 130
    assert [*tmp_path.iterdir()] == [source]


#: Prints the bytes of the process at two frames.
SHOW_SIZES = """
import sys, psutil, vkbloom
frames = vkbloom.sequence(sys.argv[1], vkbloom.Pyramid(levels=1), framebuffers="final")
for number, _ in enumerate(frames):
    if number in (100, 999):
        print(psutil.Process().memory_info().rss)
"""


def test_memory_does_not_grow(tmp_path: Path) -> None:
    """In a process of its own: the memory of other tests changes meanwhile."""
    pytest.importorskip("psutil")
    clip = write_clip(tmp_path / "a.mkv", "ffv1", "yuv420p", count=1000)
    first, last = map(int, output("-c", SHOW_SIZES, clip).split())
    # A frame is 4.6 kB as floats; 900 of them would be 4.1 MB.
    assert last - first < 2_000_000


def test_files_that_are_no_video(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "a.mp4", "libx264", "yuv420p")
    (tmp_path / "b.mp4").write_text("no video")
    for words, status, said in (
        ((clip, tmp_path / "a.png"), 2, "one file cannot hold the frames of a video"),
        ((clip, tmp_path / "b.webm"), 2, "'.webm' is not the extension of a writable video"),
        ((clip, tmp_path / "b.mp4"), 2, "is a file that vkbloom did not write"),
        ((clip, "-o", clip), 2, "is read as IN; use --overwrite"),
        ((clip, clip, tmp_path / "c.mp4"), 2, "a video is a whole IN"),
        ((clip, tmp_path / "c.mp4", "--fps", "0"), 2, "is not a number of frames per second"),
        ((clip, tmp_path / "c.mp4", "--skip-existing"), 2, "--skip-existing is only for images"),
        ((clip, tmp_path / "c.mp4", "--framebuffers", "bloom"), 2, "only for images"),
        ((clip, tmp_path / "c.mp4", "--view", "Un-tone-mapped"), 2, "view: videos have none"),
        ((clip, tmp_path / "c.mkv", "--quality", "50"), 2, "ffv1 is lossless"),
        ((tmp_path / "b.mp4", tmp_path / "c.mp4"), 1, "b.mp4: damaged, or not a video"),
        ((tmp_path / "none.mp4", tmp_path / "c.mp4"), 1, "none.mp4: No such file"),
        ((tmp_path / "a.png", tmp_path / "b.png", "--fps", "24"), 2, "--fps is only for videos"),
    ):
        result = run("apply", *words)
        assert (result.exit_code, said in one_line(result.stderr)) == (status, True), result.stderr


def test_without_pyav(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clip = write_clip(tmp_path / "a.mp4", "libx264", "yuv420p")
    monkeypatch.setitem(sys.modules, "av", None)
    said = "needs av: pip install vkbloom[video]"
    assert said in one_line(run("apply", clip, tmp_path / "c.mp4").stderr)
    with pytest.raises(ModuleNotFoundError, match=r"pip install vkbloom\[video\]"):
        vkbloom.sequence(clip)


# Sequences


def images(count: int = 3) -> list[NDArray[np.float32]]:
    return [np.full((8, 12, 3), 0.25 * (1 + number), np.float32) for number in range(count)]


def test_a_sequence_is_what_apply_makes(renderer: vkbloom.Renderer) -> None:
    settings = vkbloom.Pyramid(levels=1, intensity=0.5)
    mask = np.zeros((8, 12), np.float32)
    given: dict[str, Any] = {"renderer": renderer, "fps": 24, "mask": mask, "threshold": 0.1}
    frames = vkbloom.sequence(images(), settings, **given)
    assert (len(frames), frames.settings) == (3, settings.replace(threshold=0.1))
    for _ in range(2):
        for number, (made, image) in enumerate(zip(frames, images(), strict=True)):
            alone = renderer.apply(image, frames.settings, mask=mask)
            assert made.info["time"] == pytest.approx(number / 24)
            for name, array in alone.items():
                np.testing.assert_array_equal(made[name], array)
                np.testing.assert_array_equal(frames[number][name], array)
    assert frames[-1].info["time"] == frames[2].info["time"]
    with pytest.raises(IndexError, match="index: 3 is not in this sequence"):
        frames[3]


def test_an_iterator_is_read_once(renderer: vkbloom.Renderer) -> None:
    taken = []

    def counted() -> Any:
        for number, image in enumerate(images(9)):
            taken.append(number)
            yield image

    frames = vkbloom.sequence(counted(), fps=24, renderer=renderer)
    assert taken == []
    next(iter(frames))
    assert len(taken) <= 3  # lazily: two are read ahead
    for wrong in (lambda: len(frames), lambda: frames[0]):
        with pytest.raises(TypeError):
            wrong()
    with pytest.raises(ValueError, match="frames: this iterator has been read"):
        iter(frames)


def test_numbers_that_are_missing_are_time(tmp_path: Path, renderer: vkbloom.Renderer) -> None:
    for number, image in zip((3, 4, 8), images(), strict=True):
        vkbloom.write(tmp_path / f"f.{number:04d}.exr", image)
    pattern = str(tmp_path / "f.%04d.exr")
    with pytest.raises(ValueError, match=r'3 of 6 frames are missing: 5 to 7; gaps="time"'):
        vkbloom.sequence(pattern)
    frames = vkbloom.sequence(pattern, fps=10, gaps="time", renderer=renderer)
    assert [made.info["time"] for made in frames] == [0.0, 0.1, 0.5]
    assert frames[2].info["time"] == 0.5
    with pytest.raises(FileNotFoundError, match=r"g.%04d.exr: no file was found"):
        vkbloom.sequence(tmp_path / "g.%04d.exr")


def test_a_scene_in_time(renderer: vkbloom.Renderer) -> None:
    scene = vkbloom.Scene.ufo()
    given: dict[str, Any] = {"size": (32, 24), "framebuffers": "final", "renderer": renderer}
    frames = vkbloom.sequence(scene, fps=2, **given)
    with pytest.raises(TypeError, match="no length"):
        len(frames)
    expected = renderer.render(scene, size=(32, 24), time=1 / 16, framebuffers="final")
    np.testing.assert_array_equal(frames[1]["final"], expected["final"])
    timed = vkbloom.sequence(scene, times=[0, 0.5], **given)
    assert [made.info["time"] for made in timed] == [0, 0.5]


@pytest.mark.parametrize(
    ("frames", "given", "said"),
    [
        (images(), {"fps": 0}, "fps: 0 is out of range"),
        (images(), {"fps": 24, "times": [0, 1, 2]}, "times: fps is given as well"),
        (images(), {"times": [0, 1]}, "times: 2 times do not match 3 frames"),
        (images(), {"times": [0, 1, 1]}, "times: each one must be later"),
        (images(), {"gaps": "no"}, "gaps: 'no' is not one of error, time"),
        (images()[0], {}, "frames: ndarray is not an iterable of images"),
        ("a.png", {}, "frames: 'a.png' is neither a video nor a pattern"),
        (vkbloom.Scene.ufo(), {}, "fps: a scene needs frames per second"),
    ],
)
def test_wrong_arguments(frames: Any, given: dict[str, Any], said: str) -> None:
    with pytest.raises((TypeError, ValueError), match=said):
        vkbloom.sequence(frames, **given)


def test_times_of_an_iterator_are_compared_when_it_ends(renderer: vkbloom.Renderer) -> None:
    for times in ([0, 1], [0, 1, 2, 3]):
        with pytest.raises(ValueError, match=f"{len(times)} times"):
            list(vkbloom.sequence(iter(images()), times=times, renderer=renderer))


def flashing(name: str, number: int) -> list[NDArray[Any]]:
    """Return planes that are bright and dark in turns of two frames, 6 Hz at 24 a second.

    Those of 10 bits are 240 and 1000 cd/m2 by PQ.
    """
    scale, dark, bright = (4, 150, 180) if "10" in name else (1, 30, 150)
    light = (dark, dark, bright, bright)[number % 4] * scale
    grey = np.full((HEIGHT // 2, WIDTH // 2), 128 * scale)
    planes = [np.full((HEIGHT, WIDTH), light), grey, grey]
    return [plane.astype(np.uint8 if scale == 1 else np.uint16) for plane in planes]


def check_clip(path: Path, *words: object) -> tuple[int, dict[str, Any]]:
    done = run("check", "--sequence", path, "--json", *words)
    assert done.exit_code in {0, 1}, done.output
    return done.exit_code, json.loads(done.stdout)


def test_check_judges_a_video(tmp_path: Path) -> None:
    write = partial(write_clip, codec="ffv1", name="yuv420p", count=36, planes=flashing)
    status, found = check_clip(write(tmp_path / "clip.mkv"))
    assert (status, found["frames"], found["fps"]) == (1, 36, 24)
    assert found["flash"]["flashes"] == 6
    # Its own times, some of which are longer: a third as fast as at a constant rate.
    times = [number // 4 * 12 + number % 4 for number in range(36)]
    status, found = check_clip(write(tmp_path / "slow.mkv", times=times))
    assert (status, found["frames"], found["missing"]) == (0, 36, 0)
    assert found["fps"] == pytest.approx(24, rel=0.05)
    assert found["flash"]["flashes"] == 2
    assert check_clip(tmp_path / "slow.mkv", "--fps", 24)[0] == 1
    # The display follows from the tags; that of SDR shows both lights as its white.
    write_clip(tmp_path / "pq.mkv", "ffv1", "yuv420p10le", PQ, count=36, planes=flashing)
    for words, failed in ((), True), (("--display", "srgb"), False):
        status, found = check_clip(tmp_path / "pq.mkv", "--standard", "bt1702", *words)
        assert status == failed, words
    missing = run("check", "--sequence", tmp_path / "none.mp4")
    assert (missing.exit_code, "No such file" in one_line(missing.stderr)) == (1, True)
