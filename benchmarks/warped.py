#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""How well the beginning of a sequence foretells its later pictures: a yardstick for benchmarks/second_lap.py.

Usage: benchmarks/warped.py SEQUENCE [--until 10] [--every 3] [--later-every 20] [--sources 4]

Needs numpy and Pillow.

There is no map here. Each pixel of a later picture takes its colour from the first pictures themselves: by measured
depth and true poses it is found in those that see its surface (depths within 3 %), and is the mean of the four that are
nearest to it. SEQUENCE was made by `photoslam synth` without distortion: row i of its lists is frame i. --every and
--later-every thin the pictures, --sources tells how many are averaged. Prints the PSNR of every later picture of which at
least half was seen, and the mean.
"""
import argparse
import pathlib

import numpy as np
from PIL import Image

MIN_SHARE, TOLERANCE = 0.5, 0.03


class Sequence:
    def __init__(self, folder: pathlib.Path):
        self.folder = folder
        entries = dict(line.split("#")[0].split(":", 1) for line in (folder / "camera.yaml").read_text().splitlines()
                       if ":" in line and not line.startswith("#"))
        self.fx, self.fy, self.cx, self.cy, self.depth_scale = (
            float(entries[name]) for name in ("fx", "fy", "cx", "cy", "depth_scale"))
        self.colors, self.depths, truth = (self.rows(name) for name in ("rgb.txt", "depth.txt", "groundtruth.txt"))
        self.times = [float(row[0]) for row in self.colors]
        self.poses = [self.pose([float(x) for x in row[1:]]) for row in truth]

    def rows(self, name: str) -> list[list[str]]:
        return [line.split() for line in (self.folder / name).read_text().splitlines() if line[:1] not in ("#", "")]

    @staticmethod
    def pose(row: list[float]) -> tuple[np.ndarray, np.ndarray]:
        """world_from_camera: rotation matrix and position."""
        x, y, z, w = row[3:]
        return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                         [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                         [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]), np.array(row[:3])

    def color(self, i: int) -> np.ndarray:
        """[H, W, 3] in [0, 1]."""
        return np.asarray(Image.open(self.folder / self.colors[i][1]), np.float32) / 255

    def depth(self, i: int) -> np.ndarray:
        """[H, W] metres, 0 where unknown."""
        return np.asarray(Image.open(self.folder / self.depths[i][1]), np.float32) / self.depth_scale

    def points(self, i: int) -> np.ndarray:
        """[H * W, 3] of every pixel, in the world."""
        depth = self.depth(i)
        y, x = np.mgrid[:depth.shape[0], :depth.shape[1]]
        rays = np.stack([(x - self.cx) / self.fx, (y - self.cy) / self.fy, np.ones_like(depth)], -1)
        rotation, position = self.poses[i]
        return (rays * depth[..., None]).reshape(-1, 3) @ rotation.T + position


def bilinear(image: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    x, y = u.astype(int), v.astype(int)
    fx, fy = (u - x)[:, None], (v - y)[:, None]
    return (1 - fy) * ((1 - fx) * image[y, x] + fx * image[y, x + 1]) + fy * (
        (1 - fx) * image[y + 1, x] + fx * image[y + 1, x + 1])


def warped(sequence: Sequence, points: np.ndarray, sources: list[tuple], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Colours of the points, and in how many of the nearest pictures each was seen."""
    nearest = np.full((count, len(points)), np.inf)
    colors = np.zeros((count, len(points), 3), np.float32)
    for (rotation, position), image, depth in sources:
        p = (points - position) @ rotation
        z = np.maximum(p[:, 2], 1e-6)
        u, v = sequence.fx * p[:, 0] / z + sequence.cx, sequence.fy * p[:, 1] / z + sequence.cy
        height, width = depth.shape
        k = np.nonzero((p[:, 2] > 0.1) & (u >= 0) & (v >= 0) & (u < width - 1) & (v < height - 1))[0]
        measured = depth[np.rint(v[k]).astype(int), np.rint(u[k]).astype(int)]
        k = k[np.abs(measured - z[k]) < TOLERANCE * z[k]]
        distance, color = z[k], bilinear(image, u[k], v[k])
        for rank in range(count):  # insertion into the sorted list of each point
            nearer = distance < nearest[rank, k]
            displaced, its_color = nearest[rank, k].copy(), colors[rank, k].copy()
            nearest[rank, k] = np.where(nearer, distance, displaced)
            colors[rank, k] = np.where(nearer[:, None], color, its_color)
            distance, color = np.where(nearer, displaced, distance), np.where(nearer[:, None], its_color, color)
    found = np.isfinite(nearest)
    seen = found.sum(0)
    return (colors * found[..., None]).sum(0) / np.maximum(seen, 1)[:, None], seen


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequence", type=pathlib.Path)
    parser.add_argument("--until", type=float, default=10.0)
    parser.add_argument("--every", type=int, default=3)
    parser.add_argument("--later-every", type=int, default=20)
    parser.add_argument("--sources", type=int, default=4)
    a = parser.parse_args()
    sequence = Sequence(a.sequence)
    first = sum(time <= sequence.times[0] + a.until for time in sequence.times)
    sources = [(sequence.poses[i], sequence.color(i), sequence.depth(i)) for i in range(0, first, a.every)]
    scores = []
    for i in range(first, len(sequence.times), a.later_every):
        color, found = warped(sequence, sequence.points(i), sources, a.sources)
        seen = (found > 0) & (sequence.depth(i).ravel() > 0)
        if seen.mean() < MIN_SHARE:
            continue
        error = ((color - sequence.color(i).reshape(-1, 3)) ** 2)[seen].mean()
        scores.append(-10 * np.log10(error))
        print(f"frame {i}: {scores[-1]:.2f} dB, {seen.mean():.0%} seen", flush=True)
    print(f"mean of {len(scores)}: {np.mean(scores):.2f} dB")


if __name__ == "__main__":
    main()
