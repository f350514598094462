// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <memory>
#include <thread>

#include "base/clock.h"
#include "commands.h"
#include "interrupt.h"
#include "sources/sensor_choice.h"
#include "sources/synthetic/sequence_writer.h"
#include "sources/synthetic/world.h"

namespace photoslam {
namespace {

struct SynthArguments {
  std::string scene = "room";
  std::string sensor = "rgbd";
  std::string format = "auto";
  std::string lens = "none";
  std::filesystem::path output;
  bool lossless = false;
  int threads = 0;
  int shrink = 1;
  SyntheticOptions options;
};

/// Says how many frames are done: rewritten in place on a terminal, else a line now and then.
class FrameCounter {
 public:
  explicit FrameCounter(int total) : total_(total), terminal_(::isatty(STDERR_FILENO) != 0) {}
  void show(int done) {
    const bool last = done == total_;
    if (!last && since_last_.seconds() < (terminal_ ? 0.2 : 10.0)) return;
    since_last_.restart();
    fmt::print(stderr, "{}{} of {} frames, {:.1f} per second{}", terminal_ ? "\r\x1b[K" : "", done, total_,
               done / since_start_.seconds(), terminal_ && !last ? "" : "\n");
  }

 private:
  int total_;
  bool terminal_;
  Stopwatch since_start_, since_last_;
};

const std::map<std::string, SequenceLayout>& layouts() {
  static const std::map<std::string, SequenceLayout> kLayouts = {{"tum", SequenceLayout::tum},
                                                                 {"replica", SequenceLayout::replica},
                                                                 {"euroc", SequenceLayout::euroc},
                                                                 {"kitti", SequenceLayout::kitti}};
  return kLayouts;
}

/// A lens as cameras of this kind have it.
void mount_lens(const std::string& lens, SyntheticOptions& options) {
  if (lens == "radial") options.distortion = {-0.28, 0.074, 0.0002, -0.0003};
  if (lens == "fisheye") {
    options.distortion = {.k1 = 0.004, .k2 = 0.002, .k3 = -0.003, .k4 = 0.0005, .model = LensModel::kannala_brandt};
    options.camera.fx = options.camera.fy = 0.39 * options.camera.width;
  }
}

Status configure(SynthArguments& arguments, SequenceSettings& settings) {
  SyntheticOptions& options = arguments.options;
  const auto sensor = parse_sensor(arguments.sensor);
  if (!sensor) return sensor.error();
  options.sensor = sensor->value_or(SensorKind::rgbd);
  options.camera = shrink(options.camera, arguments.shrink);
  mount_lens(arguments.lens, options);
  if (arguments.format == "auto") arguments.format = options.sensor == SensorKind::stereo ? "euroc" : "tum";
  settings = {layouts().at(arguments.format), arguments.lossless};
  if (Status status = check_layout(settings.layout, options); !status) {
    return error("--format {}: {}", arguments.format, status.error().message);
  }
  return check_sequence_folder(arguments.output);
}

Status synthesize(SynthArguments arguments) {
  SequenceSettings settings;
  if (Status status = configure(arguments, settings); !status) return status;
  const InterruptGuard interrupt;
  const Stopwatch total;
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  ThreadPool executor(arguments.threads > 0 ? arguments.threads : cores);
  fmt::print(stderr, "building the {}\n", arguments.scene);
  const auto world = make_world(arguments.scene, static_cast<uint64_t>(arguments.options.seed), executor);
  fmt::print(stderr, "filming {} frames into {}\n", arguments.options.num_frames, arguments.output.string());

  FrameCounter counter(arguments.options.num_frames);
  const auto summary = write_sequence(
      SyntheticCamera(world, arguments.options), settings, arguments.output, executor,
      [&](int done) { counter.show(done); }, interrupt.token());
  if (!summary) return summary.error();
  fmt::print("{} frames in {:.1f} s: {}\n", summary->frames, total.seconds(), arguments.output.string());
  fmt::print(
      "detail: {:.2f} dB after shrinking 8x (real sequences: 22.5 to 26.5), "
      "mean horizontal difference {:.2f} grey levels (2.8 to 4.4)\n",
      summary->detail.shrunk_psnr_db, summary->detail.horizontal_difference);
  return {};
}

}  // namespace

void add_synth(CommandLine& line) {
  auto arguments = std::make_shared<SynthArguments>();
  CLI::App& command = line.add("synth", "Make a synthetic sequence with exact ground truth",
                               "  photoslam synth room --output room\n"
                               "  photoslam synth room --frames 900 --format replica --output room900\n"
                               "  photoslam synth room --sensor stereo --lens radial --output room_stereo\n"
                               "  photoslam synth room --noise 0 --depth-noise 0 --depth-holes 0 --output clean\n");
  SynthArguments& a = *arguments;
  SyntheticOptions& o = a.options;
  std::vector<std::string> names;
  std::string scenes = "What to film:";
  for (const WorldInfo& world : synthetic_worlds()) {
    names.push_back(world.name);
    scenes +=
        fmt::format(" {} ({}){}", world.name, world.description, names.size() < synthetic_worlds().size() ? "," : "");
  }
  command.add_option("scene", a.scene, scenes)->required()->check(CLI::IsMember(names));
  command.add_option("--sensor", a.sensor, "Sensor of the camera")
      ->check(CLI::IsMember({"rgbd", "stereo", "mono"}))
      ->capture_default_str();
  command.add_option("--format", a.format, "Layout of the sequence; auto is tum, or euroc for stereo")
      ->check(CLI::IsMember({"auto", "tum", "replica", "euroc", "kitti"}))
      ->capture_default_str();
  command.add_option("--output", a.output, "Folder for the sequence, new or empty")->required();
  command.add_option("--frames", o.num_frames, "Length; 300 are the first loop, 900 the whole tour")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command.add_option("--shrink", a.shrink, "Images smaller by this factor: 2 is 320x240")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  command.add_option("--fps", o.frames_per_second, "Rate of the camera [Hz]")
      ->check(CLI::Range(1.0, 240.0))
      ->capture_default_str();
  command.add_option("--seed", o.seed, "Another room, another shake of the hand, another noise")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_option("--seconds-per-lap", o.seconds_per_lap, "Time of one loop [s]; below 10 the motion gets fast")
      ->check(CLI::Range(1.0, 1e4))
      ->capture_default_str();
  command.add_option("--noise", o.image_noise, "σ of the image noise at mid-grey [grey levels]")
      ->check(CLI::Range(0.0, 50.0))
      ->capture_default_str();
  command.add_option("--depth-noise", o.depth_noise, "σ of the depth at 1 m [m]; grows with the square of the depth")
      ->check(CLI::Range(0.0, 0.1))
      ->capture_default_str();
  command
      .add_option("--depth-holes", o.depth_holes, "Share of pixels at depth edges and grazing surfaces without depth")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command.add_option("--exposure-drift", o.exposure_drift, "Largest slow change of the exposure [EV]")
      ->check(CLI::Range(0.0, 4.0))
      ->capture_default_str();
  command.add_option("--exposure-jumps", o.exposure_jumps, "Height of sudden changes of the exposure [EV]")
      ->check(CLI::Range(0.0, 4.0))
      ->capture_default_str();
  command.add_option("--lens", a.lens, "Distortion: none, radial (and tangential) or fisheye of 140°")
      ->check(CLI::IsMember({"none", "radial", "fisheye"}))
      ->capture_default_str();
  command.add_option("--shutter", o.shutter_s, "Time the shutter is open: motion blur [s]")
      ->check(CLI::Range(0.0, 0.1))
      ->capture_default_str();
  command.add_option("--readout", o.readout_s, "Time from the first to the last row: rolling shutter [s]")
      ->check(CLI::Range(0.0, 0.1))
      ->capture_default_str();
  command.add_option("--baseline", o.baseline_m, "Distance of the two cameras of a stereo rig [m]")
      ->check(CLI::Range(0.01, 10.0))
      ->capture_default_str();
  command.add_flag("--lossless", a.lossless, "Colour as PNG instead of JPEG (not with replica)");
  command.add_option("--threads", a.threads, "Threads to use; 0 = one per core")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  line.on_run(command, [arguments] {
    if (arguments->lossless && arguments->format == "replica")
      throw CLI::ValidationError("--lossless", "needs another format: Replica's colour images are JPEG");
    if (arguments->format == "replica" && arguments->options.frames_per_second != 30)
      throw CLI::ValidationError("--fps", "Replica sequences carry no times and are read at 30 Hz");
    return synthesize(*arguments);
  });
}

}  // namespace photoslam
