#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""Checks the size caps and the house rules that a formatter cannot: licence header, no machine paths, no loose ends.

With --list N also prints the N longest functions.
"""

import argparse
import re
import statistics
import subprocess
import sys
from pathlib import Path

MAX_FILE_LINES = 800
MAX_FUNCTION_LINES = 100
MAX_KERNEL_LINES = 150
KERNEL = re.compile(r"src/splatting/(cpu|cuda)/|-inl\.h$|\.cuh?$")

ROOT = Path(__file__).resolve().parent.parent
CPP = {".h", ".cpp", ".cu", ".cuh"}
SCRIPTS = {".py", ".sh", ".cmake"}
HEADER = ["Copyright the photoslam authors.", "SPDX-License-Identifier: Apache-2.0"]
MACHINE_PATH = re.compile(r"(?<![\w.])/(work|root|home|Users)/\w+")
# Assembled from parts so that this file passes its own check.
LOOSE_END = re.compile(r"\b(TO" r"DO|FIX" r"ME|XX" r"X|HA" r"CK)\b")
LITERALS_AND_COMMENTS = re.compile(
    r'R"([^(\s]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![0-9A-Fa-f])\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*.*?\*/'
    r"|^[ \t]*#(?:\\\n|[^\n])*",
    re.DOTALL | re.MULTILINE,
)


def tracked_files():
    command = ["git", "-C", str(ROOT), "ls-files", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    return [ROOT / name for name in sorted(set(names)) if (ROOT / name).is_file()]


def functions(text):
    """Yields (name, first line, number of lines) of every function body; good to a few lines, no full parser."""
    code = LITERALS_AND_COMMENTS.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    scopes = []  # (is the body of a function, position of its head)
    head_start = 0
    for match in re.finditer(r"[{};]", code):
        if match[0] == "{":
            head = code[head_start : match.start()]
            inside_function = any(is_function for is_function, _ in scopes)
            declares = re.search(r"\b(namespace|class|struct|union|enum|extern)\b[^()=]*$", head)
            is_function = not inside_function and ")" in head and not declares and not head.rstrip().endswith("=")
            scopes.append((is_function, head_start + len(head) - len(head.lstrip())))
        elif match[0] == "}" and scopes:
            is_function, start = scopes.pop()
            if is_function:
                head = code[start : start + 200].split("{")[0]
                name = re.search(r"([\w:~]+)\s*\(", head)
                first = code.count("\n", 0, start) + 1
                yield (name[1] if name else "?"), first, code.count("\n", start, match.end()) + 1
        head_start = match.end()


def text_problems(path, lines):
    name = path.relative_to(ROOT)
    if path.suffix in CPP | SCRIPTS or path.name == "CMakeLists.txt":
        start = 1 if lines and lines[0].startswith("#!") else 0
        mark = "//" if path.suffix in CPP else "#"
        for offset, expected in enumerate(HEADER):
            if len(lines) <= start + offset or lines[start + offset] != f"{mark} {expected}":
                yield f"{name}:{start + offset + 1}: expected '{mark} {expected}'"
    for index, line in enumerate(lines, 1):
        if MACHINE_PATH.search(line):
            yield f"{name}:{index}: path of one machine"
        if LOOSE_END.search(line):
            yield f"{name}:{index}: loose end; finish it or describe the limit in the documentation"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--list", type=int, default=0, metavar="N", help="print the N longest functions")
    arguments = parser.parse_args()
    problems, lengths, all_functions = [], [], []
    for path in tracked_files():
        if path.suffix in {".png", ".jpg", ".ply", ".npy"}:
            continue
        lines = path.read_text(encoding="utf-8").splitlines()
        problems += text_problems(path, lines)
        if path.suffix not in CPP:
            continue
        name = path.relative_to(ROOT).as_posix()
        lengths.append(len(lines))
        if len(lines) > MAX_FILE_LINES:
            problems.append(f"{name}: {len(lines)} lines, at most {MAX_FILE_LINES}")
        cap = MAX_KERNEL_LINES if KERNEL.search(name) else MAX_FUNCTION_LINES
        for function, first, count in functions("\n".join(lines)):
            all_functions.append((count, f"{name}:{first}: {function}"))
            if count > cap:
                problems.append(f"{name}:{first}: {function} has {count} lines, at most {cap}")
    for problem in problems:
        print(f"sizes: {problem}", file=sys.stderr)
    for count, where in sorted(all_functions, reverse=True)[: arguments.list]:
        print(f"{count:5d}  {where}")
    if lengths:
        print(f"sizes: {len(lengths)} C++ files, {sum(lengths)} lines, median {statistics.median(lengths):.0f}, "
              f"longest {max(lengths)}; {len(all_functions)} functions, "
              f"longest {max((count for count, _ in all_functions), default=0)}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
