"""``python -m vkbloom_lavapipe``: print the environment that makes programs use it."""

from __future__ import annotations

import json
import shlex
import sys

from vkbloom_lavapipe import environment

if __name__ == "__main__":
    if sys.argv[1:] == ["--json"]:
        print(json.dumps(environment(), indent=2))
    elif sys.argv[1:]:
        sys.exit("vkbloom_lavapipe: wrong use; --json is the only option")
    else:
        # Lines that bash can read: set -a; eval "$(python -m vkbloom_lavapipe)"
        print("\n".join(f"{name}={shlex.quote(value)}" for name, value in environment().items()))
