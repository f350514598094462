#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""Loops on rendered sequences: are they found, what do they mend, and is nothing found where there is none?

Usage: benchmarks/loops.py build/release/photoslam SCRATCH [--seeds 10] [--worlds house,corridors,doors]
                           [--sensors rgbd,stereo,mono] [--noise 4] [--depth-noise 0.004] [--baseline 0.11]
                           [--set KEY=VALUE] [--keep]

For every seed another world is built, filmed with noise, and walked once and a little further; every sequence is run
twice in deterministic mode, with and without closing loops. The gap is the error of the vector from the first to the
last camera, after alignment of the whole trajectory (with scale for mono). The mapping of gaussians is switched off as
far as possible: this is about trajectories. Prints a line per run and a summary.
"""
import argparse
import json
import math
import pathlib
import shutil
import subprocess
import sys

FRAMES_PER_SECOND = 10
FRAMES = {"house": 235, "corridors": 780, "doors": 700}
SIZE = ["--shrink", "2", "--fps", str(FRAMES_PER_SECOND)]
NO_GAUSSIANS = ["--iterations-per-frame", "0", "--set", "photorealistic_mapping.depth.enabled=false", "--set",
                "photorealistic_mapping.densification.max_gaussians=100", "--no-session"]
# At 10 Hz; the default of three frames is meant for 30 Hz.
LAG = ["--set", "pipeline.keyframe_lag_frames=1"]
OPEN = ["--set", "loop_closure.enabled=false"]


def film(program: str, world: str, sensor: str, seed: int, noise: list[str], scratch: pathlib.Path) -> pathlib.Path:
    """One RGB-D sequence serves the single camera too."""
    folder = scratch / f"{world}_{'stereo' if sensor == 'stereo' else 'rgbd'}_{seed}"
    if not folder.exists():
        subprocess.run([program, "synth", world, "--sensor", "stereo" if sensor == "stereo" else "rgbd", "--frames",
                        str(FRAMES[world]), "--seed", str(seed), *SIZE, *noise, "--format",
                        "kitti" if sensor == "stereo" else "tum", "--output", str(folder)],
                       check=True, capture_output=True)
    return folder


def turned_back(rotation: list[list[float]], v: list[float]) -> list[float]:
    """The vector as a frame of this orientation (its axes are the columns) sees it."""
    return [sum(rotation[i][j] * v[i] for i in range(3)) for j in range(3)]


def matrix(x: float, y: float, z: float, w: float) -> list[list[float]]:
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def read_tum(path: pathlib.Path) -> dict[int, tuple]:
    """Rotation and position of the camera by time in milliseconds."""
    poses = {}
    for text in path.read_text().splitlines():
        if text and not text.startswith("#"):
            t, *values = map(float, text.split())
            poses[round(1e3 * t)] = (matrix(*values[3:]), values[:3])
    return poses


def read_kitti(folder: pathlib.Path) -> dict[int, tuple]:
    times = (folder / "sequences/00/times.txt").read_text().split()
    poses = {}
    for t, text in zip(times, (folder / "poses/00.txt").read_text().splitlines()):
        row = list(map(float, text.split()))
        poses[round(1e3 * float(t))] = ([row[0:3], row[4:7], row[8:11]], [row[3], row[7], row[11]])
    return poses


def first_to_last(poses: dict[int, tuple], times: list[int]) -> list[float]:
    """Where the last camera is, as the first one sees it."""
    (rotation, start), (_, end) = poses[times[0]], poses[times[-1]]
    return turned_back(rotation, [e - s for e, s in zip(end, start)])


def measure(run: pathlib.Path, sequence: pathlib.Path) -> dict:
    truth = read_tum(sequence / "groundtruth.txt") if (sequence / "groundtruth.txt").exists() else read_kitti(sequence)
    estimate = read_tum(run / "trajectory.tum")
    path = [position for _, position in truth.values()]
    length = sum(math.dist(a, b) for a, b in zip(path, path[1:]))
    times = sorted(set(truth) & set(estimate))
    report = json.loads((run / "report.json").read_text())
    scale = report["ate"]["scale"]
    gap = math.dist([scale * x for x in first_to_last(estimate, times)], first_to_last(truth, times))
    return {"gap": gap / length, "ate": report["ate"]["rmse_m"] / length, "frames": len(times) / len(truth),
            "closed": report["loops"]["closed"], "reconnected": report["loops"]["reconnected"],
            "seconds": report["seconds_total"]}


def run(program: str, sequence: pathlib.Path, sensor: str, options: list[str], output: pathlib.Path) -> dict | None:
    command = [program, "run", str(sequence), "--sensor", sensor, "--deterministic", "--threads", "1", *NO_GAUSSIANS,
               *LAG, *options, "--output", str(output)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    result = measure(output, sequence) if done.returncode == 0 else None
    if result is None:
        print(done.stderr.splitlines()[-1], file=sys.stderr)
    shutil.rmtree(output, ignore_errors=True)
    return result


def line(r: dict | None) -> str:
    if r is None:
        return "failed"
    return (f"closed {r['closed']} reconnected {r['reconnected']}  gap {100 * r['gap']:6.3f} %  "
            f"ATE {100 * r['ate']:6.3f} %  tracked {100 * r['frames']:5.1f} %  {r['seconds']:5.1f} s")


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("scratch", type=pathlib.Path)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--worlds", default="house,corridors,doors")
    parser.add_argument("--sensors", default="rgbd,stereo,mono")
    parser.add_argument("--noise", default="4", help="of the images [grey levels]")
    parser.add_argument("--depth-noise", default="0.004", help="of the depth at 1 m [m]")
    parser.add_argument("--baseline", default="0.11", help="of the stereo rig [m]")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="configuration of the program")
    parser.add_argument("--keep", action="store_true", help="leave the sequences in SCRATCH")
    arguments = parser.parse_args()
    arguments.scratch.mkdir(parents=True, exist_ok=True)
    sensors = arguments.sensors.split(",")
    settings = [word for setting in arguments.set for word in ("--set", setting)]
    noise = ["--noise", arguments.noise, "--depth-noise", arguments.depth_noise, "--baseline", arguments.baseline]
    for world in arguments.worlds.split(","):
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
            for sensor in sensors:
                sequence = film(arguments.program, world, sensor, seed, noise, arguments.scratch)
                closed = run(arguments.program, sequence, sensor, settings, arguments.scratch / "out")
                print(f"{world:9} {sensor:6} seed {seed:2}  closing  {line(closed)}", flush=True)
                if world == "doors":
                    continue  # nothing to close
                opened = run(arguments.program, sequence, sensor, OPEN + settings, arguments.scratch / "out")
                ratio = f"{opened['gap'] / closed['gap']:.1f}x" if opened and closed else ""
                print(f"{world:9} {sensor:6} seed {seed:2}  open     {line(opened)}  gap shrinks {ratio}", flush=True)
            if not arguments.keep:
                for folder in arguments.scratch.glob(f"{world}_*_{seed}"):
                    shutil.rmtree(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
