"""Each faulty file is refused, and the error names file, line and cause, and quotes the line."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.refusals import assert_refused, rows
from vkbloom import ShaderError
from vkbloom._custom.compiler import compile_shader
from vkbloom._custom.file import CustomFile, read_file
from vkbloom._custom.glsl import write_shader
from vkbloom._custom.source import Source, check, read_source

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "custom_methods"
BODY = "vec4 hook() { return HOOKED_texOff(0); }\n"
PASS = "//!HOOK MAIN\n//!BIND HOOKED\n" + BODY
TEXTURE = "//!TEXTURE t\n//!SIZE 2 1\n//!FORMAT r8\n00ff\n"


def headed(*lines: str) -> str:
    """Return a pass with these lines in its header, from line 3 on."""
    return "//!HOOK MAIN\n//!BIND HOOKED\n" + "".join(f"//!{line}\n" for line in lines) + BODY


def param(*lines: str, body: str = "1\n") -> str:
    """Return a file with a PARAM that has these lines from line 2 on, and a pass."""
    return "//!PARAM p\n" + "".join(f"//!{line}\n" for line in lines) + body + PASS


def texture(*lines: str, body: str = "00ff\n") -> str:
    return "//!TEXTURE t\n" + "".join(f"//!{line}\n" for line in lines) + body + PASS


def buffer(*lines: str, body: str = "00000000\n") -> str:
    return "//!BUFFER b\n" + "".join(f"//!{line}\n" for line in lines) + body + PASS


def compile_all(file: CustomFile) -> None:
    values = {one.name: one.default for one in file.params}
    for stage, one in file.runs():
        compile_shader(file, one, write_shader(file, one, stage, values))


@pytest.mark.parametrize(
    ("call", "error"),
    [*rows(__file__, "faulty files"), *rows(__file__, "passes that do not compile")],
)
def test_a_faulty_file_is_refused(
    request: pytest.FixtureRequest, tmp_path: Path, call: str, error: str
) -> None:
    """The error also quotes the line that it names."""
    file = tmp_path / "faulty.hook"

    def read(text: str) -> CustomFile:
        file.write_text(text)
        return read_file(read_source(file))

    def compile_shader(body: str) -> None:
        request.getfixturevalue("glslang")
        compile_all(read(f"//!HOOK MAIN\n//!BIND HOOKED\n{body}"))

    message = assert_refused(
        call, error, {**globals(), "read": read, "compile_shader": compile_shader}
    )
    path, line, _ = message.split(":", 2)
    assert path == str(file)
    quoted = message.rpartition("\n")[2].strip()
    assert quoted == file.read_text().split("\n")[int(line) - 1].strip()


@pytest.mark.usefixtures("glslang")
def test_a_name_that_glsl_does_not_accept(tmp_path: Path) -> None:
    file = tmp_path / "faulty.hook"
    text = (
        param("TYPE float").replace("PARAM p", "PARAM while").replace("texOff(0)", "texOff(while)")
    )
    file.write_text(text)
    with pytest.raises(ShaderError) as caught:
        compile_all(read_file(read_source(file)))
    assert "while" in str(caught.value)
    assert str(caught.value).startswith(f"{file}:")


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("kill -SEGV $$", "SIGSEGV"),
        ("sh -c 'kill -ABRT $$'", "SIGABRT"),  # its shell has 128 and the signal as its status
        ("exec sleep 60", "SIGKILL"),  # after MAX_SECONDS
        ("exit 250", "status 250"),
    ],
)
def test_how_the_compiler_is_ended_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, name: str
) -> None:
    tool, hook = tmp_path / "glslang", tmp_path / "one.hook"
    tool.write_text(f"#!/bin/sh\n{command}\n")
    tool.chmod(0o755)
    hook.write_text("//!HOOK MAIN\n//!BIND HOOKED\nvec4 hook() { return vec4(0.125); }\n")
    # A process looks for it once.
    monkeypatch.setattr("vkbloom._custom.compiler.find_compiler", lambda: str(tool))
    monkeypatch.setattr("vkbloom._custom.compiler.MAX_SECONDS", 0.5)
    monkeypatch.setenv("VKBLOOM_CACHE_DIR", "")
    with pytest.raises(ShaderError, match=f"the compiler was ended by {name}: "):
        compile_all(read_file(read_source(hook)))


WORDS = (
    "//!",
    "//!HOOK MAIN\n",
    "//!BIND A\n",
    "//!PARAM x\n",
    "\n",
    "\0",
    " ",
    "-1",
    "/",
    "é",
    "9" * 20,
)


@given(data=st.data())
@settings(max_examples=300)
def test_no_mutation_ends_in_another_error(data: st.DataObject) -> None:
    text = data.draw(
        st.sampled_from([file.read_text() for file in sorted(EXAMPLES.glob("*.hook"))])
    )
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(text)))
        end = start + data.draw(st.integers(0, 40))
        text = text[:start] + data.draw(st.sampled_from(("", *WORDS))) + text[end:]
    message = "mutated:"
    try:
        file = read_file(check(Source("mutated", text)))
        values = {one.name: one.default for one in file.params}
        for stage, one in file.runs():
            write_shader(file, one, stage, values)
    except ValueError as error:
        message = str(error)
    assert message.startswith("mutated:")


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "picture.png"
    file.write_bytes(b"//!HOOK MAIN\n\x89PNG\n")
    with pytest.raises(ValueError, match=r"picture\.png:2: byte 0x89 is not UTF-8"):
        read_source(file)


@pytest.mark.parametrize("name", ["photo.jpg", "photo"])
def test_a_picture_is_no_method(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    file.write_bytes(b"\xff\xd8\xff\xe0\0\x10JFIF")
    with pytest.raises(ValueError, match=f"'vkbloom apply {name} OUT' adds bloom to a picture"):
        read_source(file)
