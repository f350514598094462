// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/bench.h"

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "backend_arguments.h"
#include "base/clock.h"
#include "commands.h"
#include "image/convert.h"
#include "image/resize.h"
#include "image_size.h"
#include "io/gaussian_ply.h"
#include "io/image_file.h"
#include "photorealistic_mapping/view_geometry.h"
#include "photorealistic_mapping/world_export.h"
#include "sources/posed_cameras.h"
#include "splatting/testing/simd_targets.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

struct BenchArguments {
  std::string what;
  fs::path model;
  fs::path cameras;
  std::string size;
  int threads = 0;
  double zoom = 1.0;
  int rounds = 4;
  std::string simd;
  BackendArguments backend{.backend = "cpu"};
  bool json = false;
};

/// The cameras and their images at the size asked for.
Result<std::vector<splatting::BenchView>> load_views(const BenchArguments& arguments) {
  const auto cameras = read_transforms_json(arguments.cameras);
  if (!cameras) return cameras.error();
  std::vector<splatting::BenchView> views;
  for (const PosedCamera& posed : *cameras) {
    if (!posed.distortion.none()) return error("{}: undistort the images first", arguments.cameras.string());
    ImageSize size{posed.camera.width, posed.camera.height};
    if (!arguments.size.empty()) {
      size = parse_image_size(arguments.size);
    }
    if (size.width * posed.camera.height != size.height * posed.camera.width) {
      return error("--size {} changes the aspect of {}x{}", arguments.size, posed.camera.width, posed.camera.height);
    }
    const auto image = read_image(posed.image);
    if (!image) return image.error();
    const ImageU8 small = resize(to_rgb(*image), size.width, size.height);
    PinholeCamera camera = resize(posed.camera, size.width, size.height);
    camera.fx *= arguments.zoom;
    camera.fy *= arguments.zoom;
    std::vector<splatting::Pose> pose;
    camera_from_anchors(posed.camera_from_world, std::vector<SE3>(1), pose);
    views.push_back(
        {to_splatting(camera), pose.front(), splatting::TargetImage(size.width, size.height, small.values())});
  }
  return views;
}

nlohmann::ordered_json to_json(const splatting::BenchReport& report, const splatting::Camera& camera, int threads,
                               double trainer_mb, const splatting::MachineProbe& probe) {
  return {{"size", fmt::format("{}x{}", camera.width, camera.height)},
          {"threads", threads},
          {"simd", splatting::simd_target()},
          {"gaussians", report.gaussians},
          {"visible", report.visible},
          {"iterations", report.iterations},
          {"wall_ms", report.wall_ms},
          {"iteration_ms", report.iteration_ms},
          {"render_ms", report.render_ms},
          {"stages",
           {{"project_ms", report.stages.project},
            {"sort_ms", report.stages.sort},
            {"forward_ms", report.stages.forward},
            {"loss_ms", report.stages.loss},
            {"backward_ms", report.stages.backward},
            {"update_ms", report.stages.update}}},
          {"loss_first", report.loss_first},
          {"loss_last", report.loss_last},
          {"peak_rss_mb", peak_rss_mb()},
          {"trainer_mb", trainer_mb},
          {"probe", {{"fma_gflops", probe.fma_gflops}, {"triad_gbs", probe.triad_gbs}}}};
}

void print_table(const nlohmann::ordered_json& figures) {
  for (const auto& [key, value] : figures.items()) {
    if (value.is_object()) {
      for (const auto& [inner, number] : value.items()) fmt::print("  {:<22}{:.2f}\n", inner, number.get<double>());
    } else if (value.is_number_float()) {
      fmt::print("  {:<22}{:.3f}\n", key, value.get<double>());
    } else {
      fmt::print("  {:<22}{}\n", key, value.is_string() ? value.get<std::string>() : value.dump());
    }
  }
}

/// Makes the engine use the named SIMD target as long as the result lives; empty: what the machine does best.
Result<std::unique_ptr<splatting::testing::ScopedSimdTarget>> choose_simd(const std::string& name) {
  std::unique_ptr<splatting::testing::ScopedSimdTarget> chosen;
  std::string available;
  for (const int64_t target : splatting::testing::simd_targets()) {
    const std::string candidate = splatting::testing::simd_target_name(target);
    available += " " + candidate;
    if (candidate == name) chosen = std::make_unique<splatting::testing::ScopedSimdTarget>(target);
  }
  if (!name.empty() && chosen == nullptr) return error("--simd {}: this machine has{}", name, available);
  return chosen;
}

Status bench_splat(const BenchArguments& arguments) {
  const double rss_at_start_mb = current_rss_mb();
  const int threads =
      arguments.threads > 0 ? arguments.threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const auto simd = choose_simd(arguments.simd);
  if (!simd) return simd.error();
  splatting::GaussianModel model;
  double file_mb = 0;
  {
    const auto table = read_gaussian_ply(arguments.model);
    if (!table) return table.error();
    file_mb = 1e-6 * static_cast<double>(fs::file_size(arguments.model));
    model = from_world(*table);
  }
  const auto views = load_views(arguments);
  if (!views) return views.error();
  const auto gpu = arguments.backend.open();
  if (!gpu) return gpu.error();
  ThreadPool executor(threads);
  const splatting::BenchReport report =
      splatting::bench_training(model, *views, arguments.rounds, splatting::TrainOptions{}, executor, *gpu);
  if (*gpu && !(*gpu)->failure().empty()) return error("the GPU has failed: {}", (*gpu)->failure());
  const double trainer_mb = peak_rss_mb() - rss_at_start_mb - file_mb;
  auto figures = to_json(report, views->front().camera, threads, trainer_mb, splatting::probe_machine(executor));
  if (*gpu) figures.update({{"gpu", (*gpu)->name()}, {"gpu_mb", (*gpu)->peak_mb()}});
  if (arguments.json) {
    fmt::print("{}\n", figures.dump(2));
  } else {
    print_table(figures);
  }
  return {};
}

}  // namespace

void add_bench(CommandLine& line) {
  auto arguments = std::make_shared<BenchArguments>();
  CLI::App& command =
      line.add("bench", "Measure the speed of this machine: training steps of the splatting engine",
               "  photoslam bench splat --model map.ply --cameras transforms.json --size 480x640 --threads 2 --json\n");
  BenchArguments& a = *arguments;
  command.add_option("what", a.what, "What to measure: splat")->required()->check(CLI::IsMember({"splat"}));
  command.add_option("--model", a.model, "Gaussians: a PLY file")->required();
  command.add_option("--cameras", a.cameras, "Cameras and images: transforms.json")->required();
  command.add_option("--size", a.size, "Image size; default: that of the images")->type_name("WxH");
  command.add_option("--threads", a.threads, "Threads; 0: one per core")->check(CLI::Range(0, 1024));
  command.add_option("--zoom", a.zoom, "Multiplies the focal lengths")->check(CLI::Range(0.01, 1000.0));
  command.add_option("--rounds", a.rounds, "Training steps per camera")->check(CLI::Range(1, 100000));
  command.add_option("--simd", a.simd, "SIMD target: AVX3, AVX2, SSE4 or NEON; default: the best this machine has")
      ->type_name("NAME");
  a.backend.bind(command);
  command.add_flag("--json", a.json, "Print JSON");
  line.on_run(command, [arguments] { return bench_splat(*arguments); });
}

}  // namespace photoslam
