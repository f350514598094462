// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/open_source.h"

#include <array>

#include "base/nearest_name.h"
#include "sources/replica_source.h"
#include "sources/tum_source.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

struct Format {
  std::string name;
  bool (*matches)(const fs::path& folder);
  Result<std::unique_ptr<FrameSource>> (*open)(const fs::path& folder, const fs::path& camera_file);
};

const std::array<Format, 2>& formats() {
  static const std::array<Format, 2> kFormats = {{
      {"tum", internal::looks_like_tum, internal::open_tum},
      {"replica", internal::looks_like_replica, internal::open_replica},
  }};
  return kFormats;
}

Error unknown_format(const std::string& name) {
  const std::array<std::string, 3> names = {"auto", "tum", "replica"};
  const std::string nearest = nearest_name(name, names);
  return error("unknown format '{}'{}; there are auto, tum and replica", name,
               nearest.empty() ? "" : fmt::format(" (did you mean '{}'?)", nearest));
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

}  // namespace

Result<std::unique_ptr<FrameSource>> open_source(const fs::path& path, const SourceOptions& options) {
  if (const Status status = check_folder(path); !status) return status.error();
  for (const Format& format : formats()) {
    if (options.format == format.name) return format.open(path, options.camera);
  }
  if (options.format != "auto") return unknown_format(options.format);
  for (const Format& format : formats()) {
    if (format.matches(path)) return format.open(path, options.camera);
  }
  return error(
      "cannot tell the format of {}: found neither associations.txt, nor rgb.txt with depth.txt (TUM RGB-D), nor "
      "results/frame*.jpg (Replica)",
      path.string());
}

}  // namespace photoslam
