"""Run the jobs of a workflow of GitHub on this machine as for a tag, up to the upload.

`run` steps are run as they are, in the working tree where the job checks it out, else in a folder
of the job. Of the actions, checkout wants a working tree without changes; artifacts are folders.
What would be signed is written as a statement of in-toto, after the files have been compared with
their digests and checked by twine. What needs a token of GitHub is printed. Nothing is sent.
"""

from __future__ import annotations

import argparse
import hashlib
import itertools
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import yaml

ROOT: Final = Path(__file__).resolve().parents[1]
# The one condition that the workflow may have: what runs here is what runs for a tag.
CONDITION: Final = "startsWith(github.ref, 'refs/tags/v')"

Json = dict[str, Any]


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _statement(kind: str, digests: Mapping[str, str]) -> bytes:
    """Return what is signed of files: their names and digests, as in-toto has it."""
    from sigstore.dsse import Statement  # noqa: PLC0415  (workflows that sign nothing need it not)

    subjects = [{"name": name, "digest": {"sha256": one}} for name, one in sorted(digests.items())]
    made: Json = {"_type": "https://in-toto.io/Statement/v1", "subject": subjects}
    text = json.dumps({**made, "predicateType": kind, "predicate": None}, indent=1).encode()
    Statement(text)  # raises where it is none
    return text


class Job:
    """One job, with one combination of its matrix."""

    def __init__(
        self, out: Path, tag: str, name: str, job: Json, matrix: Mapping[str, str]
    ) -> None:
        self.out, self.job = out, job
        self.name = "-".join([name, *(re.sub(r"\W+", "", value) for value in matrix.values())])
        self.folder = out / "jobs" / self.name
        self.folder.mkdir(parents=True)
        self.values = {f"matrix.{key}": value for key, value in matrix.items()}
        self.values |= {"github.ref_name": tag, "github.repository": "OWNER/NAME"}
        self.variables = {**os.environ, "GITHUB_REF_NAME": tag, "CI": "true"}

    def text(self, text: object) -> str:
        """Return a text with its expressions evaluated: names, and `NAME != 'text'`."""

        def value(found: re.Match[str]) -> str:
            name, _, other = found[1].partition(" != ")
            known = self.values[name]
            return str(known != other.strip("'")).lower() if other else known

        return re.sub(r"\$\{\{ (.+?) \}\}", value, str(text))

    def run(self, left_out: list[str]) -> None:
        """Run the steps."""
        for step in self.job["steps"]:
            name = step.get("name") or step.get("uses") or step["run"].splitlines()[0]
            if name in left_out:
                print(f"{self.name}: left out: {name}", flush=True)
                continue
            if step.get("if", CONDITION) != CONDITION:
                raise SystemExit(f"{self.name}: if: {step['if']} is not known here")
            print(f"{self.name}: {name}", flush=True)
            if "uses" in step:
                action, _, _ = step["uses"].partition("@")
                known = getattr(self, re.sub(r"\W", "_", action), None)
                if known is None:
                    raise SystemExit(f"{self.name}: the action {action} is not known here")
                known({key: self.text(value) for key, value in step.get("with", {}).items()})
            elif "GH_TOKEN" in step.get("env", {}):
                print(f"would run: {step['run']}")
            else:
                self.command(step)

    def command(self, step: Json) -> None:
        """Run a step's shell."""
        own = {key: self.text(value) for key, value in step.get("env", {}).items()}
        done = subprocess.run(
            ["bash", "-e", "-c", self.text(step["run"])],
            cwd=self.folder / step.get("working-directory", ""),
            env={**self.variables, "GITHUB_WORKSPACE": str(self.folder), **own},
            check=False,
        )
        if done.returncode != 0:
            raise SystemExit(f"{self.name}: status {done.returncode}")

    def actions_checkout(self, options: Json) -> None:
        """Take the working tree, which must be what is committed, without earlier results."""
        del options
        command = ["git", "status", "--porcelain"]
        changed = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
        if changed.stdout:
            raise SystemExit(f"the working tree has changes:\n{changed.stdout}")
        shutil.rmtree(ROOT / "dist", ignore_errors=True)
        self.folder = ROOT

    def actions_upload_artifact(self, options: Json) -> None:
        """Keep a folder for later jobs."""
        shutil.copytree(self.folder / options["path"], self.out / "artifacts" / options["name"])

    def actions_download_artifact(self, options: Json) -> None:
        """Copy the folder of an earlier job."""
        shutil.copytree(self.out / "artifacts" / options["name"], self.folder / options["path"])

    def actions_attest(self, options: Json) -> None:
        """Write the provenance's subjects; GitHub adds what built them, and where."""
        path = self.folder / options["subject-checksums"]
        digests = {}
        for line in path.read_text().splitlines():
            digest, _, name = line.partition("  ")
            if _digest(path.parent / name) != digest:
                raise SystemExit(f"{name}: its SHA-256 is not {digest}")
            digests[name] = digest
        self.write("provenance", _statement("https://slsa.dev/provenance/v1", digests))

    def pypa_gh_action_pypi_publish(self, options: Json) -> None:
        """Check what would be uploaded, and write the statement of each file, to be signed."""
        from pypi_attestations import AttestationType, Distribution  # noqa: PLC0415

        files = sorted((self.folder / options.get("packages-dir", "dist")).iterdir())
        subprocess.run([sys.executable, "-m", "twine", "check", "--strict", *files], check=True)
        for file in files:
            one = Distribution.from_file(file)
            kind = AttestationType.PYPI_PUBLISH_V1.value
            self.write(f"{one.name}.publish", _statement(kind, {one.name: one.digest}))
            print(f"would upload: {one.digest} {one.name}")

    def write(self, name: str, statement: bytes) -> None:
        """Write a statement."""
        folder = self.out / "statements"
        folder.mkdir(exist_ok=True)
        (folder / f"{name}.json").write_bytes(statement)


def in_order(jobs: Mapping[str, Json]) -> Iterator[tuple[str, Json]]:
    """Yield the jobs, each after the one that it needs."""
    done: set[str] = set()
    while len(done) < len(jobs):
        ready = [
            name
            for name, job in jobs.items()
            if name not in done and job.get("needs") in {None, *done}
        ]
        if not ready:
            raise SystemExit("jobs need each other in a circle")
        yield ready[0], jobs[ready[0]]
        done.add(ready[0])


def main() -> None:
    """Run a workflow."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("workflow", type=Path)
    parser.add_argument("--tag", required=True)
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "release")
    parser.add_argument(
        "--leave-out", default="", help="steps that are not run, between semicolons"
    )
    options = parser.parse_args()
    for name in ("jobs", "artifacts", "statements"):
        shutil.rmtree(options.out / name, ignore_errors=True)
    for name, job in in_order(yaml.safe_load(options.workflow.read_text())["jobs"]):
        if job.get("if", CONDITION) != CONDITION:
            raise SystemExit(f"{name}: if: {job['if']} is not known here")
        matrix = job.get("strategy", {}).get("matrix", {})
        for values in itertools.product(*matrix.values()):
            combination = dict(zip(matrix, values, strict=True))
            Job(options.out.resolve(), options.tag, name, job, combination).run(
                options.leave_out.split(";")
            )
    print(f"nothing was sent; artifacts and statements are in {options.out}")


if __name__ == "__main__":
    main()
