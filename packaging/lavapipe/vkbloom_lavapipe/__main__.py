"""``python -m vkbloom_lavapipe``: print the environment that makes programs use it."""

from __future__ import annotations

import json
import shlex
import sys

from vkbloom_lavapipe import environment

if __name__ == "__main__":
    options = sys.argv[1:]
    if not {*options} <= {"--json", "--frozen"}:
        sys.exit("vkbloom_lavapipe: wrong use; the options are --json and --frozen")
    variables = environment(frozen="--frozen" in options)
    if "--json" in options:
        print(json.dumps(variables, indent=2))
    else:
        # Lines that bash can read: set -a; eval "$(python -m vkbloom_lavapipe)"
        print("\n".join(f"{name}={shlex.quote(value)}" for name, value in variables.items()))
