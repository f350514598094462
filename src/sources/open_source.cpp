// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/open_source.h"

#include <array>

#include "base/nearest_name.h"
#include "sources/euroc_source.h"
#include "sources/folder_source.h"
#include "sources/kitti_source.h"
#include "sources/replica_source.h"
#include "sources/tum_source.h"
#include "sources/video/video_source.h"
#include "sources/webcam/webcam_source.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kVideo = "video";  // a file; the other formats are folders

struct Format {
  std::string name;
  bool (*matches)(const fs::path& folder);
  Result<std::unique_ptr<FrameSource>> (*open)(const fs::path& folder, const SourceOptions& options);
};

const std::array<Format, 5>& formats() {
  static const std::array<Format, 5> kFormats = {{
      {"tum", internal::looks_like_tum, internal::open_tum},
      {"euroc", internal::looks_like_euroc, internal::open_euroc},
      {"kitti", internal::looks_like_kitti, internal::open_kitti},
      {"replica", internal::looks_like_replica, internal::open_replica},
      {"images", internal::looks_like_images, internal::open_images},
  }};
  return kFormats;
}

Error unknown_format(const std::string& name) {
  std::vector<std::string> names = source_formats();
  names.emplace_back("auto");
  const std::string nearest = nearest_name(name, names);
  return error("unknown format '{}'{}; there are {}", name,
               nearest.empty() ? "" : fmt::format(" (did you mean '{}'?)", nearest), fmt::join(names, ", "));
}

Status check_folder(const fs::path& path) {
  std::error_code code;
  if (!fs::exists(path, code)) return error("{} does not exist", path.string());
  if (!fs::is_directory(path, code)) return error("{} is a file; a dataset is a folder", path.string());
  const fs::directory_iterator entries(path, code);
  if (code) return error("cannot read the folder {}: {}", path.string(), code.message());
  if (entries == fs::directory_iterator()) return error("the folder {} is empty", path.string());
  return {};
}

Result<std::unique_ptr<FrameSource>> open_any(const fs::path& path, const SourceOptions& options) {
  if (const auto device = internal::camera_device(path.string())) {
    if (options.format == "auto") return internal::open_webcam(*device, options);
    return error("{} is a live camera and has no format: leave out --format {}", path.string(), options.format);
  }
  std::error_code ignored;
  const bool as_video = options.format == kVideo;
  if (fs::is_regular_file(path, ignored) && (as_video || options.format == "auto")) {
    if (path.extension() == ".json") {
      return error("{} is not a video; images whose poses are known are mapped with: photoslam train {}", path.string(),
                   path.string());
    }
    return internal::open_video(path, options);
  }
  if (fs::is_directory(path, ignored) && as_video) return error("{} is a folder; a video is a file", path.string());
  if (const Status status = check_folder(path); !status) return status.error();
  for (const Format& format : formats()) {
    if (options.format == format.name) return format.open(path, options);
  }
  if (options.format != "auto") return unknown_format(options.format);
  for (const Format& format : formats()) {
    if (format.matches(path)) return format.open(path, options);
  }
  return error(
      "cannot tell the format of {}: found neither associations.txt nor rgb.txt (TUM RGB-D), nor mav0/cam0/data.csv "
      "(EuRoC), nor calib.txt with image_0 or image_2 (KITTI), nor results/frame*.jpg (Replica), nor images",
      path.string());
}

}  // namespace

std::vector<std::string> source_formats() {
  std::vector<std::string> names;
  for (const Format& format : formats()) names.push_back(format.name);
  names.emplace_back(kVideo);
  return names;
}

Status check_video_support() { return internal::check_decoder(); }

std::vector<std::string> describe_cameras() {
  std::vector<std::string> findings;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator("/dev", ignored)) {
    const std::string device = entry.path().string();
    if (!is_camera(device)) continue;
    const auto name = internal::V4l2Device::identify(device, internal::system_device_calls());
    findings.push_back(name ? fmt::format("{} ({})", device, *name) : name.error().message);
  }
  std::ranges::sort(findings, internal::natural_less);
  return findings;
}

bool is_camera(const fs::path& path) { return internal::camera_device(path.string()).has_value(); }

Result<std::unique_ptr<FrameSource>> open_source(const fs::path& path, const SourceOptions& options) {
  auto source = open_any(path, options);
  if (source && options.fov_deg > 0 && !(*source)->info().camera_is_guess) {
    return error("{} has a calibration, and --fov {:g} guesses one: leave out --fov, or name another with --camera",
                 path.string(), options.fov_deg);
  }
  return source;
}

}  // namespace photoslam
