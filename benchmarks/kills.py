#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""A program killed while it saves its session: is the session of before, or a newer one, always there and whole?

Usage: benchmarks/kills.py build/release/photoslam SCRATCH [--kills 200] [--seed 1]

Maps a short walk, then continues it from its session again and again, saving as often as it can, and kills the program:
every other time at a random moment of its life, else a random time after it began to write the file. After every kill
the session is loaded by a new process, which checks that it is whole; it must hold at least as many keyframes as
before. An unfinished file that is left behind tells that the kill came while it was written.
"""
import argparse
import pathlib
import random
import shutil
import subprocess
import sys
import time

FAST = ["--pace", "asap", "--threads", "1", "--set", "pipeline.iterations_per_frame=1"]


def call(*command: object) -> None:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\nexit code {done.returncode}\n{done.stderr}")


def num_keyframes(program: str, sequence: pathlib.Path, session: pathlib.Path, scratch: pathlib.Path) -> int | None:
    """Loads the session without mapping anything; None if it is refused."""
    output = scratch / "look"
    shutil.rmtree(output, ignore_errors=True)
    done = subprocess.run([program, "run", sequence, "--load-map", session, "--localize-only", "--map-until", "0",
                           "--deterministic", "--threads", "1", "--output", output], capture_output=True, text=True,
                          check=False)
    if done.returncode != 0:
        print(done.stderr, file=sys.stderr)
        return None
    return sum(not line.startswith("#") for line in (output / "keyframes.tum").read_text().splitlines())


def kill_at_random(command: list[str], chance: random.Random, life: float, writing_into: pathlib.Path | None) -> None:
    """At any moment of its life, or at one after a file of its appeared in a folder."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(chance.uniform(0, life))
    if writing_into:
        while process.poll() is None and not any(writing_into.glob("session*.tmp")):
            time.sleep(1e-4)
        time.sleep(chance.uniform(0, 0.003))
    process.kill()
    process.wait()


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("scratch", type=pathlib.Path)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    program, scratch = arguments.program, arguments.scratch
    scratch.mkdir(parents=True, exist_ok=True)
    sequence, first, output = scratch / "walk", scratch / "first", scratch / "session"
    if not sequence.exists():
        call(program, "synth", "room", "--frames", 90, "--shrink", 2, "--format", "tum", "--output", sequence)
    shutil.rmtree(first, ignore_errors=True)
    call(program, "run", sequence, "--deterministic", "--threads", 1, *FAST[4:], "--output", first)
    session = output / "session.photoslam"
    resume = [program, "run", str(sequence), "--load-map", str(output), "--output", str(output), "--autosave", "0.001",
              *FAST]

    shutil.rmtree(output, ignore_errors=True)
    shutil.copytree(first, output)
    start = time.monotonic()
    call(*resume)
    life = time.monotonic() - start
    print(f"{session.stat().st_size / 1e6:.1f} MB, a whole run takes {life:.2f} s")

    chance = random.Random(arguments.seed)
    before = num_keyframes(program, sequence, first, scratch)
    lost = newer = unfinished = 0
    for kill in range(arguments.kills):
        shutil.rmtree(output)
        shutil.copytree(first, output)
        old = session.read_bytes()
        kill_at_random(resume, chance, life, output if kill % 2 else None)
        unfinished += any(output.glob("*.tmp"))
        newer += session.read_bytes() != old
        after = num_keyframes(program, sequence, session, scratch)
        lost += after is None or after < before
    print(f"{arguments.kills} kills: {lost} sessions lost, {newer} times a newer one was there already, "
          f"{unfinished} kills while a file was written")
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
