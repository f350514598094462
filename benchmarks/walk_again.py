#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""Films the first lap of the built-in room twice, the second time from beside: as a person walks a way again.

Usage: benchmarks/walk_again.py build/release/photoslam SCRATCH [--metres 0.3] [--degrees 10] [--reflections 1]

The second lap swings around the first one: up to so many metres aside, half as far ahead or behind and a third up or down,
and up to so many degrees to the side and half as many up. It sees the same surfaces. SCRATCH/again is a sequence for
benchmarks/second_lap.py; the folder must not be there yet.
"""
import argparse
import math
import pathlib

from kidnap import Quaternion, call, multiply, read_poses, rotate
from relocalisation import turn, write_walk

LAP_FRAMES, RATE = 300, 30


def beside(position: list[float], orientation: Quaternion, lap: float, metres: float, degrees: float) -> tuple:
    """The view at this share of the lap, as seen the second time; camera axes: x right, y down, z ahead."""
    def swing(times: float, size: float) -> float:
        return min(1.0, 10 * lap, 10 * (1 - lap)) * size * math.sin(2 * math.pi * times * lap)
    shift = rotate(orientation, [swing(2, metres), swing(5, metres / 3), swing(3, metres / 2)])
    turned = multiply(multiply(orientation, turn(1, swing(2.5, degrees))), turn(0, swing(3.5, degrees / 2)))
    return [p + s for p, s in zip(position, shift)], turned


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("scratch", type=pathlib.Path)
    parser.add_argument("--metres", type=float, default=0.3)
    parser.add_argument("--degrees", type=float, default=10.0)
    parser.add_argument("--reflections", default="1", help="share of mirrored light; 0: all is matt")
    a = parser.parse_args()
    a.scratch.mkdir(parents=True, exist_ok=True)
    first, walk = a.scratch / "first", a.scratch / "walk.txt"
    if not first.exists():
        call(a.program, "synth", "room", "--frames", LAP_FRAMES, "--format", "tum", "--output", first)
    lap = [pose for _, pose in sorted(read_poses(first / "groundtruth.txt").items())]
    again = [beside(*pose, i / LAP_FRAMES, a.metres, a.degrees) for i, pose in enumerate(lap)]
    write_walk(lap + again, walk, RATE)
    call(a.program, "synth", "room", "--frames", 2 * LAP_FRAMES, "--format", "tum", "--trajectory", walk, "--reflections",
         a.reflections, "--output", a.scratch / "again")


if __name__ == "__main__":
    main()
