#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""A session is loaded and the camera switched on somewhere in the same room: how soon does it know where it is?

Usage: benchmarks/relocalisation.py build/release/photoslam SCRATCH [--sensors rgbd,mono] [--places 50]

One film of the built-in room is mapped and saved. A second film shows places from a walk of its own: beside a random view
of the first film, by up to 30 cm and 20 degrees, moving and turning from there, with another noise. At every place the
program is started anew (`--load-map --localize-only`). Found: a pose within 10 cm and 5 degrees of the truth within one
second. Poses beyond that are counted as wrong.
"""
import argparse
import math
import pathlib
import random
import sys

from kidnap import (MAX_DEGREES, MAX_METRES, Alignment, Quaternion, call, film, localise, multiply, pick, read_poses,
                    rotate)

MAPPED_FRAMES = 300
RATE, FRAMES = 5, 6  # of a place: one second
MAX_SHIFT_M, MAX_RISE_M, MAX_TURN_DEG = 0.3, 0.1, 20.0
SPEED_M_S, TURN_DEG_S = 0.3, 15.0


def turn(axis: int, degrees: float) -> Quaternion:
    q = [0.0, 0.0, 0.0, math.cos(math.radians(degrees) / 2)]
    q[axis] = math.sin(math.radians(degrees) / 2)
    return tuple(q)


def walk(views: list[tuple[list[float], Quaternion]], places: int) -> list[tuple[list[float], Quaternion]]:
    """FRAMES poses for each place, one place after the other."""
    dice = random.Random(7)
    poses = []
    for position, orientation in dice.choices(views, k=places):
        shift = [dice.uniform(-MAX_SHIFT_M, MAX_SHIFT_M), dice.uniform(-MAX_SHIFT_M, MAX_SHIFT_M),
                 dice.uniform(-MAX_RISE_M, MAX_RISE_M)]
        aside, up = dice.uniform(-MAX_TURN_DEG, MAX_TURN_DEG), dice.uniform(-0.5 * MAX_TURN_DEG, 0.5 * MAX_TURN_DEG)
        velocity = [dice.uniform(-SPEED_M_S, SPEED_M_S) for _ in range(3)]  # as the camera sees it
        turning = dice.uniform(-TURN_DEG_S, TURN_DEG_S)
        for i in range(FRAMES):
            t = i / RATE
            moved = rotate(orientation, [t * v for v in velocity])
            poses.append(([p + s + m for p, s, m in zip(position, shift, moved)],
                          multiply(multiply(orientation, turn(1, aside + t * turning)), turn(0, up))))
    return poses


def write_walk(poses: list[tuple[list[float], Quaternion]], path: pathlib.Path, rate: float) -> pathlib.Path:
    lines = (" ".join(f"{x:.9f}" for x in (i / rate, *position, *orientation)) for i, (position, orientation)
             in enumerate(poses))
    path.write_text("\n".join(lines) + "\n")
    return path


def study(program: str, sensor: str, scratch: pathlib.Path, mapped: pathlib.Path, visited: pathlib.Path,
          places: int) -> None:
    session = scratch / f"session_{sensor}"
    if not (session / "session.photoslam").exists():
        call(program, "run", mapped, "--sensor", sensor, "--deterministic", "--iterations-per-frame", 0, "--output",
             session)
    alignment = Alignment(session, read_poses(mapped / "groundtruth.txt"))
    waits, wrong = [], 0
    for place in range(places):
        here, output = scratch / f"place_{place}", scratch / f"out_{sensor}"
        pick(visited, list(range(place * FRAMES, (place + 1) * FRAMES)), RATE, here)
        localise(program, here, sensor, session, output)
        truth, estimate = read_poses(here / "groundtruth.txt"), read_poses(output / "trajectory_online.tum")
        good = []
        for t in sorted(set(truth) & set(estimate)):
            metres, degrees = alignment.errors(estimate[t], truth[t])
            if metres <= MAX_METRES and degrees <= MAX_DEGREES:
                good.append(1e-3 * t)
            else:
                wrong += 1
        if good:
            waits.append(good[0])
    at_once = sum(w == 0 for w in waits)
    print(f"{sensor:6} {places} places: found {len(waits)} within a second, {at_once} of them in the first image, "
          f"the last after {max(waits, default=math.nan):.1f} s; poses that are wrong: {wrong}", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scratch", type=pathlib.Path)
    parser.add_argument("--sensors", default="rgbd,mono")
    parser.add_argument("--places", type=int, default=50)
    arguments = parser.parse_args()
    program, scratch = arguments.program, arguments.scratch
    scratch.mkdir(parents=True, exist_ok=True)
    mapped = film(program, "room", MAPPED_FRAMES, scratch / "mapped")
    views = list(read_poses(mapped / "groundtruth.txt").values())
    poses = walk(views, arguments.places)
    visited = film(program, "room", len(poses), scratch / "visited", "--fps", RATE, "--trajectory",
                   write_walk(poses, scratch / "walk.txt", RATE))
    for sensor in arguments.sensors.split(","):
        study(program, sensor, scratch, mapped, visited, arguments.places)
    return 0


if __name__ == "__main__":
    sys.exit(main())
