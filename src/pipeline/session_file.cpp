// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/session_file.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "base/check.h"
#include "base/checked_file.h"
#include "io/packed_bytes.h"
#include "photorealistic_mapping/image_archive.h"
#include "pipeline/config.h"

namespace photoslam {
namespace {

constexpr FileKind kFormat{.name = "session", .magic = "PHSLSESS", .version = 11, .oldest = 11};

/// Where a value that applies from now on does not reach what the map holds already.
std::string_view what_stays(std::string_view key) {
  if (key.starts_with("features.")) return "; landmarks of the session keep the features they were made with";
  if (key == "photorealistic_mapping.sh_degree") return "; the gaussians of the session keep their degree";
  return "";
}

}  // namespace

void SessionHeader::serialize(Archive& a) {
  PinholeCamera& c = sensor.camera;
  a(c.width, c.height, c.fx, c.fy, c.cx, c.cy, sensor.metres_per_depth_unit, sensor.stereo_baseline_m);
  serialize_image(a, sensor.mask);
  a(bf, configuration, num_settled);
}

Status write_session(const std::filesystem::path& path, const Archive& session) {
  return write_checked_file(path, kFormat, packed(session.bytes()));
}

std::string describe_unsaved_session(const std::filesystem::path& path, const std::string& why) {
  std::error_code ignored;
  const std::string before = std::filesystem::is_regular_file(path, ignored)
                                 ? "is left as it is, and can be continued with --load-map"
                                 : "was never written";
  return fmt::format("the map is not saved as a session: {}; {} {}", why, path.string(), before);
}

Result<std::string> read_session(const std::filesystem::path& path) {
  std::error_code ignored;
  const bool is_folder = std::filesystem::is_directory(path, ignored);
  const std::filesystem::path file = is_folder ? path / kSessionFile : path;
  const Result<std::string> content = read_checked_file(file, kFormat);
  if (!content) return content.error();
  std::optional<std::string> session = unpacked(*content);
  if (!session) return error("{} is damaged: its content cannot be unpacked; use another copy", file.string());
  return std::move(*session);
}

SessionHeader session_header(const std::string& session) {
  SessionHeader header;
  Archive reader(session);
  reader(header);
  return header;
}

std::vector<std::string> describe_changed_options(const SessionHeader& session, SystemOptions options) {
  const auto differences = config_differences(session.configuration, "session", options);
  if (!differences) return {"the configuration of the session cannot be compared: " + differences.error().message};
  std::vector<std::string> lines;
  for (const ConfigDifference& d : *differences) {
    if (d.in_options.empty()) {
      lines.push_back(
          fmt::format("{} = {} in the session: this version has no such value, it is ignored", d.key, d.in_file));
    } else {
      const std::string was = d.in_file.empty() ? "the session says nothing of it" : "the session had " + d.in_file;
      lines.push_back(fmt::format("{} = {} applies, {}{}", d.key, d.in_options, was, what_stays(d.key)));
    }
  }
  return lines;
}

Status check_session_sensor(const SessionHeader& session, const PinholeCamera& camera, double bf) {
  const PinholeCamera& c = session.sensor.camera;
  const auto differs = [](double a, double b) { return std::abs(a - b) > 1e-6 * (1 + std::abs(a)); };
  if (c.width != camera.width || c.height != camera.height || differs(c.fx, camera.fx) || differs(c.fy, camera.fy) ||
      differs(c.cx, camera.cx) || differs(c.cy, camera.cy)) {
    return error(
        "the session was made with a camera of {}x{}, f = {:.2f}, {:.2f}, centre {:.2f}, {:.2f}; this one has {}x{}, "
        "f = {:.2f}, {:.2f}, centre {:.2f}, {:.2f}: use frames of the same camera",
        c.width, c.height, c.fx, c.fy, c.cx, c.cy, camera.width, camera.height, camera.fx, camera.fy, camera.cx,
        camera.cy);
  }
  if ((session.bf > 0) != (bf > 0)) {
    return error("the session was made {} depth, this sensor measures {}: use frames of the same kind of sensor",
                 session.bf > 0 ? "with" : "without", session.bf > 0 ? "none" : "it");
  }
  if (differs(session.bf, bf)) {
    return error(
        "the session measured depth with a baseline of {:.4f} m, this sensor with {:.4f} m: use the same sensor, and "
        "depth.virtual_baseline_m as it was then",
        session.bf / c.fx, bf / c.fx);
  }
  return {};
}

}  // namespace photoslam
