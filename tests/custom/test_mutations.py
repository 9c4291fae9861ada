"""Descriptions and shaders that chance has changed: no crash, no hang, no error of another kind.

A usual run takes a few; an exhaustive one takes 100,000.
"""

from __future__ import annotations

import random
import re
import signal
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import pytest

from tests.custom.broken import DESCRIPTION, OTHERS, SHADERS, write_all, write_one
from tests.custom.front_ends import (
    Description,
    Module,
    Program,
    Shader,
    Source,
    bind,
    check,
    compile_all,
    compile_described,
    files,
    find_lines,
    open_described,
    read_schema,
    shaderlab,
    slang,
    wgsl,
)
from tests.custom.test_described import EXAMPLES
from tests.exhaustive import EXHAUSTIVE
from vkbloom import ShaderError

pytestmark = pytest.mark.usefixtures("glslang")

#: What is put in: words of all languages, and numbers at the ends of their ranges.
WORDS: Final = (
    *('"', "'", '"""', "[", "]", "[[", "]]", "{", "}", "(", ")", "=", ",", ".", "#", "\n", "\0"),
    *("/*", "*/", "//", "\\", "\\\n", "#include", '"../x"', "import a;", "@", "<", ">", ";", "::"),
    *("0", "-1", "1e400", "nan", "inf", "9" * 40, "0x" + "f" * 40, "1 / 0", "2 ** 99", "true"),
    *("level", "glow", "size(glow)", "down[0]", "bloom", "passes", "[[passes]]", "[numbers]"),
    *("é", "\u2028", "\x1b[2J", "float", "vec4", "for (;;) {", "while (true) {", "struct", "fn"),
    *("register(t0)", "@group(0) @binding(0)", "discard", "void main()", "HLSLPROGRAM", "ENDHLSL"),
)
#: Of one mutation, in seconds: more is a hang.
LIMIT: Final = 60

Refusal = (ValueError, ShaderError)


def mutate(chance: random.Random, text: str) -> str:
    """Change a text in one to four places."""
    for _ in range(chance.randint(1, 4)):
        tokens = re.findall(r"\w+|\s+|[^\w\s]", text) or [""]
        at = chance.randrange(len(tokens))
        other = chance.randrange(len(tokens))
        lines = text.split("\n")
        line = chance.randrange(len(lines))
        match chance.randrange(8):
            case 0:  # another character
                start = chance.randrange(len(text) + 1)
                text = text[:start] + chr(chance.randrange(1, 255)) + text[start + 1 :]
            case 1:  # a line twice
                text = "\n".join((*lines[: line + 1], *lines[line:]))
            case 2:  # a line less
                text = "\n".join((*lines[:line], *lines[line + 1 :]))
            case 3:  # two tokens in each other's place
                tokens[at], tokens[other] = tokens[other], tokens[at]
                text = "".join(tokens)
            case 4:  # a token less
                text = "".join((*tokens[:at], *tokens[at + 1 :]))
            case 5:  # a token in place of another one
                tokens[at] = tokens[other]
                text = "".join(tokens)
            case 6:  # a word in place of a token
                tokens[at] = chance.choice(WORDS)
                text = "".join(tokens)
            case 7:  # a word before a token
                tokens.insert(at, chance.choice(WORDS))
                text = "".join(tokens)
    return text


@contextmanager
def limited() -> Iterator[None]:
    """Raise an error in what takes too long."""

    def end(*_: object) -> None:
        raise RuntimeError(f"a mutation took more than {LIMIT} s")

    before = signal.signal(signal.SIGALRM, end)
    signal.alarm(LIMIT)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def run(
    count: int, folder: Path, attempt: Callable[[random.Random], None], seed: int
) -> Counter[str]:
    """Try many mutations; each is taken, or refused with a file of the folder and a line."""
    found: Counter[str] = Counter()
    wrong: list[str] = []
    pattern = re.compile(rf"{re.escape(str(folder))}/[^:\n]+:\d+: [^\n]*(?:\n    [^\n]*)?")
    for number in range(count):
        chance = random.Random(seed * 1_000_000 + number)
        try:
            with limited():
                attempt(chance)
        except Exception as error:
            if isinstance(error, Refusal) and pattern.fullmatch(str(error)):
                found["refused"] += 1
            else:
                wrong.append(f"number {number}: {error!r}")
        else:
            found["taken"] += 1
        if number % 2000 == 1999 or number == count - 1:
            print(number + 1, dict(found), len(wrong), flush=True)
    assert not wrong, "\n".join(wrong[:20])
    return found


def test_descriptions(tmp_path: Path) -> None:
    """With their shaders, as load_method takes them."""
    path = write_all(tmp_path)
    for name in ("down.frag", "up.frag"):
        (tmp_path / name).write_text((EXAMPLES / "glsl" / name).read_text())
    texts = (DESCRIPTION, (EXAMPLES / "glsl" / "bloom.toml").read_text())

    def attempt(chance: random.Random) -> None:
        text = mutate(chance, chance.choice(texts))
        read = check(Source(str(path), text))
        open_described("mutated", compile_described(read, tmp_path))

    found = run(60_000 if EXHAUSTIVE else 150, tmp_path, attempt, 1)
    assert found["refused"] > found["taken"] / 2


def test_lines_of_tables(tmp_path: Path) -> None:
    """The lines are found in all that tomllib takes."""
    count = 10_000 if EXHAUSTIVE else 50
    texts = [file.read_text() for file in sorted(EXAMPLES.glob("*/bloom.toml"))]
    for number in range(count):
        chance = random.Random(number)
        text = mutate(chance, chance.choice(texts))
        try:
            data = tomllib.loads(text)
        except ValueError:
            continue
        lines = find_lines(text)
        for key, value in data.items():
            assert (key,) in lines, (number, key)
            for inner in value if isinstance(value, dict) else ():
                assert (key, inner) in lines, (number, key, inner)


def test_glsl(tmp_path: Path) -> None:
    """Compiled by glslang, and bound."""
    path = write_all(tmp_path)

    def attempt(chance: random.Random) -> None:
        name = chance.choice([*SHADERS])
        file = tmp_path / name
        text = mutate(chance, SHADERS[name])
        file.write_bytes(text.encode("utf-8", "replace"))
        try:
            open_described("mutated", compile_described(Source(str(path), DESCRIPTION), tmp_path))
        finally:
            file.write_text(SHADERS[name])

    run(4_000 if EXHAUSTIVE else 10, tmp_path, attempt, 2)


def test_what_is_read_before_compilers(tmp_path: Path) -> None:
    """Includes, programs of ShaderLab, entry points and names of WGSL."""
    names = [*OTHERS, "bloom.wgsl"]
    texts = {**OTHERS, "bloom.wgsl": (EXAMPLES / "wgsl" / "bloom.wgsl").read_text()}
    write_one(tmp_path, "one.wesl")

    def attempt(chance: random.Random) -> None:
        name = chance.choice(names)
        file = tmp_path / name
        file.write_bytes(mutate(chance, texts[name]).encode("utf-8", "replace"))
        language = file.suffix[1:]
        entry = "down" if name == "bloom.wgsl" else "Main"
        shader = Shader(str(file), language, entry, None, None, (), (), (), (), (), (), 0, 1)
        if language in ("wgsl", "wesl"):
            read = wgsl.collect(file, [])
            plain = files.without_remarks(read.main.text)
            _, entry, _, _ = wgsl._interface(shader, read, plain)
            list(wgsl._names(plain, wgsl._words_of(plain, entry)))
            return
        read = files.collect(file, (), tmp_path)
        if language == "shader":
            shaderlab.read_program(read, 0)

    run(20_000 if EXHAUSTIVE else 150, tmp_path, attempt, 3)


@pytest.mark.parametrize("name", ["one.hlsl", "one.slang", "one.shader", "one.wgsl"])
def test_other_compilers(tmp_path: Path, name: str) -> None:
    path = write_one(tmp_path, name)
    text = path.read_text()

    def attempt(chance: random.Random) -> None:
        changed = mutate(chance, OTHERS[name])
        (tmp_path / name).write_bytes(changed.encode("utf-8", "replace"))
        open_described("mutated", compile_described(Source(str(path), text), tmp_path))

    try:
        compile_described(Source(str(path), text), tmp_path)
    except ShaderError as error:
        pytest.skip(str(error))
    run(250 if EXHAUSTIVE else 1, tmp_path, attempt, 4)


def compiled(folder: Path) -> list[tuple[Description, int, Program]]:
    """Return the passes of the description, with their programs."""
    path = write_all(folder)
    description = read_schema(Source(str(path), DESCRIPTION))
    made, _ = compile_all(description, folder)
    return [
        (description, number, made[each.shader]) for number, each in enumerate(description.passes)
    ]


def flip(chance: random.Random, code: bytes) -> bytes:
    """Change words of SPIR-V, leave some out, or put some twice."""
    data = bytearray(code)
    for _ in range(chance.randint(1, 4)):
        at = 4 * chance.randrange(3, len(data) // 4)
        match chance.randrange(5):
            case 0:
                data[at + chance.randrange(4)] ^= 1 << chance.randrange(8)
            case 1:
                data[at : at + 4] = chance.choice((b"\0" * 4, b"\xff" * 4, b"\1\0\0\0"))
            case 2:
                del data[at : at + 4 * chance.randint(1, 8)]
            case 3:
                data[at:at] = data[at : at + 4 * chance.randint(1, 8)]
            case 4:
                other = 4 * chance.randrange(5, len(data) // 4)
                data[at : at + 4] = data[other : other + 4]
    return bytes(data)


def test_spirv(tmp_path: Path) -> None:
    """Bound as if a compiler had given it, without the validator before."""
    passes = compiled(tmp_path)

    def attempt(chance: random.Random) -> None:
        description, number, program = chance.choice(passes)
        code = flip(chance, program.code)
        item = [*description.passes][number]
        bind(description, item, Program(code, None, program.stage, program.vertex), "mutated")

    run(15_000 if EXHAUSTIVE else 100, tmp_path, attempt, 5)


def test_validated_spirv(tmp_path: Path) -> None:
    """As load_method takes it."""
    code = compiled(tmp_path)[0][2].code
    path = tmp_path / "bloom.toml"
    text = DESCRIPTION.replace("copy.frag", "copy.spv")
    (tmp_path / "copy.spv").write_bytes(code)
    if slang.find_tool("spirv-val") is None:
        pytest.skip("spirv-val is missing")

    def attempt(chance: random.Random) -> None:
        (tmp_path / "copy.spv").write_bytes(flip(chance, code))
        open_described("mutated", compile_described(Source(str(path), text), tmp_path))

    run(500 if EXHAUSTIVE else 3, tmp_path, attempt, 6)


def test_modules_of_chance() -> None:
    """The reader of modules takes any bytes, or raises its own error."""
    header = b"\3\2\x23\7" + bytes(16)
    for number in range(2_000 if EXHAUSTIVE else 20):
        chance = random.Random(number)
        code = header + chance.randbytes(4 * chance.randint(1, 60))
        with pytest.raises(ValueError, match=r"."):
            Module(code).entry(None, None)
