#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""Runs a sequence several times in deterministic mode and compares the bytes of what comes out.

Usage: benchmarks/determinism.py build/release/photoslam SEQUENCE [--runs 3] [--iterations-per-frame 4]

Every number of threads is run `--runs` times, then once more on a copy of the sequence without its ground truth.
Prints SHA-256 and wall time of each run and the speed-up of two threads over one; exits 1 when any byte differs.
"""
import argparse
import hashlib
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

OUTPUTS = ("trajectory.tum", "keyframes.tum", "map.ply")


def digest(folder: pathlib.Path) -> str:
    total = hashlib.sha256()
    for name in OUTPUTS:
        total.update((folder / name).read_bytes())
    return total.hexdigest()


def run(program: str, sequence: pathlib.Path, threads: int, iterations: int) -> tuple[str, float]:
    """SHA-256 over the outputs, and the seconds that tracking and mapping took (measuring excluded)."""
    with tempfile.TemporaryDirectory() as output:
        command = [program, "run", str(sequence), "--output", output, "--deterministic", "--threads", str(threads),
                   "--iterations-per-frame", str(iterations), "--json"]
        result = subprocess.run(command, capture_output=True, text=True, check=True)
        seconds = float(json.loads(result.stdout)["seconds_total"])
        return digest(pathlib.Path(output)), seconds


def without_truth(sequence: pathlib.Path, scratch: pathlib.Path) -> pathlib.Path:
    copy = scratch / "sequence"
    shutil.copytree(sequence, copy, symlinks=True)
    (copy / "groundtruth.txt").unlink()
    return copy


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("sequence", type=pathlib.Path)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--iterations-per-frame", type=int, default=4)
    arguments = parser.parse_args()
    digests, fastest = set(), {}
    for threads in (1, 2):
        for _ in range(arguments.runs):
            sha, seconds = run(arguments.program, arguments.sequence, threads, arguments.iterations_per_frame)
            print(f"{threads} threads  {sha}  {seconds:6.1f} s", flush=True)
            digests.add(sha)
            fastest[threads] = min(seconds, fastest.get(threads, seconds))
    with tempfile.TemporaryDirectory() as scratch:
        copy = without_truth(arguments.sequence, pathlib.Path(scratch))
        start = time.monotonic()
        sha, seconds = run(arguments.program, copy, 2, arguments.iterations_per_frame)
        print(f"no truth   {sha}  {seconds:6.1f} s ({time.monotonic() - start:.0f} s with measuring)")
        digests.add(sha)
    print(f"{'all bytes equal' if len(digests) == 1 else 'BYTES DIFFER'}; "
          f"two threads are {fastest[1] / fastest[2]:.2f} times as fast as one")
    return 0 if len(digests) == 1 else 1


if __name__ == "__main__":
    sys.exit(main())
