#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""Relocalisation on images: is the camera found again after it was carried away, and never where it is not?

Usage: benchmarks/kidnap.py build/release/photoslam SCRATCH [--sensors rgbd,mono] [--jumps 100] [--foreign 1000]

Films several laps of the built-in room, maps the first one, then localises in that map only (`--localize-only`):
1. Kidnapping: the later laps cut into pieces of two seconds that begin at random places, one after the other without a
   gap in time. Found: a pose within 10 cm and 5 degrees of the truth within the two seconds. The later laps also look
   where the first did not: pieces are taken where every view is within a metre and 45 degrees of a mapped one.
2. Another place: a walk through corridors and round a courtyard. Every pose there is a false one. (The house and rooms of
   other seeds have the same furniture, some of it in the same arrangement: a pose there is not false.)
The single camera sees the colour images of the same films.
"""
import argparse
import json
import math
import pathlib
import random
import subprocess
import sys

LAP_FRAMES, LAPS, RATE = 300, 3, 30
PIECE_SECONDS, STEP = 2.0, 3  # every third frame: 10 Hz
MAX_METRES, MAX_DEGREES = 0.10, 5.0
NEAR_METRES, NEAR_DEGREES = 1.0, 45.0  # of a mapped view


def call(*command: object) -> None:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")


def film(program: str, world: str, frames: int, folder: pathlib.Path, *options: object) -> pathlib.Path:
    if not (folder / "groundtruth.txt").exists():
        call(program, "synth", world, "--frames", frames, "--format", "tum", "--noise", 3, "--output", folder, *options)
    return folder


def read_list(path: pathlib.Path) -> list[list[str]]:
    return [line.split() for line in path.read_text().splitlines() if line and not line.startswith("#")]


def write_list(path: pathlib.Path, rows: list[list[str]]) -> None:
    path.write_text("".join(" ".join(row) + "\n" for row in rows))


def pick(sequence: pathlib.Path, frames: list[int], rate: float, folder: pathlib.Path) -> None:
    """A TUM sequence of these frames of another one, in this order, at a rate of its own; images are linked."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("rgb", "depth"):
        if not (folder / name).exists():
            (folder / name).symlink_to((sequence / name).resolve())
    (folder / "camera.yaml").write_text((sequence / "camera.yaml").read_text())
    for name in ("rgb.txt", "depth.txt", "groundtruth.txt"):
        rows = read_list(sequence / name)
        write_list(folder / name, [[f"{i / rate:.6f}"] + rows[f][1:] for i, f in enumerate(frames)])


Quaternion = tuple[float, float, float, float]  # x, y, z, w


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def conjugate(q: Quaternion) -> Quaternion:
    return (-q[0], -q[1], -q[2], q[3])


def degrees_between(a: Quaternion, b: Quaternion) -> float:
    return math.degrees(2 * math.acos(min(1.0, abs(multiply(conjugate(a), b)[3]))))


def rotate(q: Quaternion, v: list[float]) -> list[float]:
    x, y, z, _ = multiply(multiply(q, (v[0], v[1], v[2], 0.0)), conjugate(q))
    return [x, y, z]


def read_poses(path: pathlib.Path) -> dict[int, tuple[list[float], Quaternion]]:
    """Position and orientation by time in milliseconds."""
    poses = {}
    for row in read_list(path):
        t, *v = map(float, row)
        poses[round(1e3 * t)] = (v[:3], tuple(v[3:7]))
    return poses


class Alignment:
    """Truth from estimate: by the first pose of the mapping run and, for a single camera, its measured scale."""

    def __init__(self, run: pathlib.Path, truth: dict):
        estimate = read_poses(run / "trajectory.tum")
        self.scale = json.loads((run / "report.json").read_text())["ate"]["scale"]
        t = min(set(estimate) & set(truth))
        (p, q), (tp, tq) = estimate[t], truth[t]
        self.rotation = multiply(tq, conjugate(q))
        moved = rotate(self.rotation, [self.scale * x for x in p])
        self.shift = [a - b for a, b in zip(tp, moved)]

    def errors(self, estimate: tuple, truth: tuple) -> tuple[float, float]:
        moved = rotate(self.rotation, [self.scale * x for x in estimate[0]])
        metres = math.dist([a + b for a, b in zip(moved, self.shift)], truth[0])
        return metres, degrees_between(truth[1], multiply(self.rotation, estimate[1]))


def localise(program: str, sequence: pathlib.Path, sensor: str, session: pathlib.Path, output: pathlib.Path) -> None:
    call(program, "run", sequence, "--sensor", sensor, "--load-map", session, "--localize-only", "--deterministic",
         "--output", output)


def starts_inside(views: list[tuple], piece_frames: int) -> list[int]:
    """Where pieces may begin: every view of theirs is near one of the first lap."""
    mapped = views[:LAP_FRAMES]
    near = [any(math.dist(p, m) <= NEAR_METRES and degrees_between(q, n) <= NEAR_DEGREES for m, n in mapped)
            for p, q in views]
    return [s for s in range(LAP_FRAMES, len(views) - piece_frames) if all(near[s:s + piece_frames])]


def kidnap(program: str, film_of_laps: pathlib.Path, sensor: str, scratch: pathlib.Path, jumps: int) -> Alignment:
    mapped, moved = scratch / "mapped", scratch / "kidnapped"
    pick(film_of_laps, list(range(LAP_FRAMES)), RATE, mapped)
    run = scratch / f"map_{sensor}"
    call(program, "run", mapped, "--sensor", sensor, "--deterministic", "--iterations-per-frame", 0, "--output", run)
    alignment = Alignment(run, read_poses(mapped / "groundtruth.txt"))

    dice = random.Random(7)
    piece = int(PIECE_SECONDS * RATE / STEP)
    views = list(read_poses(film_of_laps / "groundtruth.txt").values())
    starts = dice.choices(starts_inside(views, piece * STEP), k=jumps)
    pick(film_of_laps, [s + STEP * i for s in starts for i in range(piece)], RATE / STEP, moved)
    localise(program, moved, sensor, run, scratch / f"kidnap_{sensor}")
    truth = read_poses(moved / "groundtruth.txt")
    estimate = read_poses(scratch / f"kidnap_{sensor}" / "trajectory_online.tum")
    times = sorted(truth)
    found, waits, wrong = 0, [], 0
    for jump in range(jumps):
        good = None
        for i in range(piece):
            t = times[jump * piece + i]
            if t not in estimate:
                continue
            metres, degrees = alignment.errors(estimate[t], truth[t])
            if metres <= MAX_METRES and degrees <= MAX_DEGREES:
                good = i if good is None else good
            else:
                wrong += 1
        if good is not None:
            found += 1
            waits.append(good * STEP / RATE)
    waits.sort()
    print(f"{sensor:6} kidnapped {jumps}: found {found} within {PIECE_SECONDS} s, "
          f"median {waits[len(waits) // 2] if waits else math.nan:.2f} s; poses that are wrong: {wrong}", flush=True)
    return alignment


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scratch", type=pathlib.Path)
    parser.add_argument("--sensors", default="rgbd,mono")
    parser.add_argument("--jumps", type=int, default=100)
    parser.add_argument("--foreign", type=int, default=1000)
    arguments = parser.parse_args()
    program, scratch = arguments.program, arguments.scratch
    laps = film(program, "room", LAP_FRAMES * LAPS, scratch / "laps")
    half = arguments.foreign // 2
    others = [film(program, "corridors", half, scratch / "corridors", "--fps", 10),
              film(program, "courtyard", arguments.foreign - half, scratch / "courtyard")]
    for sensor in arguments.sensors.split(","):
        kidnap(program, laps, sensor, scratch, arguments.jumps)
        for other in others:
            output = scratch / f"foreign_{sensor}_{other.name}"
            localise(program, other, sensor, scratch / f"map_{sensor}", output)
            false_poses = len(read_poses(output / "trajectory_online.tum"))
            print(f"{sensor:6} {other.name}: {false_poses} poses in {len(read_list(other / 'rgb.txt'))} frames",
                  flush=True)


if __name__ == "__main__":
    main()
