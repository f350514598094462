#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""Generalisation: maps a stretch of a sequence, goes on tracking in that map only, and scores the renders of both.

Usage: benchmarks/second_lap.py build/release/photoslam SEQUENCE OUTPUT [--map-until 10] [--sensor rgbd] [--deterministic]

Everything is rendered at tracked poses. Of the later frames those pixels count whose surface the mapped stretch saw, by
measured depth and groundtruth.txt, and those frames of which at least half was seen.
"""
import argparse
import csv
import pathlib
import statistics
import subprocess

MIN_SHARE = 0.5


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("sequence", type=pathlib.Path)
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("--map-until", type=float, default=10.0)
    parser.add_argument("--sensor", default="auto")
    parser.add_argument("--deterministic", action="store_true")
    a = parser.parse_args()
    command = [a.program, "run", str(a.sequence), "--sensor", a.sensor, "--map-until", str(a.map_until), "--output",
               str(a.output)] + (["--deterministic"] if a.deterministic else [])
    subprocess.run(command, check=True, capture_output=True)
    table = a.output / "scores.csv"
    subprocess.run([a.program, "eval", str(a.output), "--seen-until", str(a.map_until), "--table", str(table)],
                   check=True, capture_output=True)
    rows = list(csv.DictReader(table.open()))
    end = float(rows[0]["timestamp"]) + a.map_until
    groups = {"mapped": [r for r in rows if float(r["timestamp"]) <= end]}
    later = [r for r in rows if float(r["timestamp"]) > end]
    groups["later, seen surfaces"] = [r for r in later if float(r["share"]) >= MIN_SHARE]
    print(f"| frames | number of {len(rows)} | pixels that count | PSNR dB | SSIM |\n|---|---|---|---|---|")
    for name, group in groups.items():
        if group:
            share, psnr, ssim = (statistics.fmean(float(r[c]) for r in group) for c in ("share", "psnr_db", "ssim"))
            print(f"| {name} | {len(group)} | {share:.0%} | {psnr:.2f} | {ssim:.3f} |")


if __name__ == "__main__":
    main()
