"""WGSL and WESL."""
from pathlib import Path
from vkbloom._custom.described.files import Files
def collect(path, dependencies):
    raise NotImplementedError
def identity(language):
    return b""
def compile_wgsl(shader, files):
    raise NotImplementedError
