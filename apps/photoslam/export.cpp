// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>

#include "base/file.h"
#include "commands.h"
#include "io/gaussian_spz.h"
#include "io/image_file.h"
#include "map_input.h"
#include "run_images.h"
#include "sources/posed_cameras.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

struct ExportArguments {
  fs::path input;
  std::string to;
  fs::path output;
};

/// Writes the rectified pictures of the run's keyframes into `images` and says where they were taken.
Result<std::vector<PosedCamera>> write_keyframe_images(const fs::path& run, const fs::path& images) {
  if (Status status = prepare_output_folder(images); !status) return status.error();
  std::vector<PosedCamera> cameras;
  const Status status = for_each_keyframe_image(run, [&](KeyframeImage keyframe) {
    keyframe.camera.image = images / fmt::format("{:06}.png", keyframe.frame.value);
    cameras.push_back(keyframe.camera);
    return write_png(keyframe.camera.image, keyframe.image);
  });
  if (!status) return status.error();
  return cameras;
}

Status export_cameras(const ExportArguments& arguments, const GaussianTable& map) {
  if (!fs::is_directory(arguments.input)) {
    return error("{}: --to {} needs the output folder of a run, where the images of its keyframes can be found",
                 arguments.input.string(), arguments.to);
  }
  const auto cameras = write_keyframe_images(arguments.input, arguments.output / "images");
  if (!cameras) return cameras.error();
  if (arguments.to == "transforms") {
    if (Status status = write_transforms_json(arguments.output / "transforms.json", *cameras); !status) return status;
  } else {
    const fs::path model = arguments.output / "sparse" / "0";
    if (Status status = prepare_output_folder(model); !status) return status;
    if (Status status = write_colmap_model(model, *cameras, sparse_points(map)); !status) return status;
  }
  fmt::print("{} keyframes with their images in {}\n", cameras->size(), arguments.output.string());
  return {};
}

Status export_map(const ExportArguments& arguments) {
  const auto input = MapInput::open(arguments.input);
  if (!input) return input.error();
  const GaussianTable& map = input->map();
  if (arguments.to == "transforms" || arguments.to == "colmap") return export_cameras(arguments, map);
  if (Status status = prepare_output_folder(fs::absolute(arguments.output).parent_path()); !status) return status;
  const auto report = arguments.to == "spz"     ? write_gaussian_spz(arguments.output, map)
                      : arguments.to == "splat" ? write_gaussian_splat(arguments.output, map)
                                                : write_gaussian_ply(arguments.output, map);
  if (!report) return report.error();
  std::error_code ignored;
  fmt::print("{} gaussians, {:.2f} MB: {}\n", report->written,
             1e-6 * static_cast<double>(fs::file_size(arguments.output, ignored)), arguments.output.string());
  if (report->left_out > 0) fmt::print("{} left out: not finite or out of the format's range\n", report->left_out);
  return {};
}

}  // namespace

void add_export(CommandLine& line) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App& command = line.add("export", "Write a map, or its cameras, for other programs",
                               "  photoslam export output/desk --to spz --output desk.spz\n"
                               "  photoslam export output/desk --to transforms --output desk-nerfstudio\n"
                               "  photoslam export map.ply --to splat --output map.splat\n");
  ExportArguments& a = *arguments;
  command.add_option("map", a.input, "The output folder of a run, a map.ply or a session.photoslam")->required();
  command
      .add_option("--to", a.to,
                  "ply, spz, splat: the gaussians in one file; transforms, colmap: a folder with the keyframes' images "
                  "and poses for other trainers")
      ->required()
      ->check(CLI::IsMember({"ply", "spz", "splat", "transforms", "colmap"}));
  command.add_option("--output", a.output, "File, or folder for transforms and colmap")->required();
  line.on_run(command, [arguments] { return export_map(*arguments); });
}

}  // namespace photoslam
