#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""Generalisation: maps a stretch of a sequence, goes on tracking in that map only, and scores the renders of both.

Usage: benchmarks/second_lap.py build/release/photoslam SEQUENCE OUTPUT [--map-until 10] [--sensor rgbd] [--deterministic]

Everything is rendered at tracked poses. Of the later frames those count that look at what was seen: a frame of the
mapped stretch was within --near-m and --near-deg of them, by ground truth (groundtruth.txt).
"""
import argparse
import csv
import math
import pathlib
import statistics
import subprocess

from kidnap import degrees_between, read_poses


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("sequence", type=pathlib.Path)
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("--map-until", type=float, default=10.0)
    parser.add_argument("--sensor", default="auto")
    parser.add_argument("--near-m", type=float, default=0.1)
    parser.add_argument("--near-deg", type=float, default=5.0)
    parser.add_argument("--deterministic", action="store_true")
    a = parser.parse_args()
    command = [a.program, "run", str(a.sequence), "--sensor", a.sensor, "--map-until", str(a.map_until), "--output",
               str(a.output)] + (["--deterministic"] if a.deterministic else [])
    subprocess.run(command, check=True, capture_output=True)
    table = a.output / "scores.csv"
    subprocess.run([a.program, "eval", str(a.output), "--table", str(table)], check=True, capture_output=True)

    truth = read_poses(a.sequence / "groundtruth.txt")  # by milliseconds
    end = min(truth) + 1e3 * a.map_until
    mapped_views = [pose for t, pose in truth.items() if t <= end]
    groups = {"mapped": [], "later, seen before": [], "later, elsewhere": []}
    for row in csv.DictReader(table.open()):
        time = round(1e3 * float(row["timestamp"]))
        position, rotation = truth[time]
        if time <= end:
            group = "mapped"
        elif any(math.dist(position, p) <= a.near_m and degrees_between(rotation, r) <= a.near_deg
                 for p, r in mapped_views):
            group = "later, seen before"
        else:
            group = "later, elsewhere"
        groups[group].append((float(row["psnr_db"]), float(row["ssim"])))
    print("| frames | number | PSNR dB | SSIM |\n|---|---|---|---|")
    for name, scores in groups.items():
        if scores:
            psnr, ssim = (statistics.fmean(column) for column in zip(*scores))
            print(f"| {name} | {len(scores)} | {psnr:.2f} | {ssim:.3f} |")


if __name__ == "__main__":
    main()
