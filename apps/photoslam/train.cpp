// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <charconv>
#include <memory>
#include <thread>

#include "backend_arguments.h"
#include "base/clock.h"
#include "base/file.h"
#include "commands.h"
#include "config_arguments.h"
#include "evaluation/image_score.h"
#include "evaluation/map_scoring.h"
#include "evaluation/statistics.h"
#include "image/convert.h"
#include "interrupt.h"
#include "io/gaussian_ply.h"
#include "io/image_file.h"
#include "photorealistic_mapping/photorealistic_mapper.h"
#include "photorealistic_mapping/posed_map.h"
#include "photorealistic_mapping/view_geometry.h"
#include "photorealistic_mapping/world_export.h"
#include "posed_images.h"
#include "run_folder.h"
#include "sources/camera_file.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

struct TrainArguments {
  fs::path input;
  fs::path run;
  fs::path output = "output/train";
  std::string init = "depth";
  double seconds = 60;
  int iterations = 0;
  int hold_out = 0;
  int threads = 0;
  uint64_t seed = 1;
  BackendArguments backend;
  ConfigArguments config;
};

/// The part of the world that was photographed: all points but stray ones or, without points, as far around what the
/// cameras look at as they are from it.
Eigen::AlignedBox3d scene_box(const PosedImages& input) {
  Eigen::AlignedBox3d box;
  if (input.points.empty()) {
    const Vec3 focus = focus_point(input.poses);
    double radius = 0;
    for (const SE3& pose : input.poses) radius = std::max(radius, (pose * focus).norm());
    return {focus - Vec3::Constant(radius), focus + Vec3::Constant(radius)};
  }
  constexpr double kStray = 0.01;  // share at either end of each axis
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const SparsePoint& point : input.points) values.push_back(point.position[axis]);
    box.min()[axis] = percentile(values, kStray);
    box.max()[axis] = percentile(values, 1 - kStray);
  }
  return box;
}

/// Gaussians of random place and colour in the scene.
std::vector<splatting::Gaussian> random_gaussians(const PosedImages& input, int count, uint64_t seed) {
  const Eigen::AlignedBox3d box = scene_box(input);
  Random random(seed);
  std::vector<splatting::Gaussian> gaussians(static_cast<size_t>(count));
  const double spacing = std::cbrt(box.volume() / count);
  for (splatting::Gaussian& g : gaussians) {
    for (int i = 0; i < 3; ++i) {
      g.mean[i] = static_cast<float>(random.uniform(box.min()[i], box.max()[i]));
      g.log_scale[i] = static_cast<float>(std::log(0.5 * spacing));
      g.sh[0][i] = static_cast<float>(random.uniform(-1.0, 1.0));
    }
    g.opacity_logit = -2.2f;
  }
  return gaussians;
}

constexpr int kMostRandom = 20'000'000;

/// The gaussians to begin with; nothing when they are seeded from measured depth.
Result<std::vector<splatting::Gaussian>> initial_gaussians(const TrainArguments& arguments, const PosedImages& input) {
  std::vector<splatting::Gaussian> gaussians;
  if (arguments.init == "depth") return gaussians;
  if (arguments.init.starts_with("random:")) {
    const char* const end = arguments.init.data() + arguments.init.size();
    int count = 0;
    const auto read = std::from_chars(arguments.init.data() + 7, end, count);
    if (read.ec != std::errc{} || read.ptr != end || count < 1 || count > kMostRandom) {
      throw CLI::ValidationError(
          "--init", fmt::format("{}: expected random:COUNT, a whole number from 1 to {}, as in random:10000",
                                arguments.init, kMostRandom));
    }
    return random_gaussians(input, count, arguments.seed);
  }
  const auto table = read_gaussian_ply(arguments.init);
  if (!table) return table.error();
  const splatting::GaussianModel model = from_world(*table);
  model.for_each([&](size_t i) { gaussians.push_back(model.get(i)); });
  return gaussians;
}

/// Offline training as in 3D gaussian splatting: nothing but splitting and cloning adds to the gaussians to begin with,
/// only transparent ones are pruned, since the first ones are large and few are in front, and poses stay as they are.
void densify_only(PhotorealisticOptions& options) {
  options.depth.enabled = false;
  options.seeding.dense = false;
  options.seeding.active_features = false;
  options.seeding.inactive_features = false;
  options.reseed_interval = 0;
  options.poses.enabled = false;
  options.densification.enabled = true;
  options.densification.interval = 100;
  options.densification.min_opacity = 0.005;
  options.densification.max_scale = 100;
  options.densification.min_weight = 0;
}

bool is_held_out(const TrainArguments& arguments, size_t i) {
  return arguments.hold_out > 0 && static_cast<int>(i) % arguments.hold_out == arguments.hold_out - 1;
}

void train_until_done(const TrainArguments& arguments, const std::stop_token& stop, Executor& executor,
                      PhotorealisticMapper& mapper) {
  const Stopwatch clock;
  double last_line = 0;
  for (int i = 0; !stop.stop_requested(); ++i) {
    const double done =
        arguments.iterations > 0 ? static_cast<double>(i) / arguments.iterations : clock.seconds() / arguments.seconds;
    if (done >= 1) return;
    mapper.train(done, executor);
    if (clock.seconds() - last_line < 2) continue;
    last_line = clock.seconds();
    fmt::print(stderr, "{:3.0f} %: {} iterations, {} gaussians, PSNR {:.1f} dB\n", 100 * done, mapper.num_iterations(),
               mapper.gaussians().size(), mapper.training_psnr());
  }
}

/// Renders every picture from the trained map; writes the pairs, photo left and render right, and prints the figures. A
/// picture that was held out has the exposure of the one before it: nothing is learnt from it.
Status score(const TrainArguments& arguments, const PosedImages& input, const FrozenMap& map, Executor& executor) {
  splatting::Renderer renderer;
  splatting::RenderResult result;
  std::vector<splatting::Pose> camera_from_anchor;
  std::vector<FrameScore> trained, held_out;
  const fs::path pairs = arguments.output / "pairs";
  if (Status status = prepare_output_folder(pairs); !status) return status;
  size_t next_keyframe = 0;
  for (size_t i = 0; i < input.poses.size(); ++i) {
    const bool held = is_held_out(arguments, i);
    const SE3& pose = held ? input.poses[i] : map.keyframes_from_world[next_keyframe++];
    const size_t nearest = std::max<size_t>(next_keyframe, 1) - 1;
    camera_from_anchors(pose, map.anchors_from_world, camera_from_anchor);
    renderer.render(map.gaussians, {to_splatting(input.camera), camera_from_anchor}, {}, executor, result);
    apply(map.keyframe_exposures[nearest], result);
    const ImageF render = to_image(result);
    const FrameId id(static_cast<int32_t>(i));
    (held ? held_out : trained).push_back(score_frame(id, 0, render, input.images[i], input.mask(i)));
    ImageU8 pair(2 * input.camera.width, input.camera.height, 3);
    const ImageU8 drawn = to_u8(render);
    for (int y = 0; y < pair.height(); ++y) {
      std::copy_n(input.images[i].row(y), 3 * drawn.width(), pair.row(y));
      std::copy_n(drawn.row(y), 3 * drawn.width(), pair.row(y) + 3 * drawn.width());
    }
    if (Status status = write_png(pairs / fmt::format("{:06}.png", i), pair); !status) return status;
  }
  for (const auto& [name, scores] : {std::pair{"trained views", &trained}, {"held-out views", &held_out}}) {
    if (scores->empty()) continue;
    const ImageFigures figures = summarize(*scores);
    fmt::print("  {:<18}PSNR {:.2f} dB (5 % below {:.2f}), SSIM {:.3f}, {} images\n", name, *figures.psnr_db,
               *figures.psnr_p5_db, *figures.ssim, scores->size());
  }
  return {};
}

/// Where the pictures that were trained on had been taken; those without a time are a second apart.
Trajectory trained_poses(const TrainArguments& arguments, const PosedImages& input, const FrozenMap& map) {
  Trajectory result;
  for (size_t i = 0; i < input.poses.size(); ++i) {
    if (is_held_out(arguments, i)) continue;
    const int64_t time_ns = input.times_ns.empty() ? static_cast<int64_t>(i) * 1'000'000'000 : input.times_ns[i];
    result.push_back({time_ns, map.keyframes_from_world[result.size()].inverse()});
  }
  return result;
}

/// What `render` wants to know beside map.ply. In the folder of a run it is there, and stays.
Status describe_map(const TrainArguments& arguments, const PosedImages& input, const FrozenMap& map) {
  if (fs::exists(arguments.output / "run.json")) return {};
  const std::string camera = camera_yaml({.camera = input.camera, .distortion = {}});
  if (Status status = write_file_atomically(arguments.output / kMapCameraFile, camera); !status) return status;
  return write_tum_trajectory(arguments.output / "keyframes.tum", trained_poses(arguments, input, map));
}

/// map.ply, its description and, for the keyframes of a run, exposures.txt; returns the number of gaussians.
Result<size_t> write_map(const TrainArguments& arguments, const PosedImages& input, const FrozenMap& map) {
  const auto written =
      write_gaussian_ply(arguments.output / "map.ply", to_world(map.gaussians, map.anchors_from_world));
  if (!written) return written.error();
  if (Status status = describe_map(arguments, input, map); !status) return status.error();
  if (input.times_ns.empty()) return written->written;
  ExposureTrack track;
  for (size_t i = 0; i < input.times_ns.size(); ++i) {
    if (!is_held_out(arguments, i)) track.push_back({input.times_ns[i], map.keyframe_exposures[track.size()]});
  }
  if (Status status = write_exposures(arguments.output / kExposuresFile, track); !status) return status.error();
  return written->written;
}

Status train(const TrainArguments& arguments) {
  const InterruptGuard interrupt;  // before any other thread begins
  if (arguments.input.empty() == arguments.run.empty()) {
    throw CLI::ValidationError("give either posed images or --poses RUN");
  }
  check_hold_out(arguments.hold_out);
  Result<SystemOptions> options = arguments.config.load();
  if (!options) return options.error();
  const auto input = arguments.run.empty() ? read_posed_images(arguments.input) : read_keyframes_of_run(arguments.run);
  if (!input) return input.error();
  const auto start = initial_gaussians(arguments, *input);
  if (!start) return start.error();
  if (Status status = prepare_output_folder(arguments.output); !status) return status;
  const auto gpu = arguments.backend.open();
  if (!gpu) return gpu.error();
  if (!start->empty()) densify_only(options->photorealistic_mapping);

  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  ThreadPool executor(arguments.threads > 0 ? arguments.threads : cores);
  std::vector<SE3> poses;
  std::vector<Vec3> points;
  for (size_t i = 0; i < input->poses.size(); ++i) {
    if (!is_held_out(arguments, i)) poses.push_back(input->poses[i]);
  }
  for (const SparsePoint& point : input->points) points.push_back(point.position);
  const auto map = posed_map(input->camera, poses, points);
  fmt::print(stderr, "{} images {}x{}, {} of them to train on\n", input->images.size(), input->camera.width,
             input->camera.height, poses.size());
  if (input->num_resampled > 0) {
    fmt::print(stderr, "{} resampled to what a lens without distortion, as long as the first image's, sees\n",
               input->num_resampled);
  }

  PhotorealisticMapper mapper(options->photorealistic_mapping, {.camera = input->camera}, arguments.seed, *gpu);
  int32_t keyframe = 0;
  for (size_t i = 0; i < input->images.size(); ++i) {
    if (interrupt.token().stop_requested()) return error("interrupted before training began");
    if (is_held_out(arguments, i)) continue;
    mapper.add_keyframe(*map, KeyframeId(keyframe++), {input->images[i], {}, {}, input->mask(i)}, executor,
                        input->exposures[i]);
  }
  const size_t num_wanted = mapper.gaussians().size() + start->size();
  mapper.add_gaussians(*start);
  if (mapper.gaussians().size() < num_wanted) {
    fmt::print(stderr, "  note: training begins with {} of {} gaussians: densification.max_gaussians allows no more\n",
               mapper.gaussians().size(), num_wanted);
  }
  train_until_done(arguments, interrupt.token(), executor, mapper);

  const FrozenMap trained = mapper.freeze();
  report_failure(gpu->get());
  const auto written = write_map(arguments, *input, trained);
  if (!written) return written.error();
  fmt::print("  {:<18}{} gaussians after {} iterations: {}\n", "map", *written, mapper.num_iterations(),
             (arguments.output / "map.ply").string());
  return score(arguments, *input, trained, executor);
}

}  // namespace

void add_train(CommandLine& line) {
  auto arguments = std::make_shared<TrainArguments>();
  CLI::App& command = line.add("train", "Map photorealistically from images whose poses are known",
                               "  photoslam train transforms.json --seconds 120 --output output/fox\n"
                               "  photoslam train colmap_folder --hold-out 8\n"
                               "  photoslam train --poses output/desk --init random:10000 --seconds 60\n");
  TrainArguments& a = *arguments;
  command.add_option("images", a.input, "transforms.json, or a folder with one or with a COLMAP model");
  command.add_option("--poses", a.run, "Take images and poses of the keyframes of a run instead");
  command
      .add_option("--output", a.output,
                  "Folder for map.ply, what render needs beside it, and pairs/ (photo left, render right)")
      ->capture_default_str();
  command
      .add_option(
          "--init", a.init,
          "Gaussians to begin with: depth (measured by comparing the images, in the range of the points that come "
          "with them), random:COUNT, or a map.ply")
      ->capture_default_str();
  command.add_option("--seconds", a.seconds, "Time to train [s]")->check(CLI::Range(0.1, 1e6))->capture_default_str();
  command.add_option("--iterations", a.iterations, "Iterations to train instead")->check(CLI::Range(0, 100000000));
  command.add_option("--hold-out", a.hold_out, "Keep every Nth image for scoring")->check(CLI::Range(0, 1000000));
  command.add_option("--seed", a.seed, "Seed of everything random")->capture_default_str();
  command.add_option("--threads", a.threads, "Threads; 0: one per core")->check(CLI::Range(0, 1024));
  a.backend.bind(command);
  a.config.bind(command);
  line.on_run(command, [arguments] { return train(*arguments); });
}

}  // namespace photoslam
