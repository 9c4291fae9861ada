"""Dependencies of render passes, in the numbers of the Vulkan specification."""

from __future__ import annotations

EXTERNAL = -1

# VkPipelineStageFlagBits, VkAccessFlagBits and VkDependencyFlagBits of the Vulkan specification.
DEPTH_TESTS = 0x100 | 0x200
FRAGMENT_SHADER = 0x80
COLOR_OUTPUT = 0x400
TRANSFER = 0x1000
SHADER_READ = 0x20
COLOR_READ, COLOR_WRITE = 0x80, 0x100
DEPTH_READ, DEPTH_WRITE = 0x200, 0x400
TRANSFER_READ = 0x800
BY_REGION = 1

DEPTH_BEFORE_DEPTH = (
    EXTERNAL,
    0,
    DEPTH_TESTS,
    DEPTH_TESTS,
    DEPTH_WRITE,
    DEPTH_READ | DEPTH_WRITE,
    BY_REGION,
)
READ_BEFORE_WRITE = (
    EXTERNAL,
    0,
    FRAGMENT_SHADER,
    COLOR_OUTPUT,
    SHADER_READ,
    COLOR_WRITE,
    0,
)
WRITE_BEFORE_READ = (
    0,
    EXTERNAL,
    COLOR_OUTPUT,
    FRAGMENT_SHADER,
    COLOR_WRITE,
    SHADER_READ,
    0,
)
