"""Each faulty file is refused, and the error names file, line and cause, and quotes the line."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vkbloom import ShaderError
from vkbloom._custom import compiler
from vkbloom._custom.compiler import compile_shader
from vkbloom._custom.file import CustomFile, read_file
from vkbloom._custom.glsl import write_shader
from vkbloom._custom.source import Source, checked, read_source

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


FAULTS = [
    # The file
    ("no marks", "vec4 hook() { return vec4(0.0); }\n", 1, "no line that begins with //!"),
    ("no pass", param("TYPE int").removesuffix(PASS), 1, "no pass"),
    ("unknown directive", headed("FOO bar"), 3, "'FOO' is not one of a pass"),
    ("lower case", headed("width 2"), 3, "'width' is not one of a pass"),
    ("texture directive in a pass", headed("FORMAT r8"), 3, "'FORMAT' is not one"),
    ("pass directive in a texture", texture("FORMAT r8", "HOOK MAIN"), 3, "TEXTURE"),
    ("pass directive in a param", param("TYPE int", "BIND HOOKED"), 3, "PARAM"),
    ("mark in the body", PASS + "vec4 x; //! todo\n", 4, "'todo' is not one of a pass"),
    # HOOK
    ("no hook", "//!BIND HOOKED\n" + BODY, 1, "no //!HOOK"),
    ("17 hooks", "//!HOOK MAIN\n" * 17 + "//!BIND HOOKED\n" + BODY, 17, "at most 16"),
    ("unknown stage", "//!HOOK NOWHERE\n" + BODY, 1, "'NOWHERE' is not one of RGB"),
    ("hook without a name", "//!HOOK\n" + BODY, 1, "'' is not one of RGB"),
    ("luma", "//!HOOK LUMA\n//!BIND HOOKED\n" + BODY, 1, "LUMA is never reached"),
    ("chroma", "//!HOOK CHROMA\n//!BIND HOOKED\n" + BODY, 1, "CHROMA is never reached"),
    ("xyz", "//!HOOK XYZ\n//!BIND HOOKED\n" + BODY, 1, "XYZ is never reached"),
    ("alpha", "//!HOOK ALPHA\n//!BIND HOOKED\n" + BODY, 1, "ALPHA is never reached"),
    ("chroma scaled", "//!HOOK CHROMA_SCALED\n" + BODY, 1, "CHROMA_SCALED is never reached"),
    # BIND and SAVE
    ("17 bindings", "//!HOOK MAIN\n" + "//!BIND HOOKED\n" * 17 + BODY, 18, "at most 16"),
    ("unknown texture", headed("BIND NOWHERE"), 3, "'NOWHERE' is not a texture here"),
    ("a later stage", headed("BIND OUTPUT"), 3, "comes after the pass's own, MAIN"),
    ("saved later", headed("BIND A") + headed("SAVE A"), 3, "only by a later pass, in line 5"),
    ("bind without a name", headed("BIND"), 3, "the name is missing"),
    ("save without a name", headed("SAVE"), 3, "the name is missing"),
    ("save of two words", headed("SAVE a b"), 3, "'a b' is not a name"),
    ("save of a long name", headed("SAVE " + "a" * 40), 3, "longer than 31"),
    ("nothing is shown", headed("SAVE A"), 1, "no pass writes the picture"),
    # Expressions
    ("unknown size", headed("WIDTH NOWHERE.w"), 3, "'NOWHERE' is not one of"),
    ("size of a later stage", headed("WIDTH OUTPUT.w SCALED.w +"), 3, "'SCALED' is not one of"),
    ("size of a texture block", TEXTURE + headed("WIDTH t.w"), 7, "'t' is not one of"),
    ("too few operands", headed("WIDTH HOOKED.w /"), 3, "'/' needs two values"),
    ("too few for not", headed("WHEN !"), 3, "'!' needs a value"),
    ("two values left", headed("HEIGHT HOOKED.h 2"), 3, "2 values are left"),
    ("unknown word", headed("WHEN nothing 0 >"), 3, "'nothing' is neither"),
    ("negative number", headed("WHEN -1"), 3, "write -1 as '0 1 -'"),
    ("number without a digit", headed("WIDTH HOOKED.w .5 *"), 3, "begin with a digit"),
    ("a tab", headed("WIDTH HOOKED.w\t2 /"), 3, "tab"),
    ("65 tokens", headed("WHEN " + "1 " * 65), 3, "65 tokens are more than 64"),
    # Other directives of passes
    ("offset of one number", headed("OFFSET 1"), 3, "'1' is not two numbers"),
    ("offset of words", headed("OFFSET left top"), 3, "not two numbers or ALIGN"),
    ("components", headed("COMPONENTS many"), 3, "'many' is not a number"),
    ("compute of one number", headed("COMPUTE 8"), 3, "not two or four numbers"),
    ("compute of three numbers", headed("COMPUTE 8 8 8"), 3, "not two or four numbers"),
    ("compute of words", headed("COMPUTE a b"), 3, "not two or four numbers"),
    ("compute of nothing", headed("COMPUTE 0 8"), 3, "out of range"),
    ("too many threads", headed("COMPUTE 64 64"), 3, "out of range, 1 to 1024"),
    # TEXTURE
    ("no format", texture("SIZE 2 1"), 1, "no //!FORMAT"),
    ("unknown format", texture("SIZE 2 1", "FORMAT r7"), 3, "'r7' is not one of"),
    ("format not sampled", texture("SIZE 2 1", "FORMAT rgb16f"), 3, "'rgb16f' is not one of"),
    ("four sides", texture("SIZE 2 1 1 1", "FORMAT r8"), 2, "not one, two or three numbers"),
    ("no sides", texture("SIZE", "FORMAT r8"), 2, "not one, two or three numbers"),
    ("a side of 0", texture("SIZE 2 0", "FORMAT r8"), 2, "out of range, 1 to 4096"),
    ("a huge side", texture("SIZE 70000 1", "FORMAT r8"), 2, "out of range"),
    ("unknown filter", texture("SIZE 2 1", "FORMAT r8", "FILTER CUBIC"), 4, "'CUBIC' is not one"),
    (
        "filtered integers",
        texture("SIZE 2 1", "FORMAT r8u", "FILTER LINEAR"),
        4,
        "not possible with integers",
    ),
    ("unknown border", texture("SIZE 2 1", "FORMAT r8", "BORDER WRAP"), 4, "'WRAP' is not one"),
    ("too few bytes", texture("SIZE 3 1", "FORMAT r8"), 4, "has 2 bytes, not 3"),
    ("too many bytes", texture("SIZE 1 1", "FORMAT r8"), 4, "has 2 bytes, not 1"),
    ("no bytes", texture("SIZE 1 1", "FORMAT r8", body="\n"), 4, "has 0 bytes, not 1"),
    ("no digit", texture("SIZE 2 1", "FORMAT r8", body="00\nfg\n"), 5, "'g' is not a hexadecimal"),
    ("half a byte", texture("SIZE 2 1", "FORMAT r8", body="00f\n"), 4, "not full bytes"),
    ("texture without a name", "//!TEXTURE\n" + "//!FORMAT r8\n00\n" + PASS, 1, "name is missing"),
    # BUFFER
    ("unknown type", buffer("VAR bool a"), 2, "'bool' is not one of"),
    ("no name of a variable", buffer("VAR float"), 2, "not 'type name'"),
    ("an array of 0", buffer("VAR float a[0]"), 2, "'0' is not an array's length"),
    ("an array without length", buffer("VAR float a[]"), 2, "not an array's length"),
    ("a negative array", buffer("VAR float a[-1]"), 2, "'-1' is not an array's length"),
    ("wrong size", buffer("VAR vec2 a"), 3, "has 4 bytes, not 8"),
    ("std140 array", buffer("VAR float a[2]", body="00000000" * 2 + "\n"), 3, "not 32"),
    ("uniform without data", buffer("VAR float a", body="\n"), 3, "has 0 bytes, not 4"),
    ("no variable", buffer("STORAGE"), 1, "no //!VAR"),
    # PARAM
    ("no type", param("DESC text"), 1, "no //!TYPE"),
    ("bool", param("TYPE bool"), 2, "'bool' is not one of"),
    ("vector", param("TYPE vec3"), 2, "'vec3' is not one of"),
    ("define with more", param("TYPE DEFINE int"), 2, "'DEFINE int' is not one of"),
    ("enum of floats", param("TYPE ENUM float"), 2, "'ENUM float' is not one of"),
    ("no value", param("TYPE int", body="\n"), 1, "no default value"),
    ("a remark", param("TYPE float", body="1.0 // one\n"), 3, "'1.0 // one' is not a number"),
    ("two values", param("TYPE float", body="1.0\n2.0\n"), 3, "'1.0' is not a number"),
    ("a negative uint", param("TYPE uint", body="-1\n"), 3, "'-1' is not a number of type uint"),
    ("below", param("TYPE int", "MINIMUM 2"), 4, "1 is out of range, 2 to"),
    ("above", param("TYPE float", "MAXIMUM 0.5"), 4, "1 is out of range, -inf to 0.5"),
    ("a word as a limit", param("TYPE float", "MINIMUM low"), 3, "MINIMUM: 'low' is not a number"),
    ("an empty enum", param("TYPE ENUM int", body="\n"), 1, "no names"),
    ("an enum of two words", param("TYPE ENUM int", body="a b\n"), 3, "'a b' is not a name"),
    ("a name twice", param("TYPE int") + param("TYPE int"), 7, "another block, in line 1"),
    ("no name", "//!PARAM\n//!TYPE int\n1\n" + PASS, 1, "name is missing"),
    # Other programs
    ("shadertoy", "// a\nvoid mainImage(out vec4 c, in vec2 p) {}\n", 2, "Shadertoy's syntax"),
    ("reshade", "float x;\ntechnique Bloom\n{ pass {} }\n", 2, "ReShade's syntax"),
    ("reshade_part", '// a\n#include "ReShade.fxh"\nfloat x;\n', 2, "ReShade's syntax"),
]

GLSL_FAULTS = [
    ("syntax", "vec4 hook() {\n    return 1.0 +;\n}\n", 4, "syntax error"),
    ("undeclared", "vec4 hook() {\n    return nothing;\n}\n", 4, "'nothing'"),
    ("not bound", "vec4 hook() {\n    return MAINX_tex(vec2(0.0));\n}\n", 4, "'MAINX_tex'"),
    ("wrong type", "float a = 1.0;\n\nvec4 hook() { return a; }\n", 5, "return"),
    ("no hook", "vec4 hock() { return vec4(0.0); }\n", 3, "defines no function 'vec4 hook()'"),
    ("hook of a compute pass", "void hook() {}\n", 3, "complete GLSL"),
    ("an open brace", "vec4 hook() { return vec4(0.0);\n", 3, "complete GLSL"),
    ("an open remark", "vec4 hook() { return vec4(0.0); } /*\n", 3, "End of input in comment"),
    ("an error directive", "#error not here\nvec4 hook() { return vec4(0.0); }\n", 3, "not here"),
]


def message_of(error: ValueError | ShaderError, file: Path, line: int, text: str) -> str:
    """Return the message, of which file, line and the quoted line are checked."""
    message = str(error)
    assert message.startswith(f"{file}:{line}: "), message
    assert message.rpartition("\n")[2].strip() == text.split("\n")[line - 1].strip()
    return message


@pytest.mark.parametrize(("title", "text", "line", "cause"), FAULTS, ids=[one[0] for one in FAULTS])
def test_a_faulty_file_is_refused(
    tmp_path: Path, title: str, text: str, line: int, cause: str
) -> None:
    file = tmp_path / "faulty.hook"
    file.write_text(text)
    with pytest.raises(ValueError, match="hook:") as caught:
        read_file(read_source(file))
    assert cause in message_of(caught.value, file, line, text)


def compile_all(file: CustomFile) -> None:
    values = {one.name: one.default for one in file.params}
    for stage, one in file.runs():
        compile_shader(file, one, write_shader(file, one, stage, values))


@pytest.mark.parametrize(
    ("title", "body", "line", "cause"), GLSL_FAULTS, ids=[one[0] for one in GLSL_FAULTS]
)
def test_a_pass_that_does_not_compile_is_refused(
    tmp_path: Path, title: str, body: str, line: int, cause: str
) -> None:
    text = f"//!HOOK MAIN\n//!BIND HOOKED\n{body}"
    file = tmp_path / "faulty.hook"
    file.write_text(text)
    read = read_file(read_source(file))
    with pytest.raises(ShaderError) as caught:
        compile_all(read)
    assert cause in message_of(caught.value, file, line, text)


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
    monkeypatch.setattr(compiler, "find_compiler", lambda: str(tool))
    monkeypatch.setattr(compiler, "MAX_SECONDS", 0.5)
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
        file = read_file(checked(Source("mutated", text)))
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
