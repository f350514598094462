// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <memory>
#include <thread>

#include "base/clock.h"
#include "commands.h"
#include "image_size.h"
#include "interrupt.h"
#include "sources/sensor_choice.h"
#include "sources/synthetic/camera_path.h"
#include "sources/synthetic/mesh_world.h"
#include "sources/synthetic/sequence_writer.h"

namespace photoslam {
namespace {

constexpr int kDefaultFrames = 300;

struct SynthArguments {
  std::string scene = "room";
  std::string sensor = "rgbd";
  std::string format = "auto";
  std::string lens = "none";
  std::filesystem::path output, trajectory;
  bool lossless = false;
  int threads = 0;
  int shrink = 1;
  std::string size;
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

bool is_world_name(const std::string& scene) {
  const auto worlds = synthetic_worlds();
  return std::ranges::any_of(worlds, [&](const WorldInfo& world) { return world.name == scene; });
}

/// The camera with a sensor of another size behind the same optics: as wide a view, more or less high.
PinholeCamera with_size(const PinholeCamera& camera, ImageSize size) {
  const double scale = static_cast<double>(size.width) / camera.width;
  PinholeCamera other{.width = size.width, .height = size.height, .fx = scale * camera.fx, .fy = scale * camera.fy};
  other.cx = scale * (camera.cx + 0.5) - 0.5;
  other.cy = 0.5 * (size.height - 1) + scale * (camera.cy - 0.5 * (camera.height - 1));
  return other;
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
  if (!arguments.size.empty()) {
    const ImageSize size = parse_image_size(arguments.size);
    if (size.width < 64 || size.height < 48 || size.width > 8192 || size.height > 8192)
      throw CLI::ValidationError("--size", arguments.size + ": between 64x48 and 8192x8192");
    options.camera = with_size(options.camera, size);
  }
  options.camera = shrink(options.camera, arguments.shrink);
  mount_lens(arguments.lens, options);
  if (arguments.format == "auto") arguments.format = options.sensor == SensorKind::stereo ? "euroc" : "tum";
  settings = {layouts().at(arguments.format), arguments.lossless};
  if (Status status = check_layout(settings.layout, options); !status) {
    return error("--format {}: {}", arguments.format, status.error().message);
  }
  return check_sequence_folder(arguments.output);
}

/// What to film and along which path; without a path along the world's own.
struct Scene {
  std::shared_ptr<const SyntheticWorld> world;
  std::unique_ptr<const CameraPath> path;
};

/// As many frames as the walk has, or as many of them as are wanted.
Status choose_frames(const SynthArguments& arguments, double seconds, SyntheticOptions& options) {
  const int whole = static_cast<int>(seconds * options.frames_per_second) + 1;
  if (options.num_frames == 0) options.num_frames = whole;
  if (options.num_frames <= whole) return {};
  return error("--frames {}: {} has poses for {} frames at {} Hz", options.num_frames, arguments.trajectory.string(),
               whole, options.frames_per_second);
}

/// One of our worlds by its name, or a user's mesh.
Result<Scene> build_scene(SynthArguments& arguments, Executor& executor) {
  SyntheticOptions& options = arguments.options;
  if (!is_world_name(arguments.scene)) {
    auto mesh = open_mesh_world(arguments.scene, arguments.trajectory, executor);
    if (!mesh) return mesh.error();
    if (Status status = choose_frames(arguments, mesh->seconds, options); !status) return status.error();
    return Scene{mesh->world, nullptr};
  }
  std::unique_ptr<const RecordedPath> path;
  if (!arguments.trajectory.empty()) {
    auto poses = read_walk(arguments.trajectory);
    if (!poses) return poses.error();
    path = std::make_unique<const RecordedPath>(std::move(*poses));
    if (Status status = choose_frames(arguments, path->seconds(), options); !status) return status.error();
  } else if (options.num_frames == 0) {
    options.num_frames = kDefaultFrames;
  }
  return Scene{make_world(arguments.scene, static_cast<uint64_t>(options.seed), executor), std::move(path)};
}

Status synthesize(SynthArguments arguments) {
  SequenceSettings settings;
  if (Status status = configure(arguments, settings); !status) return status;
  const InterruptGuard interrupt("nothing is kept of an unfinished sequence");
  const Stopwatch total;
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  ThreadPool executor(arguments.threads > 0 ? arguments.threads : cores);
  fmt::print(stderr, "building {}\n", arguments.scene);
  auto scene = build_scene(arguments, executor);
  if (!scene) return scene.error();
  fmt::print(stderr, "filming {} frames into {}\n", arguments.options.num_frames, arguments.output.string());

  FrameCounter counter(arguments.options.num_frames);
  const auto summary = write_sequence(
      SyntheticCamera(scene->world, arguments.options, std::move(scene->path)), settings, arguments.output, executor,
      [&](int done) { counter.show(done); }, interrupt.token());
  if (!summary) return summary.error();
  fmt::print("{} frames in {:.1f} s: {}\n", summary->frames, total.seconds(), arguments.output.string());
  fmt::print(
      "fine detail: {:.2f} dB are left after shrinking 8x, neighbours differ by {:.2f} grey levels "
      "(for comparison, real sequences of 640x480: 22.5 to 26.5 dB, 2.8 to 4.4)\n",
      summary->detail.shrunk_psnr_db, summary->detail.horizontal_difference);
  return {};
}

/// A world's name, or a mesh with a walk.
void check_scene(const SynthArguments& arguments) {
  if (is_world_name(arguments.scene)) return;
  std::vector<std::string> names;
  for (const WorldInfo& world : synthetic_worlds()) names.push_back(world.name);
  if (!std::filesystem::is_regular_file(arguments.scene))
    throw CLI::ValidationError(
        "scene", fmt::format("'{}' is neither a mesh file nor one of {}", arguments.scene, fmt::join(names, ", ")));
  if (arguments.trajectory.empty())
    throw CLI::ValidationError("--trajectory", "is missing: a mesh needs a walk, a TUM file of camera poses");
}

}  // namespace

void add_synth(CommandLine& line) {
  auto arguments = std::make_shared<SynthArguments>();
  CLI::App& command = line.add("synth", "Make a synthetic sequence with exact ground truth",
                               "  photoslam synth room --output room\n"
                               "  photoslam synth room --frames 900 --format replica --output room900\n"
                               "  photoslam synth room --sensor stereo --lens radial --output room_stereo\n"
                               "  photoslam synth room --noise 0 --depth-noise 0 --depth-holes 0 --output clean\n"
                               "  photoslam synth house --trajectory walk.txt --output another_walk\n"
                               "  photoslam synth scan.ply --trajectory walk.txt --output scan_walk\n");
  SynthArguments& a = *arguments;
  SyntheticOptions& o = a.options;
  std::string scenes = "What to film:";
  for (const WorldInfo& world : synthetic_worlds()) scenes += fmt::format(" {} ({}),", world.name, world.description);
  scenes += " or a mesh of yours (.ply or .obj, with colours at its vertices or in images)";
  command.add_option("scene", a.scene, scenes)->required();
  command
      .add_option("--trajectory", a.trajectory,
                  "Walk of yours: poses of the camera in the frame of the scene (TUM file); a mesh needs one")
      ->check(CLI::ExistingFile);
  command.add_option("--sensor", a.sensor, "Sensor of the camera")
      ->check(CLI::IsMember({"rgbd", "stereo", "mono"}))
      ->capture_default_str();
  command.add_option("--format", a.format, "Layout of the sequence; auto is tum, or euroc for stereo")
      ->check(CLI::IsMember({"auto", "tum", "replica", "euroc", "kitti"}))
      ->capture_default_str();
  command.add_option("--output", a.output, "Folder for the sequence, new or empty")->required();
  o.num_frames = 0;
  command
      .add_option(
          "--frames", o.num_frames,
          fmt::format("Length; in the room 300 are the first loop and 900 the whole tour. Without it {}, or the "
                      "whole walk of yours",
                      kDefaultFrames))
      ->check(CLI::Range(1, 1000000));
  command.add_option("--shrink", a.shrink, "Images smaller by this factor: 2 is 320x240")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  command.add_option("--size", a.size, "Images of another size, equally wide a view [default: 640x480]")
      ->type_name("WxH");
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
  command
      .add_option("--reflections", o.reflections, "Share of what glossy surfaces mirror that is seen; 0: all is matt")
      ->check(CLI::Range(0.0, 1.0))
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
    check_scene(*arguments);
    if (arguments->lossless && arguments->format == "replica")
      throw CLI::ValidationError("--lossless", "needs another format: Replica's colour images are JPEG");
    if (arguments->format == "replica" && arguments->options.frames_per_second != 30)
      throw CLI::ValidationError("--fps", "Replica sequences carry no times and are read at 30 Hz");
    return synthesize(*arguments);
  });
}

}  // namespace photoslam
