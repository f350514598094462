#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""Runs clang-tidy-19 on the C++ sources, or on those touched by the latest commits.

Needs a configured build folder (compile_commands.json), not a finished build.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def compiled_sources(build):
    commands = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
    return sorted({Path(command["file"]) for command in commands})


def files_changed_since(date):
    """Files of the commits since that date, those of the newest commit first."""
    command = ["git", "-C", str(ROOT), "log", f"--since={date}", "--name-only", "--format=", "--", "*.cpp", "*.h"]
    names = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    return list(dict.fromkeys(ROOT / name for name in names if name))


def check(build, source):
    command = ["clang-tidy-19", "--quiet", "-p", str(build), str(source)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    problems = [line for line in result.stdout.splitlines() if line.strip()]
    if result.returncode != 0 and not problems:
        problems = result.stderr.splitlines()
    return result.returncode, problems


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sources", nargs="*", type=Path, help="only these files")
    parser.add_argument("--build", type=Path, default=ROOT / "build" / "release")
    parser.add_argument("--since", metavar="DATE", help="only files of the commits since then, newest first")
    parser.add_argument("--newest", type=int, metavar="N", help="with --since: only the N newest of them")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()

    sources = compiled_sources(arguments.build)
    if arguments.sources:
        wanted = {path.resolve() for path in arguments.sources}
        sources = [source for source in sources if source in wanted]
    if arguments.since:
        changed = [path.with_suffix(".cpp") for path in files_changed_since(arguments.since)]
        sources = [path for path in dict.fromkeys(changed) if path in set(sources)][: arguments.newest]

    start = time.monotonic()
    bad = []

    def run(source):
        code, problems = check(arguments.build, source)
        if code != 0:
            bad.append(source)
            print("\n".join(problems), flush=True)

    with ThreadPoolExecutor(arguments.jobs) as pool:
        list(pool.map(run, sources))
    print(f"clang-tidy: {len(sources)} files in {time.monotonic() - start:.0f} s, {len(bad)} with findings")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
