#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""A looped sequence for a long time: memory, gaussians and picture quality over the laps.

Usage: benchmarks/long_run.py build/release/photoslam SEQUENCE OUTPUT [--minutes 30] [--every 3] [--iterations 1]

SEQUENCE (TUM layout, at 640x480 or less) ends about where it begins. Its frames come again and again with new
timestamps; nothing is copied. The run is deterministic: as fast as it goes, with so many iterations per frame. Prints a
line per lap for the first ten laps and then for every tenth, from the program's own progress: resident memory at its
largest, gaussians, keyframes and the running PSNR of what is trained; at the end the figures of the report.
"""
import argparse
import json
import pathlib
import re
import subprocess

PROGRESS = re.compile(r"frame (\d+)/\d+ .*: (\d+) keyframes, (\d+) gaussians, \d+ iterations, PSNR ([\d.]+) dB")


def read_list(path: pathlib.Path) -> list[list[str]]:
    return [line.split() for line in path.read_text().splitlines() if line and not line.startswith("#")]


def loop(sequence: pathlib.Path, target: pathlib.Path, every: int, seconds: float) -> int:
    """Writes the lists of the looped sequence; returns its frames per lap."""
    target.mkdir(parents=True, exist_ok=True)
    for name in ("camera.yaml", "rgb", "depth"):
        if not (target / name).exists():
            (target / name).symlink_to((sequence / name).resolve())
    per_lap = 0
    for name in ("rgb.txt", "depth.txt", "groundtruth.txt"):
        rows = read_list(sequence / name)[::every]
        times = [float(row[0]) for row in rows]
        lap = times[-1] - times[0] + (times[1] - times[0])
        laps = round(seconds / lap)
        per_lap = len(rows)
        (target / name).write_text("".join(
            f"{time + k * lap:.9f} {' '.join(row[1:])}\n" for k in range(laps) for time, row in zip(times, rows)))
    return per_lap


def resident_mb(pid: int) -> float:
    try:
        status = pathlib.Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0
    found = re.search(r"VmRSS:\s+(\d+) kB", status)
    return int(found.group(1)) * 1.024e-3 if found else 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("sequence", type=pathlib.Path)
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--every", type=int, default=3)
    parser.add_argument("--iterations", default="1")
    parser.add_argument("--threads", default="0")
    a = parser.parse_args()
    per_lap = loop(a.sequence, a.output / "looped", a.every, 60 * a.minutes)
    command = [a.program, "run", str(a.output / "looped"), "--output", str(a.output / "run"), "--deterministic", "--threads",
               a.threads, "--iterations-per-frame", a.iterations, "--no-session", "--json"]
    print("| lap | largest memory MB | keyframes | gaussians | PSNR of training dB |\n|---|---|---|---|---|", flush=True)
    lap, largest = 0, 0.0
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        for line in process.stderr:
            largest = max(largest, resident_mb(process.pid))
            found = PROGRESS.search(line)
            if not found or int(found.group(1)) // per_lap <= lap:
                continue
            lap = int(found.group(1)) // per_lap
            if lap <= 10 or lap % 10 == 0:
                print(f"| {lap} | {largest:.0f} | {found.group(2)} | {found.group(3)} | {found.group(4)} |", flush=True)
                largest = 0.0
        report = json.loads(process.stdout.read())
    image, frames = report["image"], report["frames"]
    if image["psnr_db"] is None:
        print(f"stopped after {frames['total']} frames")
        return
    print(f"all {frames['total']} frames: {image['psnr_db']:.2f} dB, worst 5 % {image['psnr_p5_db']:.2f} dB, lost "
          f"{frames['lost']}, peak memory {report['memory']['peak_rss_mb']:.0f} MB")


if __name__ == "__main__":
    main()
