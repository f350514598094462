#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""What gpu_check.sh reports, with stand-ins for the tools of a machine that has a GPU."""

import json
import shutil
import subprocess
import tarfile
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parent / "gpu_check.sh"

# Makes stand-ins of what the engine's build makes; what they print and end with is in the environment.
CMAKE = """
make() { echo "#!/usr/bin/env bash
$2" >"$1" && chmod +x "$1"; }
case $1 in
  -S) mkdir -p "$4" ;;
  --build)
    make "$2/engine_host_test" 'exit ${HOST_TESTS:-0}'
    if command -v nvcc >/dev/null; then
      make "$2/engine_device_test" '[ "${TESTS_HANG:-}" = "" ] || sleep 60'
      make "$2/engine_bench" 'echo "{}"'
    fi ;;
esac
exit ${BUILD:-0}
"""
GPU = 'echo "Stand-in, 1.2, 9.0"'
SANITIZER = 'case $2 in ${BAD_TOOL:-none}) exit 1 ;; esac'
# The program of a bundle; `render` writes one value, which on the GPU may be another.
PROGRAM = """
command=$1 last="${!#}"
while [ $# -gt 1 ]; do case $1 in --output) output=$2 ;; --backend) backend=$2 ;; esac; shift; done
case $command in
  synth) mkdir -p "$last" ;;
  run)
    echo "$NOTE"
    mkdir -p "$output" && echo "$REPORT" >"$output/report.json" && touch "$output/map.ply" ;;
  render)
    value=077
    [ "$backend" = cpu ] || value=${GPU_VALUE:-077}
    mkdir -p "$output" && printf '\\223NUMPY\\001\\000\\000\\000\\000\\000\\200\\'"$value" >"$output/0.npy" ;;
esac
"""
REPORT = {"frames": {"tracked": 299, "total": 300}, "image_online": {"psnr_db": 33.5}, "image": {"psnr_db": 34},
          "mapping": {"iterations": 1000, "ms_per_iteration": 1.5, "gaussians": 100000}, "tracking": {"fps": 60},
          "ate": {"rmse_m": 0.002}, "memory": {"gpu_mb": 900}, "gpu": {"utilisation": 0.25}, "machine": "stand-in"}
TOOLS = ("awk bash cat chmod cp cut date dirname env git grep gzip head ls mkdir nice nproc rm sed setsid sleep tail "
         "tar tee timeout tr").split()


class GpuCheckTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = Path(scratch.name)
        (self.folder / "scripts").mkdir()
        (self.folder / "bin").mkdir()
        (self.folder / "scripts" / "gpu_check.sh").write_bytes(SCRIPT.read_bytes())
        for tool in TOOLS:
            self.link_tool(tool)
        self.add_tool("cmake", CMAKE)

    def link_tool(self, name):
        (self.folder / "bin" / name).symlink_to(shutil.which(name))

    def add_tool(self, name, script):
        path = self.folder / "bin" / name
        path.write_text(f"#!/usr/bin/env bash\n{script}\n", encoding="utf-8")
        path.chmod(0o755)

    def add_everything(self):
        """A GPU, all tools, and a bundle."""
        self.add_tool("nvidia-smi", GPU)
        self.add_tool("nvcc", "true")
        self.add_tool("compute-sanitizer", SANITIZER)
        self.link_tool("python3")
        self.link_tool("touch")
        self.add_tool("photoslam", PROGRAM)
        self.add_tool("splatting_test", 'echo "[       ${GPU_TEST:-OK} ] Gpu.OfThisMachineTrainsAsTheCpuDoes"')
        (self.folder / "build").mkdir()
        with tarfile.open(self.folder / "build" / "gpu_bundle.tar.gz", "w:gz") as bundle:
            for name in ("photoslam", "splatting_test"):
                bundle.add(self.folder / "bin" / name, f"program/{name}")

    def start(self, **variables):
        return subprocess.Popen(["bash", "scripts/gpu_check.sh"], cwd=self.folder, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT, text=True,
                                env={"PATH": str(self.folder / "bin"), "CUDA_HOME": str(self.folder),
                                     "REPORT": json.dumps(REPORT), **variables})

    def report_of(self, process):
        """Its exit status and what it has written."""
        output, _ = process.communicate()
        reports = list((self.folder / "output" / "gpu_check").glob("gpu-*.md"))
        self.assertEqual(len(reports), 1, output)
        return process.returncode, reports[0].read_text(encoding="utf-8")

    def check(self, **variables):
        return self.report_of(self.start(**variables))

    def test_everything_passes(self):
        self.add_everything()
        status, report = self.check()
        self.assertEqual(status, 0, report)
        steps = [line.split("|")[1].strip() for line in report.splitlines() if "| passed |" in line]
        self.assertEqual(steps, [
            "build", "tests on the GPU", "memcheck", "bench of the engine", "doctor", "steps equal those of the CPU",
            "run, 300 frames", "export", "bench on cuda", "render on cuda", "bench on cpu", "render on cpu",
            "images equal those of the CPU", "racecheck", "initcheck", "synccheck", "run, 2000 frames"])
        self.assertIn("GPU memory 900 MB, GPU busy 25 %", report)
        self.assertIn("17 passed, 0 failed, 0 not checked", report)

    def test_other_images_and_a_program_without_the_gpu_are_failures(self):
        self.add_everything()
        status, report = self.check(GPU_VALUE="100", GPU_TEST="SKIPPED", FRAMES="300")
        self.assertEqual(status, 1)
        self.assertIn("FAILED: steps equal those of the CPU; images equal those of the CPU.", report)

    def test_a_gpu_that_fails_on_the_way_is_a_failure(self):
        self.add_everything()
        status, report = self.check(NOTE="  note: the GPU has failed (unspecified launch failure)", FRAMES="300")
        self.assertEqual(status, 1)
        self.assertIn("| run, 300 frames | FAILED (the GPU has failed) |", report)

    def test_without_python_images_are_not_compared(self):
        self.add_everything()
        (self.folder / "bin" / "python3").unlink()
        status, report = self.check(FRAMES="300")
        self.assertEqual(status, 3)
        self.assertIn("| images equal those of the CPU | not checked (there is no python3) |", report)

    def test_a_tool_that_is_missing_is_not_checked(self):
        self.add_tool("nvidia-smi", GPU)
        self.add_tool("nvcc", "true")
        status, report = self.check()
        self.assertEqual(status, 3)
        for tool in ("memcheck", "racecheck", "initcheck", "synccheck"):
            self.assertIn(f"| {tool} | not checked (there is no compute-sanitizer) |", report)
        self.assertIn("3 passed, 0 failed, 5 not checked", report)
        self.assertIn("Not checked: memcheck; program; racecheck; initcheck; synccheck.", report)

    def test_what_the_sanitizer_finds_is_a_failure(self):
        self.add_tool("nvidia-smi", GPU)
        self.add_tool("nvcc", "true")
        self.add_tool("compute-sanitizer", SANITIZER)
        status, report = self.check(BAD_TOOL="racecheck")
        self.assertEqual(status, 1)
        self.assertIn("| memcheck | passed |", report)
        self.assertIn("| racecheck | FAILED (1) |", report)
        self.assertIn("FAILED: racecheck.", report)

    def test_without_nvcc_nothing_passes_on_the_gpu(self):
        self.add_tool("nvidia-smi", GPU)
        self.add_tool("compute-sanitizer", SANITIZER)
        status, report = self.check()
        self.assertEqual(status, 3)
        self.assertIn("| tests on the GPU | not checked (they were not built: is there an nvcc?) |", report)
        self.assertIn("| memcheck | not checked (the tests were not built) |", report)

    def test_a_failed_build_does_not_end_the_report(self):
        self.add_tool("nvidia-smi", GPU)
        status, report = self.check(BUILD="1")
        self.assertEqual(status, 1)
        self.assertIn("| build | FAILED (1) |", report)
        self.assertIn("FAILED: build.", report)

    def test_time_runs_out(self):
        self.add_tool("nvidia-smi", GPU)
        self.add_tool("nvcc", "true")
        status, report = self.check(TESTS_HANG="1", SECONDS_ALLOWED="5")
        self.assertEqual(status, 1)
        self.assertRegex(report, r"\| tests on the GPU \| FAILED \(stopped after [345] s\) \|")
        self.assertIn("| bench of the engine | not checked (no time left) |", report)

    def test_whoever_stops_it_gets_the_report_so_far(self):
        self.add_tool("nvidia-smi", GPU)
        self.add_tool("nvcc", "true")
        process = self.start(TESTS_HANG="1")
        next(line for line in process.stdout if "| build | passed" in line)
        process.terminate()
        status, report = self.report_of(process)
        self.assertEqual(status, 1)
        self.assertIn("The run was stopped before its end.", report)
        self.assertIn("1 passed, 0 failed, 0 not checked", report)

    def test_without_a_gpu_it_says_so(self):
        self.add_tool("nvidia-smi", 'echo "NVIDIA-SMI has failed"; exit 9')
        status, report = self.check()
        self.assertEqual(status, 2)
        self.assertIn("| tests on the host | passed |", report)
        self.assertIn("No GPU was found: nothing above says anything about one.", report)

    def test_failing_host_tests_are_reported(self):
        status, report = self.check(HOST_TESTS="1")
        self.assertEqual(status, 2)
        self.assertIn("| tests on the host | FAILED (1) |", report)


if __name__ == "__main__":
    unittest.main()
