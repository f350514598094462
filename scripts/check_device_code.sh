#!/usr/bin/env bash
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
#
# Compiles and links the module of src/splatting/cuda for every GPU it supports, and the tests that run there, where
# there is an nvcc; says so and stops without an error elsewhere. Fails if a kernel spills registers, or if the table of
# what each kernel takes in docs/performance.md differs. With --write it renews the table (by nvcc 13.0).
set -euo pipefail
cd "$(dirname "$0")/.."

nvcc=$(command -v nvcc || true)
[ -n "$nvcc" ] || { [ -x /usr/local/cuda/bin/nvcc ] && nvcc=/usr/local/cuda/bin/nvcc; } || {
  echo "check_device_code: skipped, no nvcc"
  exit 0
}
release=$("$nvcc" --version | sed -n 's/.*release \([0-9.]*\).*/\1/p')
architectures="75 80 86 87 89 90"
printf '%s\n' 12.8 "$release" | sort --version-sort --check=quiet && architectures+=" 100"
newest=${architectures##* }
flags=(-std=c++20 -Werror all-warnings -Isrc -Xcompiler -fPIC,-Wall,-Wextra,-Wshadow)
for architecture in $architectures; do flags+=(-gencode "arch=compute_$architecture,code=sm_$architecture"); done
flags+=(-gencode "arch=compute_$newest,code=compute_$newest")

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
"$nvcc" "${flags[@]}" -Xptxas -v -shared src/splatting/cuda/cuda_module.cu -o "$scratch/photoslam_cuda.so" \
  >"$scratch/ptxas.log" 2>&1 || {
  cat "$scratch/ptxas.log"
  exit 1
}
for test in engine_test undistorter_test; do
  "$nvcc" -std=c++20 -Werror all-warnings -Isrc/splatting/standalone/include -Isrc -arch="sm_$newest" -x cu \
    -c "src/splatting/cuda/$test.cpp" -o "$scratch/$test.o"
done
python3 - "$scratch/ptxas.log" "$release" "${1:-}" <<'PYTHON'
import re
import sys

log, release, mode = sys.argv[1:]
SHOWN = ("75", "90")
used = {}
for entry in open(log, encoding="utf-8").read().split("Compiling entry function")[1:]:
    name = re.search(r"run_kernelINS\w*?_\d+([A-Z][A-Za-z]+?)E", entry)[1]
    architecture = re.search(r"for 'sm_(\d+)'", entry)[1]
    shared = re.search(r"(\d+) bytes smem", entry)
    used.setdefault(name, {})[architecture] = (
        int(re.search(r"Used (\d+) registers", entry)[1]),
        int(shared[1]) if shared else 0,
        int(re.search(r"(\d+) bytes stack frame", entry)[1]),
        sum(map(int, re.findall(r"(\d+) bytes spill", entry))),
    )
lines = ["| kernel |" + "".join(f" sm_{a}: registers | shared B | stack B | spilled B |" for a in SHOWN)]
lines.append("|---|" + "---|" * (4 * len(SHOWN)))
for name, rows in sorted(used.items()):
    lines.append(f"| {name} |" + "".join(f" {value} |" for a in SHOWN for value in rows[a]))
table = "\n".join(lines)
spilling = [name for name, rows in used.items() if any(row[3] for row in rows.values())]
if spilling:
    sys.exit(f"{table}\ncheck_device_code: these kernels spill registers: {' '.join(spilling)}")
page = "docs/performance.md"
text = open(page, encoding="utf-8").read()
renewed = re.sub(r"(\(nvcc 13\.0\):\n\n)\|(?:.*\n)*?(?=\n|\Z)", lambda match: match[1] + table + "\n", text)
if mode == "--write" and release == "13.0":
    open(page, "w", encoding="utf-8").write(renewed)
elif release == "13.0" and renewed != text:
    sys.exit(f"{table}\ncheck_device_code: {page} shows another table; scripts/check_device_code.sh --write renews it")
PYTHON
echo "check_device_code: the module compiles and links for $architectures with nvcc $release; no kernel spills"
