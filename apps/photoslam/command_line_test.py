#!/usr/bin/env python3
# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
"""The command line from outside: bad input gives one clear error and the right exit code, and leaves nothing half done.

PHOTOSLAM_BINARY is the program, PHOTOSLAM_SEQUENCE a short RGB-D sequence in the TUM layout,
PHOTOSLAM_SOURCE_DIR the root of the source tree.
"""

import csv
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

BINARY = os.environ["PHOTOSLAM_BINARY"]
SEQUENCE = Path(os.environ.get("PHOTOSLAM_SEQUENCE", "no sequence"))
SOURCE_DIR = Path(os.environ.get("PHOTOSLAM_SOURCE_DIR", Path(__file__).resolve().parents[2]))
COMMANDS = ["run", "eval", "render", "export", "train", "synth", "doctor", "config", "merge"]
FAST = ["--pace", "asap", "--set", "pipeline.iterations_per_frame=1"]


def photoslam(*arguments, timeout=300, cwd=None):
    return subprocess.run(
        [BINARY, *map(str, arguments)], capture_output=True, text=True, timeout=timeout, check=False, cwd=cwd
    )


def sha256(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


class CommandLineTest(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="photoslam_cli_"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.output = self.folder / "out"

    def assert_fails(self, result, code, *fragments):
        """One error line, nothing else that looks like one, and the expected words in it."""
        self.assertEqual(result.returncode, code, result.stderr)
        errors = [line for line in result.stderr.splitlines() if line.startswith("photoslam: error: ")]
        self.assertEqual(len(errors), 1, result.stderr)
        self.assertNotIn("terminate called", result.stderr)
        for fragment in fragments:
            self.assertIn(str(fragment), errors[0])

    def assert_nothing_written(self):
        written = [path for path in self.output.rglob("*") if path.is_file()] if self.output.is_dir() else []
        self.assertEqual(written, [])

    def copy_of_sequence(self):
        copy = self.folder / "sequence"
        shutil.copytree(SEQUENCE, copy)
        return copy

    def drifting_sequence(self):
        """A short walk under an exposure that changes."""
        sequence = self.folder / "drifting"
        result = photoslam("synth", "room", "--frames", "16", "--shrink", "4", "--exposure-drift", "1",
                           "--exposure-jumps", "0.5", "--fps", "6", "--output", sequence)
        self.assertEqual(result.returncode, 0, result.stderr)
        return sequence

    def run_deterministic(self, name, *options, sequence=SEQUENCE):
        output = self.folder / name
        result = photoslam("run", sequence, "--output", output, "--deterministic", *options)
        self.assertEqual(result.returncode, 0, result.stderr)
        return output


class UsageTest(CommandLineTest):
    def test_every_command_has_help_with_examples(self):
        for command in COMMANDS:
            with self.subTest(command=command):
                result = photoslam(command, "--help")
                self.assertEqual(result.returncode, 0)
                self.assertIn("Examples:\n  photoslam " + command, result.stdout)
                self.assertIn(f"  {command} ", photoslam("--help").stdout)

    def test_version_names_the_build(self):
        result = photoslam("--version")
        self.assertEqual(result.returncode, 0)
        self.assertRegex(result.stdout, r"^photoslam \d+\.\d+\.\d+ \(.+\)\n$")

    def test_no_command(self):
        self.assert_fails(photoslam(), 2, "no command", "--help")

    def test_unknown_command(self):
        self.assert_fails(photoslam("rnu"), 2, "unknown command 'rnu'; did you mean 'run'?")

    def test_unknown_option(self):
        self.assert_fails(photoslam("run", "somewhere", "--outptu", "x"), 2, "'--outptu'; did you mean '--output'?")
        self.assert_fails(photoslam("doctor", "--hlp"), 2, "'--hlp'; did you mean '--help'?")
        self.assert_fails(photoslam("--versoin"), 2, "'--versoin'; did you mean '--version'?")

    def test_senseless_option_values(self):
        for option in (["--threads", "many"], ["--pace", "slow"], ["--refine-seconds", "-1"], ["--hold-out", "x"]):
            with self.subTest(option=option):
                result = photoslam("run", SEQUENCE, "--output", self.output, *option)
                self.assert_fails(result, 2, option[0])
                self.assert_nothing_written()

    def test_options_that_contradict_each_other(self):
        run = ("run", SEQUENCE, "--output", self.output)
        for words, options in {
            "--hold-out: 1": ("--hold-out", "1"),
            "--refine-iterations": ("--deterministic", "--refine-seconds", "1"),
            "nothing to refine": ("--load-map", self.folder, "--localize-only", "--refine-seconds", "1"),
            "--camera excludes --fov": ("--camera", "a.yaml", "--fov", "60"),
            "--pace realtime: --deterministic": ("--deterministic", "--pace", "realtime"),
        }.items():
            with self.subTest(words=words):
                self.assert_fails(photoslam(*run, *options), 2, words)
                self.assert_nothing_written()
        self.assert_fails(photoslam("train", self.folder, "--hold-out", "1"), 2, "--hold-out: 1")
        self.assert_fails(photoslam("train", self.folder), 1, self.folder)

    def test_synth_of_another_size(self):
        result = photoslam("synth", "room", "--frames", "1", "--size", "96x54", "--format", "replica", "--output",
                           self.output)
        self.assertEqual(result.returncode, 0, result.stderr)
        camera = json.loads((self.output / "cam_params.json").read_text(encoding="utf-8"))["camera"]
        self.assertEqual((camera["w"], camera["h"]), (96, 54))
        self.assertAlmostEqual(camera["fx"] / 96, 525.4 / 640, places=6)
        for size in ("96", "96x", "x54", "9x9", "96x54x3"):
            self.assert_fails(photoslam("synth", "room", "--size", size, "--output", self.folder / "o"), 2, "--size")

    def test_doctor_finds_the_machine(self):
        result = photoslam("doctor")
        self.assertEqual(result.returncode, 0)
        for word in ("cores usable", "SIMD", "Eigen", "cuda", "LPIPS", "write"):
            self.assertIn(word, result.stdout)
        rows = dict(re.findall(r"^(\w+) +(.*)$", result.stdout, re.MULTILINE))
        for word in ("mono", "stereo", "RGB-D", "tum", "euroc", "kitti", "replica", "images", "video"):
            self.assertIn(word, rows["input"])
        # What it says of videos is what happens to one.
        video = self.folder / "video.mp4"
        video.write_bytes(b"not really")
        attempt = photoslam("run", video, "--fov", "60", "--output", self.output)
        self.assertEqual(rows["video"] == "ready", "photoslam_video.so" not in attempt.stderr, rows["video"])
        devices = [str(path) for path in Path("/dev").glob("video*")]
        for device in devices:
            self.assertIn(device, rows["cameras"])
        if not devices:
            self.assertEqual(rows["cameras"], "none found (/dev/video*)")


class BackendTest(CommandLineTest):
    def test_backends(self):
        has_gpu = "compute capability" in photoslam("doctor").stdout
        self.assert_fails(photoslam("render", "map.ply", "--orbit", "--backend", "metal"), 2, "--backend")
        run = ["run", SEQUENCE, "--output", self.output, *FAST]
        result = photoslam(*run, "--backend", "cuda")
        if not has_gpu:
            self.assert_fails(result, 1, "--backend cuda: no GPU")
        result = photoslam(*run)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("splatting on the GPU" if has_gpu else "splatting on the CPU (no GPU", result.stderr)
        report = json.loads((self.output / "report.json").read_text(encoding="utf-8"))
        self.assertEqual(report["memory"]["gpu_mb"] is not None, has_gpu)
        self.assertEqual(report["gpu"]["utilisation"] is not None, has_gpu)


class ConfigTest(CommandLineTest):
    def test_printed_configuration_loads_back(self):
        file = self.folder / "config.toml"
        file.write_text(photoslam("config").stdout, encoding="utf-8")
        result = photoslam("config", "--config", file)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(result.stdout, photoslam("config", "--defaults").stdout)

    def test_settings_override_the_file(self):
        file = self.folder / "config.toml"
        file.write_text("[pipeline]\ninput_queue = 7\n", encoding="utf-8")
        self.assertIn("\ninput_queue = 7\n", photoslam("config", "--config", file).stdout)
        overridden = photoslam("config", "--config", file, "--set", "pipeline.input_queue=8").stdout
        self.assertIn("\ninput_queue = 8\n", overridden)
        self.assertIn("Changed from the default: pipeline.input_queue", overridden)

    def test_unknown_key_in_a_file(self):
        file = self.folder / "config.toml"
        file.write_text("[pipeline]\ninput_queu = 7\n", encoding="utf-8")
        for command in (["config"], ["run", SEQUENCE, "--output", self.output]):
            result = photoslam(*command, "--config", file)
            self.assert_fails(result, 1, f"{file}:2:1: ", "did you mean 'pipeline.input_queue'?")
        self.assert_nothing_written()

    def test_a_setting_takes_one_word(self):
        result = photoslam("run", "--set", "pipeline.input_queue=7", self.folder / "nowhere", "--output", self.output)
        self.assert_fails(result, 1, self.folder / "nowhere")

    def test_unknown_key_in_a_setting(self):
        result = photoslam("run", SEQUENCE, "--output", self.output, "--set", "pipeline.input_queu=7")
        self.assert_fails(result, 2, "--set", "did you mean 'pipeline.input_queue'?")
        self.assert_nothing_written()

    def test_missing_file(self):
        self.assert_fails(photoslam("config", "--config", self.folder / "none.toml"), 1, "none.toml")

    def test_manual_is_current(self):
        manual = photoslam("config", "--manual").stdout
        kept = (SOURCE_DIR / "docs" / "configuration.md").read_text(encoding="utf-8")
        self.assertEqual(manual, kept, "run: make docs")


class BadInputTest(CommandLineTest):
    def test_missing_dataset(self):
        result = photoslam("run", self.folder / "nowhere", "--output", self.output)
        self.assert_fails(result, 1, self.folder / "nowhere")
        self.assert_nothing_written()

    def test_empty_folder(self):
        empty = self.folder / "empty"
        empty.mkdir()
        result = photoslam("run", empty, "--output", self.output)
        self.assert_fails(result, 1, empty)
        self.assert_nothing_written()

    def test_format_that_does_not_fit(self):
        self.assert_fails(photoslam("run", SEQUENCE, "--format", "video", "--output", self.output), 1, "is a folder")
        self.assert_fails(photoslam("run", "camera:0", "--format", "video", "--fov", "60"), 1, "is a live camera")
        video = self.folder / "video.mp4"
        video.write_bytes(b"not really")
        self.assert_fails(photoslam("run", video, "--format", "video", "--output", self.output), 1, "video")
        self.assert_fails(photoslam("run", video, "--format", "tum", "--output", self.output), 1, "is a file")

    def test_folder_of_text_files(self):
        notes = self.folder / "notes"
        notes.mkdir()
        for name in ("readme.txt", "list.txt", "rgb.md"):
            (notes / name).write_text("some words\n", encoding="utf-8")
        result = photoslam("run", notes, "--output", self.output)
        self.assert_fails(result, 1, notes)
        self.assert_nothing_written()

    def test_files_that_are_no_video(self):
        words = self.folder / "words.txt"
        words.write_text("some words\n" * 100, encoding="utf-8")
        self.assert_fails(photoslam("run", words, "--fov", "60", "--output", self.output), 1, words)
        poses = self.folder / "transforms.json"
        poses.write_text("{}", encoding="utf-8")
        self.assert_fails(photoslam("run", poses, "--output", self.output), 1, f"photoslam train {poses}")
        self.assert_nothing_written()

    def test_depth_in_another_unit(self):
        sequence = self.copy_of_sequence()
        camera = sequence / "camera.yaml"
        in_metres = re.sub("depth_scale: .*", "depth_scale: 1", camera.read_text(encoding="utf-8"))
        camera.write_text(in_metres, encoding="utf-8")
        self.assert_fails(photoslam("run", sequence, "--output", self.output, *FAST), 1, "depth.max_m", "depth_scale")

    def test_unparsable_list(self):
        sequence = self.copy_of_sequence()
        (sequence / "associations.txt").unlink()
        (sequence / "rgb.txt").write_text("# images\n0.0 rgb/a.png\nnonsense\n", encoding="utf-8")
        result = photoslam("run", sequence, "--output", self.output)
        self.assert_fails(result, 1, "rgb.txt:3")
        self.assert_nothing_written()

    def test_output_that_cannot_be_written(self):
        # Permission bits do not bind root; a folder below a regular file cannot exist for anyone.
        file = self.folder / "file"
        file.write_text("not a folder\n", encoding="utf-8")
        for command in (["run", SEQUENCE], ["synth", "room", "--frames", "2"]):
            with self.subTest(command=command[0]):
                self.assert_fails(photoslam(*command, "--output", file / "out"), 1, file)
        self.assertEqual(file.read_text(encoding="utf-8"), "not a folder\n")

    @unittest.skipIf(os.geteuid() == 0, "root may write everywhere")
    def test_read_only_output_folder(self):
        self.output.mkdir(mode=0o555)
        self.assert_fails(photoslam("run", SEQUENCE, "--output", self.output), 1, self.output)

    def test_eval_of_something_else(self):
        self.assert_fails(photoslam("eval", self.folder), 1, self.folder)
        self.assert_fails(photoslam("eval", self.folder / "nowhere"), 1, "nowhere")

    def test_render_of_something_else(self):
        broken = self.folder / "map.ply"
        broken.write_bytes(b"ply\nformat ascii 1.0\nend_header\n")
        result = photoslam("render", broken, "--orbit", "--output", self.output)
        self.assert_fails(result, 1, broken)
        self.assert_nothing_written()

    def test_unknown_scene(self):
        result = photoslam("synth", "castle", "--output", self.output)
        self.assertNotEqual(result.returncode, 0)
        self.assertIn("castle", result.stderr)
        self.assert_nothing_written()


class DamagedSequenceTest(CommandLineTest):
    """Bad frames are counted and skipped; the rest of the run is not disturbed."""

    def run_damaged(self, sequence, damaged):
        result = photoslam("run", sequence, "--output", self.output, *FAST)
        self.assertEqual(result.returncode, 0, result.stderr)
        report = json.loads((self.output / "report.json").read_text(encoding="utf-8"))
        frames = report["frames"]
        self.assertEqual(frames["total"], frames["tracked"] + frames["lost"] + frames["dropped"])
        self.assertEqual(frames["lost"], damaged)
        return (self.output / "frames.csv").read_text(encoding="utf-8")

    def test_half_written_image(self):
        sequence = self.copy_of_sequence()
        image = sorted((sequence / "rgb").iterdir())[4]
        image.write_bytes(image.read_bytes()[: image.stat().st_size // 2])
        self.assertIn(image.name, self.run_damaged(sequence, 1))

    def test_empty_depth_file(self):
        sequence = self.copy_of_sequence()
        image = sorted((sequence / "depth").iterdir())[5]
        image.write_bytes(b"")
        self.assertIn(image.name, self.run_damaged(sequence, 1))

    def test_all_images_damaged(self):
        sequence = self.copy_of_sequence()
        for image in (sequence / "rgb").iterdir():
            image.write_bytes(b"")
        result = photoslam("run", sequence, "--output", self.output, *FAST)
        self.assert_fails(result, 1)
        self.assertFalse((self.output / "map.ply").exists())


class RunTest(CommandLineTest):
    def test_report_keeps_its_contract(self):
        output = self.run_deterministic("run")
        report = json.loads((output / "report.json").read_text(encoding="utf-8"))
        image = ["psnr_db", "psnr_p5_db", "ssim", "lpips", "frames"]
        ate = ["rmse_m", "std_m", "median_m", "rot_rmse_deg", "scale", "matched"]
        contract = {
            "frames": ["total", "tracked", "lost", "lost_before_init", "dropped"],
            "tracking": ["fps", "p50_ms", "p99_ms", "mean_ms", "min_ms", "max_ms", "std_ms", "blocked_p99_ms",
                         "active_feature_ratio"],
            "latency": ["p50_ms", "p99_ms", "max_ms"],
            "mapping": ["iterations", "ms_per_iteration", "gaussians", "keyframes",
                        "keyframes_without_pictures", "cpu_seconds", "seconds_online",
                        "seconds_drain", "seconds_refine"],
            "ate": ate, "ate_online": ate, "rpe": ["trans_m", "rot_deg"],
            "image_online": image, "image": image, "image_keyframes": image, "image_held_out": image,
            "render": ["fps"], "memory": ["peak_rss_mb", "gpu_mb"],
            "gpu": ["utilisation"], "map": ["size_mb"], "loops": ["closed", "reconnected"], "config": ["all", "changed"],
        }
        for group, keys in contract.items():
            for key in keys:
                self.assertIn(key, report[group], group)
        for key in ("seconds_total", "machine", "version"):
            self.assertIn(key, report)
        self.assertEqual(len(report["config"]["changed"]), 0)
        self.assertIsNone(report["image"]["lpips"])
        self.assertIsNone(report["latency"]["p50_ms"])  # no due times without real-time pace
        for name in ("trajectory.tum", "trajectory_online.tum", "keyframes.tum", "frames.csv", "exposures.txt", "map.ply",
                     "report.html"):
            self.assertTrue((output / name).is_file(), name)
        self.assertEqual([path.name for path in output.iterdir() if "tmp" in path.name], [])

    def test_deterministic_at_any_thread_count_and_without_truth(self):
        blind = self.copy_of_sequence()
        (blind / "groundtruth.txt").unlink()
        first = self.run_deterministic("one", "--threads", "1")
        second = self.run_deterministic("two", "--threads", "2", sequence=blind)
        for name in ("trajectory.tum", "keyframes.tum", "map.ply"):
            self.assertEqual(sha256(first / name), sha256(second / name), name)
        report = json.loads((second / "report.json").read_text(encoding="utf-8"))
        self.assertIsNone(report["ate"]["rmse_m"])

    def test_eval_repeats_the_figures_of_the_run(self):
        output = self.run_deterministic("run")
        before = json.loads((output / "report.json").read_text(encoding="utf-8"))
        result = photoslam("eval", output, "--truth", SEQUENCE)
        self.assertEqual(result.returncode, 0, result.stderr)
        after = json.loads((output / "report.json").read_text(encoding="utf-8"))
        self.assertAlmostEqual(before["ate"]["rmse_m"], after["ate"]["rmse_m"], places=9)

    def test_eval_scores_with_the_exposures_of_the_run(self):
        output = self.run_deterministic("run", "--iterations-per-frame", "4", sequence=self.drifting_sequence())
        report = json.loads((output / "report.json").read_text(encoding="utf-8"))["image"]
        exposures = output / "exposures.txt"
        gains = [line.split()[1:4] for line in exposures.read_text(encoding="utf-8").splitlines() if line[0] != "#"]
        self.assertGreater(max(abs(float(gain) - 1) for line in gains for gain in line), 0.05)

        def psnr():
            result = photoslam("eval", output, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            return json.loads(result.stdout)["image"]["psnr_db"]

        self.assertAlmostEqual(psnr(), report["psnr_db"], places=2)
        exposures.rename(self.folder / "moved")  # as a run of an older version
        self.assertLess(psnr(), report["psnr_db"] - 0.2)
        exposures.write_text("# photoslam exposures 2\n", encoding="utf-8")
        self.assert_fails(photoslam("eval", output), 1, f"{exposures}:1")
        self.assert_fails(photoslam("train", "--poses", output, "--iterations", "1"), 1, f"{exposures}:1")

    def test_eval_at_the_true_poses(self):
        output = self.run_deterministic("run")
        report = json.loads((output / "report.json").read_text(encoding="utf-8"))
        result = photoslam("eval", output, "--poses", "truth", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        # Tracking of so short a walk is nearly exact: other poses change little, but something.
        difference = json.loads(result.stdout)["image"]["psnr_db"] - report["image"]["psnr_db"]
        self.assertNotEqual(difference, 0)
        self.assertLess(abs(difference), 1)
        description = json.loads((output / "run.json").read_text(encoding="utf-8"))
        blind = self.copy_of_sequence()
        (blind / "groundtruth.txt").unlink()
        description["dataset"] = str(blind)
        (output / "run.json").write_text(json.dumps(description), encoding="utf-8")
        self.assert_fails(photoslam("eval", output, "--poses", "truth"), 1, "--truth")

    def test_poses_of_a_squinting_rig_are_those_of_the_rectified_camera(self):
        rig = self.folder / "rig"
        self.assertEqual(photoslam("synth", "room", "--sensor", "stereo", "--lens", "radial", "--frames", "30", "--fps", "6", "--shrink",
                                   "2", "--noise", "0", "--output", rig).returncode, 0)
        output = self.run_deterministic("run", "--iterations-per-frame", "8", sequence=rig)
        report = json.loads((output / "report.json").read_text(encoding="utf-8"))
        # The axes as mounted are 1.9 off; 30 small pictures alone leave 0.3.
        self.assertLess(report["ate"]["rot_rmse_deg"], 1.9 / 3)
        result = photoslam("eval", output, "--poses", "truth", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertAlmostEqual(json.loads(result.stdout)["ate"]["rot_rmse_deg"], report["ate"]["rot_rmse_deg"], places=5)
        self.assertAlmostEqual(json.loads(result.stdout)["image"]["psnr_db"], report["image"]["psnr_db"], delta=0.5)

    def test_a_sequence_that_has_moved(self):
        sequence = self.copy_of_sequence()
        output = self.run_deterministic("run", sequence=sequence)
        sequence.rename(self.folder / "moved")
        self.assert_fails(photoslam("eval", output), 1, sequence, output / "run.json")
        description = (output / "run.json").read_text(encoding="utf-8").replace(str(sequence), str(self.folder / "moved"))
        (output / "run.json").write_text(description, encoding="utf-8")
        self.assertEqual(photoslam("eval", output).returncode, 0)

    def test_a_run_replaces_an_earlier_one_whole(self):
        first = self.run_deterministic("run")
        self.assertTrue((first / "session.photoslam").is_file())
        result = photoslam("run", SEQUENCE, "--output", first, "--no-session", *FAST)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("will be replaced", result.stderr)
        self.assertFalse((first / "session.photoslam").exists(), "it is not of this run")

    def test_frames_lost_on_the_way_are_explained(self):
        sequence = self.copy_of_sequence()
        image = sorted((sequence / "rgb").iterdir())[4]
        image.write_bytes(b"")
        result = photoslam("run", sequence, "--output", self.output, "--deterministic")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, rf"note: frame 4 is lost: .*{image.name}")
        log = (self.output / "frames.csv").read_text(encoding="utf-8")
        self.assertRegex(log, rf"\n4,[^,]*,lost,[^\n]*{image.name}")

    def test_a_run_on_a_live_camera_is_not_read_again(self):
        output = self.run_deterministic("run")
        description = json.loads((output / "run.json").read_text(encoding="utf-8"))
        for device in ("camera:0", "/dev/video0"):
            description["dataset"] = device
            (output / "run.json").write_text(json.dumps(description), encoding="utf-8")
            for command in (["eval", output], ["export", output, "--to", "colmap", "--output", self.output],
                            ["export", output, "--to", "transforms", "--output", self.output],
                            ["train", "--poses", output, "--output", self.output]):
                self.assert_fails(photoslam(*command), 1, f"live camera {device}", "record a video")

    def test_relative_paths_mean_the_same_from_any_folder(self):
        sequence = self.copy_of_sequence()
        shutil.move(sequence / "camera.yaml", self.folder / "mine.yaml")
        result = photoslam("run", sequence.name, "--camera", "mine.yaml", "--output", "out", "--deterministic",
                           cwd=self.folder)
        self.assertEqual(result.returncode, 0, result.stderr)
        result = photoslam("eval", self.output, cwd="/")
        self.assertEqual(result.returncode, 0, result.stderr)

    def train(self, *arguments):
        """Gaussians of the map that `train` writes, and the PSNR of the views it was trained on."""
        trained = self.folder / "trained"
        result = photoslam("train", *arguments, "--output", trained)
        self.assertEqual(result.returncode, 0, result.stderr)
        header = (trained / "map.ply").read_bytes()[:400].decode("ascii", "replace")
        count = int(re.search(r"element vertex (\d+)", header)[1])
        return count, float(re.search(r"trained views\s+PSNR ([\d.]+)", result.stdout)[1])

    def test_training_from_random_gaussians_adds_to_them_by_splitting_and_cloning(self):
        run = self.run_deterministic("run", "--iterations-per-frame", "1")
        begin, blind = self.train("--poses", run, "--init", "random:500", "--iterations", "1")
        self.assertGreater(begin, 400)
        self.assertLessEqual(begin, 500, "no other seeds")
        grown, trained = self.train("--poses", run, "--init", "random:500", "--iterations", "400")
        self.assertGreater(grown, begin)
        self.assertGreater(trained, blind + 6)

    def test_a_number_of_random_gaussians_is_a_whole_number(self):
        run = self.run_deterministic("run", "--iterations-per-frame", "1")
        for count in ("10k", "1e4", "", "0", "-3", "99999999999", "10 "):
            result = photoslam("train", "--poses", run, "--init", f"random:{count}", "--output", self.output)
            self.assert_fails(result, 2, f"--init: random:{count}: expected random:COUNT")
            self.assert_nothing_written()

    def test_training_from_the_layouts_of_others(self):
        run = self.run_deterministic("run", "--iterations-per-frame", "1")
        for layout in ("transforms", "colmap"):
            exported = self.folder / layout
            self.assertEqual(photoslam("export", run, "--to", layout, "--output", exported).returncode, 0)
            _, begin = self.train(exported, "--iterations", "1")
            _, trained = self.train(exported, "--iterations", "150")
            self.assertGreater(trained, begin + 2, layout)
        views = photoslam("render", self.folder / "trained", "--orbit", "--orbit-frames", "2", "--output", self.output)
        self.assertEqual(views.returncode, 0, views.stderr)
        self.assertEqual(len(list(self.output.glob("*.png"))), 2)
        poses = (self.folder / "trained" / "keyframes.tum").read_text(encoding="utf-8").splitlines()
        images = json.loads((self.folder / "transforms" / "transforms.json").read_text(encoding="utf-8"))["frames"]
        self.assertEqual(len([line for line in poses if not line.startswith("#")]), len(images))
        # The same pictures of a lens that bends: they are resampled, and less of them counts.
        transforms = self.folder / "transforms" / "transforms.json"
        cameras = json.loads(transforms.read_text(encoding="utf-8"))
        cameras.update(camera_model="OPENCV", k1=0.3, k2=-0.9, p1=0, p2=0)
        transforms.write_text(json.dumps(cameras), encoding="utf-8")
        result = photoslam("train", self.folder / "transforms", "--iterations", "1", "--output", self.folder / "bent")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn(f"{len(cameras['frames'])} resampled", result.stderr)

    def test_training_from_the_map_of_the_run_improves_it(self):
        run = self.run_deterministic("run", "--iterations-per-frame", "2")
        begin, before = self.train("--poses", run, "--init", run / "map.ply", "--iterations", "1")
        _, after = self.train("--poses", run, "--init", run / "map.ply", "--iterations", "250")
        self.assertGreater(begin, 1000)
        self.assertGreater(after, before)

    def test_held_out_frames_are_scored_and_never_mapped(self):
        eager = ["localization.keyframes.min_interval_s=0", "localization.keyframes.max_translation=0.01",
                 "pipeline.keyframe_lag_frames=1"]
        settings = [word for setting in eager for word in ("--set", setting)]
        keyframes = {}
        for name, options in (("free", []), ("held", ["--hold-out", "2"])):
            output = self.run_deterministic(name, *settings, *options)
            with (output / "frames.csv").open(encoding="utf-8") as file:
                rows = list(csv.DictReader(file))
            keyframes[name] = [i for i, row in enumerate(rows) if row["keyframe"] != ""]
        self.assertTrue(any(i % 2 == 1 for i in keyframes["free"]), keyframes)
        self.assertFalse(any(i % 2 == 1 for i in keyframes["held"]), keyframes)
        report = json.loads((output / "report.json").read_text(encoding="utf-8"))
        self.assertEqual(report["image_held_out"]["frames"], len(rows) // 2)
        self.assertGreater(report["image_held_out"]["psnr_db"], 15)

    def test_preview_is_a_whole_picture(self):
        preview = self.folder / "preview.png"
        self.run_deterministic("run", "--preview", preview)
        data = preview.read_bytes()
        self.assertTrue(data.startswith(b"\x89PNG"))
        self.assertTrue(data.endswith(b"IEND\xaeB`\x82"))
        self.assertEqual([path.name for path in self.folder.iterdir() if "tmp" in path.name], [])

    def test_eval_counts_only_what_the_beginning_saw(self):
        output = self.run_deterministic("run")
        table = self.folder / "scores.csv"
        result = photoslam("eval", output, "--seen-until", "0.2", "--table", table)
        self.assertEqual(result.returncode, 0, result.stderr)
        with table.open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        start = float(rows[0]["timestamp"])
        shares = {float(row["timestamp"]) - start: float(row["share"]) for row in rows}
        self.assertTrue(all(share == 1 for time, share in shares.items() if time <= 0.2))
        later = [share for time, share in shares.items() if time > 0.2]
        self.assertTrue(all(0 < share < 1 for share in later), later)
        self.assertGreater(later[0], later[-1], "the camera moves on")
        self.assert_fails(photoslam("eval", output, "--seen-until", "-1"), 2, "--seen-until")

    def test_exports_for_other_programs(self):
        run = self.run_deterministic("run")
        for kind in ("ply", "spz", "splat"):
            target = self.folder / f"map.{kind}"
            result = photoslam("export", run, "--to", kind, "--output", target)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertGreater(target.stat().st_size, 1000)
        self.assertEqual((self.folder / "map.ply").read_bytes(), (run / "map.ply").read_bytes())
        self.assertEqual(photoslam("export", run, "--to", "transforms", "--output", self.folder / "nerf").returncode, 0)
        frames = json.loads((self.folder / "nerf" / "transforms.json").read_text(encoding="utf-8"))["frames"]
        self.assertGreater(len(frames), 0)
        for frame in frames:
            self.assertTrue((self.folder / "nerf" / frame["file_path"]).is_file())
        self.assertEqual(photoslam("export", run, "--to", "colmap", "--output", self.folder / "colmap").returncode, 0)
        self.assertTrue((self.folder / "colmap" / "sparse" / "0" / "points3D.txt").is_file())
        self.assert_fails(photoslam("export", run / "map.ply", "--to", "colmap", "--output", self.output), 1, "run")

    def test_interrupted_run_saves_what_it_has(self):
        command = [BINARY, "run", str(SEQUENCE), "--output", str(self.output), "--refine-seconds", "120"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(4.0)
        process.send_signal(signal.SIGINT)
        process.wait(timeout=60)
        self.assertGreaterEqual(process.returncode, 0, "ended by the signal instead of saving")
        self.assertTrue((self.output / "trajectory.tum").is_file())
        self.assertTrue((self.output / "map.ply").is_file())

    def test_interrupted_training_saves_what_it_has(self):
        run = self.run_deterministic("run")
        command = [BINARY, "train", "--poses", str(run), "--output", str(self.output), "--seconds", "600", "--threads",
                   "2"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(3.0)
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(timeout=60), 0)
        self.assertTrue((self.output / "map.ply").is_file())

    def test_killed_run_leaves_no_partial_file(self):
        command = [BINARY, "run", str(SEQUENCE), "--output", str(self.output), "--refine-seconds", "120"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(2.0)
        process.kill()
        process.wait()
        for name in ("map.ply", "trajectory.tum", "report.json"):
            self.assertFalse((self.output / name).exists(), name)



class SessionTest(CommandLineTest):
    """A session that is saved, loaded, continued, damaged and killed, through the program alone."""

    def run_session(self, *options):
        return self.run_deterministic("first", "--set", "pipeline.iterations_per_frame=1", *options)

    def test_localize_only_finds_the_place_and_leaves_the_session(self):
        first = self.run_session()
        before = sha256(first / "session.photoslam")
        second = self.run_deterministic("second", "--load-map", first, "--localize-only")
        self.assertEqual(sha256(first / "session.photoslam"), before)
        loaded = ("--load-map", first, "--localize-only", "--deterministic", "--output", self.folder / "third")
        notes = photoslam("run", SEQUENCE, *loaded, "--set", "localization.min_inliers=21").stderr
        self.assertIn("localization.min_inliers = 21 applies, the session had 20", notes)
        self.assertNotIn("densification", notes)
        self.assertFalse((second / "session.photoslam").exists())
        frames = json.loads((second / "report.json").read_text(encoding="utf-8"))["frames"]
        self.assertEqual(frames["tracked"], frames["total"])
        self.assertEqual((second / "map.ply").read_bytes(), (first / "map.ply").read_bytes())

    def test_loaded_and_saved_again_has_the_same_bytes(self):
        first = self.run_session()
        second = self.run_deterministic("second", "--load-map", first / "session.photoslam", "--map-until", "0",
                                        "--set", "pipeline.iterations_per_frame=0")
        self.assertGreater((second / "session.photoslam").stat().st_size, 10000)
        third = self.run_deterministic("third", "--load-map", second, "--map-until", "0", "--set",
                                       "pipeline.iterations_per_frame=0")
        self.assertEqual(sha256(second / "session.photoslam"), sha256(third / "session.photoslam"))

    def test_a_loaded_map_grows(self):
        first = self.run_session()
        second = self.run_deterministic("second", "--load-map", first)
        size = [len((run / "map.ply").read_bytes()) for run in (first, second)]
        self.assertGreaterEqual(size[1], size[0])
        self.assertTrue((second / "session.photoslam").is_file())

    def test_another_sensor_does_not_continue_a_session(self):
        first = self.run_session()
        before = {path.name: sha256(path) for path in first.iterdir() if path.is_file()}
        for words, other in {
            "this sensor measures none": ("--sensor", "mono"),
            "depth.virtual_baseline_m": ("--set", "depth.virtual_baseline_m=0.123"),
        }.items():
            with self.subTest(words=words):
                self.assert_fails(photoslam("run", SEQUENCE, "--load-map", first, "--output", first, *other), 1, words)
                self.assertEqual({path.name: sha256(path) for path in first.iterdir() if path.is_file()}, before)

    def test_two_sessions_are_merged(self):
        first = self.run_session()
        second = self.run_deterministic("second", "--set", "pipeline.iterations_per_frame=1", "--seed", "2")
        both, views = self.folder / "both", self.folder / "views"
        # So short a walk has no keyframes left that could confirm a loop.
        result = photoslam("merge", first, second / "session.photoslam", "--output", both, "--set",
                           "loop_closure.detection.min_confirmations=0")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stdout, r"\d+ \+ \d+ keyframes, [1-9]\d* loop\(s\) closed")
        lines = [(run / "keyframes.tum").read_text(encoding="utf-8").splitlines() for run in (first, second, both)]
        keyframes = [sum(not line.startswith("#") for line in poses) for poses in lines]
        self.assertEqual(keyframes[2], keyframes[0] + keyframes[1])
        self.assertTrue((both / "map.ply").is_file())
        result = photoslam("render", both, "--orbit", "--orbit-frames", "2", "--output", views)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(len(list(views.glob("*.png"))), 2)
        found = self.run_deterministic("found", "--load-map", both, "--localize-only")
        frames = json.loads((found / "report.json").read_text(encoding="utf-8"))["frames"]
        self.assertEqual(frames["tracked"], frames["total"])

    def test_a_session_alone_can_be_looked_at(self):
        """As a killed run leaves one."""
        first = self.run_session()
        alone = self.folder / "alone"
        alone.mkdir()
        shutil.copy(first / "session.photoslam", alone)
        for number, source in enumerate((alone, alone / "session.photoslam")):
            target = self.folder / "made" / f"{number}.ply"
            result = photoslam("export", source, "--to", "ply", "--output", target)
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(sha256(target), sha256(first / "map.ply"))
        # Beside what an earlier run has left it is what is shown.
        (alone / "map.ply").write_bytes(b"older")
        os.utime(alone / "map.ply", (0, 0))
        result = photoslam("render", alone, "--orbit", "--orbit-frames", "2", "--output", self.output)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(len(list(self.output.glob("*.png"))), 2)

    def test_a_session_is_not_merged_with_something_else(self):
        first = self.run_session()
        self.assert_fails(photoslam("merge", first, self.folder / "nowhere", "--output", self.output), 1, "nowhere")
        self.assert_nothing_written()

    def test_damaged_sessions(self):
        session = self.run_session() / "session.photoslam"
        content = session.read_bytes()
        middle = len(content) // 2
        future = bytearray(content)
        future[8:16] = (99).to_bytes(4, "little") + (0xFFFFFFFF - 99).to_bytes(4, "little")
        damages = {
            "truncated": content[:middle],
            "damaged": content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1:],
            "newer photoslam": bytes(future),
            "not a session file": b"something else entirely, of some length",
        }
        for words, damaged in damages.items():
            with self.subTest(words=words):
                session.write_bytes(damaged)
                result = photoslam("run", SEQUENCE, "--load-map", session, "--output", self.output)
                self.assert_fails(result, 1, words, session)
                self.assert_nothing_written()
        self.assert_fails(photoslam("run", SEQUENCE, "--load-map", self.folder / "nowhere"), 1, "nowhere")
        self.assert_fails(photoslam("run", SEQUENCE, "--localize-only"), 2, "--load-map")

    def test_a_kill_while_saving_leaves_a_whole_session(self):
        first = self.run_session()
        output = self.folder / "again"
        shutil.copytree(first, output)
        command = [BINARY, "run", str(SEQUENCE), "--output", str(output), "--autosave", "0.001"]
        for delay in (0.15, 0.3, 0.45, 0.6, 0.75, 0.9):
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(delay)
            process.kill()
            process.wait()
            self.assertTrue((output / "session.photoslam").is_file())
        self.run_deterministic("check", "--load-map", output, "--localize-only")


if __name__ == "__main__":
    unittest.main()
