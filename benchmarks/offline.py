#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""The paper's Table 5: mapping online against offline training as in 3D Gaussian splatting, in equal time.

Usage: benchmarks/offline.py build/release/photoslam SEQUENCE OUTPUT [--sensor rgbd] [--refine-seconds 0] [--seed 1]

The sequence is run once at real-time pace. Offline training then gets the run's keyframes and their poses, all of them
from the start, and as many seconds as the run took; it begins from 100 or 10 000 random gaussians or from the run's own
map, and adds to them by splitting and cloning only. All maps are scored alike: over all frames, at the run's poses.
Prints the table and writes it to OUTPUT/offline.md.
"""
import argparse
import json
import pathlib
import shutil
import subprocess


def call(arguments, *words: str) -> str:
    return subprocess.run([arguments.program, *words], capture_output=True, text=True, check=True).stdout


def line(name: str, figures: dict, gaussians: int, megabytes: float, seconds: float) -> str:
    text = (f"| {name} | {figures['psnr_db']:.2f} | {figures['psnr_p5_db']:.2f} | {figures['ssim']:.3f} | {gaussians} | "
            f"{megabytes:.1f} | {seconds:.0f} |")
    print(text, flush=True)
    return text


def vertices(ply: pathlib.Path) -> int:
    header = ply.read_bytes()[:400].decode("ascii", "replace")
    return int(header.split("element vertex ")[1].split()[0])


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("sequence")
    parser.add_argument("output", type=pathlib.Path)
    parser.add_argument("--sensor", default="auto")
    parser.add_argument("--refine-seconds", default="0")
    parser.add_argument("--seed", default="1")
    arguments = parser.parse_args()
    ours = arguments.output / "online"
    report = json.loads(call(arguments, "run", arguments.sequence, "--output", str(ours), "--sensor", arguments.sensor,
                             "--refine-seconds", arguments.refine_seconds, "--seed", arguments.seed, "--json"))
    seconds = report["seconds_total"]
    lines = ["| map | PSNR dB | worst 5 % | SSIM | gaussians | MB | s |", "|---|---|---|---|---|---|---|"]
    print("\n".join(lines))
    lines.append(line("online", report["image"], report["mapping"]["gaussians"], report["map"]["size_mb"], seconds))
    for name, start in (("offline from 100 random", "random:100"), ("offline from 10 000 random", "random:10000"),
                        ("offline from the online map", str(ours / "map.ply"))):
        folder = arguments.output / name.replace(" ", "-")
        # The gaussians must fit the run's poses, at which everything is scored: they stay as they are.
        call(arguments, "train", "--poses", str(ours), "--init", start, "--seconds", f"{seconds:.1f}", "--output",
             str(folder), "--seed", arguments.seed, "--set", "photorealistic_mapping.poses.enabled=false")
        scored = arguments.output / "scored"
        shutil.copytree(ours, scored, dirs_exist_ok=True)
        for file in ("map.ply", "exposures.txt"):
            shutil.copy(folder / file, scored / file)
        figures = json.loads(call(arguments, "eval", str(scored), "--json"))["image"]
        lines.append(line(name, figures, vertices(folder / "map.ply"), 1e-6 * (folder / "map.ply").stat().st_size,
                          seconds))
        shutil.rmtree(scored)
    (arguments.output / "offline.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
