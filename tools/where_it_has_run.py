"""Write drivers_table.md, where vkbloom has run, from the kept reports of docs/evidence/devices.

``python tools/where_it_has_run.py [--out docs/evidence]``. Two programs write the reports:
``vkbloom doctor --self-test --json FILE`` and ``python -m tests.device.amd_families --json FILE``.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

EVIDENCE: Final = Path(__file__).parents[1] / "docs" / "evidence"

#: Of the systems that users have, those of which there is no report.
NOT_TRIED: Final = (
    "AMD's GPUs themselves (RADV on hardware, AMDVLK, Windows)",
    "Intel's GPUs (ANV, Windows)",
    "Apple's GPUs (MoltenVK, KosmicKrisp)",
    "Adreno, Mali, PowerVR (Turnip, PanVK, vendors' drivers)",
    "NVIDIA's GPUs with NVK, and with the vendor's driver on Windows",
)


def rows(file: Path) -> Iterator[tuple[str, ...]]:
    """Return the table's rows of one report."""
    report: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    if "families" in report:
        for one in report["families"]:
            # As in "Null hardware (RADV NAVI21) (discrete, Mesa 22.3.6, Vulkan 1.3.230)".
            name, about = one["adapter"].rstrip(")").rsplit(" (", 1)
            name = name.removeprefix("Null hardware (").removesuffix(")")
            found = f"{one['count']} requests, {len(one['wrong'])} wrong"
            spilled = f"{one['vgprs_spilled']} vector and {one['sgprs_spilled']} scalar registers"
            more = f"{one['shaders']} shaders; spilled: {spilled}; shared: {one['shared']} bytes"
            yield name, about.partition(", ")[2], "compiled", found, more
        return
    device = report["device"]
    about = f"{device['driver_info'] or device['driver']}, Vulkan {device['api_version']}"
    worst = max(report["groups"], key=lambda one: _share(one["largest_error"], one["allowed"]))
    figures = f"nearest to its limit: {worst['name']}, {worst['largest_error'] or 0:.2g} of "
    wrong = "; ".join(f"{one['group']}: {one['name']}" for one in report["wrong"])
    found = f"{report['cases']} cases, {len(report['wrong'])} wrong, {report['seconds']:.0f} s"
    more = f"wrong: {wrong}" if wrong else f"{figures}{worst['allowed']:.2g}"
    yield device["name"], about, "drawn", found, more


def _share(error: float | None, allowed: float | None) -> float:
    return (error or 0.0) / allowed if allowed else 0.0


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=EVIDENCE)
    arguments = parser.parse_args()
    table = [row for file in sorted((EVIDENCE / "devices").glob("*.json")) for row in rows(file)]
    table.sort(key=lambda row: row[2] != "drawn")
    table += [(name, "", "not tried", "", "") for name in NOT_TRIED]
    lines = ["| device | driver | | result | figures |", "|---|---|---|---|---|"]
    alike: dict[tuple[str, ...], list[str]] = {}
    for name, *found in table:
        alike.setdefault((*found,), []).append(name)
    lines += [f"| {' | '.join(('; '.join(names), *row))} |" for row, names in alike.items()]
    (arguments.out / "drivers_table.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
