// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <thread>

#include "backend_arguments.h"
#include "base/clock.h"
#include "base/file.h"
#include "commands.h"
#include "evaluation/map_scoring.h"
#include "image/convert.h"
#include "io/image_file.h"
#include "io/npy_file.h"
#include "map_input.h"
#include "photorealistic_mapping/orbit.h"
#include "photorealistic_mapping/view_geometry.h"
#include "photorealistic_mapping/world_export.h"
#include "sources/calibration/calibration.h"
#include "sources/posed_cameras.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

struct RenderArguments {
  fs::path map;
  fs::path cameras;
  fs::path trajectory;
  fs::path camera;
  bool orbit = false;
  int orbit_frames = 120;
  fs::path output = "output/render";
  std::string format = "png";
  BackendArguments backend;
};

/// The calibration to render with: --camera, else that of the run.
Result<PinholeCamera> choose_camera(const RenderArguments& arguments, const MapInput& input) {
  if (arguments.camera.empty()) return input.camera();
  const auto file = read_calibration(arguments.camera);
  if (!file) return file.error();
  if (file->camera.width > 0) return file->camera;
  return error("{} does not tell the size of the images; write a camera.yaml with width and height",
               arguments.camera.string());
}

Result<std::vector<PosedCamera>> choose_views(const RenderArguments& arguments, const MapInput& input) {
  if (!arguments.cameras.empty()) return read_transforms_json(arguments.cameras);
  const auto camera = choose_camera(arguments, input);
  if (!camera) return camera.error();
  std::vector<PosedCamera> views;
  if (arguments.orbit) {
    const auto keyframes = input.keyframes();
    if (!keyframes) return keyframes.error();
    for (const SE3& pose : orbit(input.map(), *keyframes, arguments.orbit_frames)) views.push_back({*camera, pose, {}});
    return views;
  }
  const auto trajectory = read_tum_trajectory(arguments.trajectory);
  if (!trajectory) return trajectory.error();
  for (const StampedPose& pose : *trajectory) views.push_back({*camera, pose.world_from_camera.inverse(), {}});
  return views;
}

Status write_view(const RenderArguments& arguments, size_t index, const splatting::RenderResult& render) {
  const ImageF image = to_image(render);
  const fs::path path = arguments.output / fmt::format("{:06}.{}", index, arguments.format);
  return arguments.format == "npy" ? write_npy(path, image) : write_png(path, to_u8(image));
}

Status render(const RenderArguments& arguments) {
  const int chosen = !arguments.cameras.empty() + !arguments.trajectory.empty() + arguments.orbit;
  if (chosen != 1) throw CLI::ValidationError("give one of --cameras, --trajectory and --orbit");
  const auto input = MapInput::open(arguments.map);
  if (!input) return input.error();
  const auto views = choose_views(arguments, *input);
  if (!views) return views.error();
  if (Status status = prepare_output_folder(arguments.output); !status) return status;
  const auto gpu = arguments.backend.open();
  if (!gpu) return gpu.error();

  const splatting::GaussianModel model = from_world(input->map());
  const std::vector<SE3> world = {SE3{}};
  ThreadPool executor(std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
  splatting::Renderer renderer(*gpu);
  splatting::RenderResult result;
  std::vector<splatting::Pose> camera_from_anchor;
  double render_ms = 0;
  for (size_t i = 0; i < views->size(); ++i) {
    const PosedCamera& view = (*views)[i];
    camera_from_anchors(view.camera_from_world, world, camera_from_anchor);
    const Stopwatch clock;
    renderer.render(model, {to_splatting(view.camera), camera_from_anchor}, {}, executor, result);
    render_ms += clock.milliseconds();
    if (Status status = write_view(arguments, i, result); !status) return status;
  }
  report_failure(gpu->get());
  fmt::print("{} images of {} gaussians in {}, {:.1f} ms each to render\n", views->size(), input->map().size(),
             arguments.output.string(), render_ms / static_cast<double>(views->size()));
  return {};
}

}  // namespace

void add_render(CommandLine& line) {
  auto arguments = std::make_shared<RenderArguments>();
  CLI::App& command =
      line.add("render", "Draw a map from any views",
               "  photoslam render output/desk --orbit --output orbit\n"
               "  photoslam render output/desk --trajectory output/desk/trajectory.tum --output frames\n"
               "  photoslam render map.ply --cameras transforms.json --format npy --output views\n");
  RenderArguments& a = *arguments;
  command.add_option("map", a.map, "map.ply, session.photoslam, or the output folder of a run or of train")->required();
  command.add_option("--cameras", a.cameras, "Cameras to draw from: transforms.json; distortion is left out");
  command.add_option("--trajectory", a.trajectory, "Poses to draw from: TUM lines");
  command.add_option("--camera", a.camera,
                     "Calibration for --trajectory and --orbit, any that run reads; default: that of the run");
  command.add_flag("--orbit", a.orbit, "Around what the run looked at or, where it looked around, along its walk");
  command.add_option("--orbit-frames", a.orbit_frames, "Images of the orbit")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command.add_option("--output", a.output, "Folder for the images")->capture_default_str();
  command.add_option("--format", a.format, "png: 8-bit; npy: float32 [height, width, 3]")
      ->check(CLI::IsMember({"png", "npy"}))
      ->capture_default_str();
  a.backend.bind(command);
  line.on_run(command, [arguments] { return render(*arguments); });
}

}  // namespace photoslam
