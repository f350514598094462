#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""Checks that every module includes only modules below it, and that the public headers stay small and clean.

The order is LAYERS below; src/CMakeLists.txt must list its modules in the same order.
"""

import re
import sys
from pathlib import Path

# Bottom to top. A module may include itself and the modules before it, those of its own layer to its left included.
LAYERS = [
    ["base"],
    ["math"],
    ["camera", "image", "io"],
    ["features", "geometry"],
    ["splatting", "map", "sources"],
    ["optimization"],
    ["localization", "geometry_mapping", "photorealistic_mapping", "loop_closure"],
    ["pipeline"],
    ["evaluation", "viewer"],
    ["api"],
]
ORDER = [module for layer in LAYERS for module in layer]
MAX_PUBLIC_HEADERS = 15
QUOTED_LIBRARIES = {"hwy"}  # Highway's own documentation asks for quotes
NOT_IN_PUBLIC_HEADERS = re.compile(r"opencv|cuda|thrust|cub/|nlohmann|toml\+\+|CLI/|spdlog|embree", re.IGNORECASE)

ROOT = Path(__file__).resolve().parent.parent
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
SOURCES = {".h", ".cpp", ".cu", ".cuh"}


def includes(path):
    return [(match[0], match[1]) for match in INCLUDE.findall(path.read_text(encoding="utf-8"))]


def module_problems(module):
    rank = ORDER.index(module)
    for path in sorted((ROOT / "src" / module).rglob("*")):
        if path.suffix not in SOURCES:
            continue
        for bracket, name in includes(path):
            target = name.split("/")[0]
            where = f"{path.relative_to(ROOT)}: includes {name}"
            if target in QUOTED_LIBRARIES or (bracket == "<" and "/" not in name):  # <map> is the standard library's
                continue
            if target == "photoslam":
                if module != "api":
                    yield f"{where}: the public headers are for users of the library"
                continue
            if bracket == '"' and target not in ORDER:
                yield f"{where}: write module/file.h, from the root of src"
            elif bracket == '"' and not (ROOT / "src" / name).is_file():
                yield f"{where}: no such file"
            elif target in ORDER and ORDER.index(target) > rank:
                yield f"{where}: {module} lies below {target}"


def cmake_problems():
    text = (ROOT / "src" / "CMakeLists.txt").read_text(encoding="utf-8")
    listed = list(dict.fromkeys(re.findall(r"photoslam_module\((\w+)", text)))
    for module in listed:
        if module not in ORDER:
            yield f"src/CMakeLists.txt: module {module} has no layer in scripts/check_layers.py"
    known = [module for module in listed if module in ORDER]
    if known != sorted(known, key=ORDER.index):
        yield "src/CMakeLists.txt: modules must be listed bottom to top: " + " ".join(sorted(known, key=ORDER.index))


def public_header_problems():
    headers = sorted((ROOT / "include" / "photoslam").rglob("*.h"))
    if len(headers) > MAX_PUBLIC_HEADERS:
        yield f"include/photoslam: {len(headers)} headers, at most {MAX_PUBLIC_HEADERS} allowed"
    for path in headers:
        for bracket, name in includes(path):
            if NOT_IN_PUBLIC_HEADERS.search(name) or (bracket == '"' and not name.startswith("photoslam/")):
                yield f"{path.relative_to(ROOT)}: includes {name}: not in a public header"


def main():
    problems = list(cmake_problems()) + list(public_header_problems())
    for folder in sorted((ROOT / "src").iterdir()):
        if not folder.is_dir() or not any(path.suffix in SOURCES for path in folder.rglob("*")):
            continue
        if folder.name in ORDER:
            problems += module_problems(folder.name)
        else:
            problems.append(f"src/{folder.name}: has no layer in scripts/check_layers.py")
    for problem in problems:
        print(f"layers: {problem}", file=sys.stderr)
    if not problems:
        print("layers: in order")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
