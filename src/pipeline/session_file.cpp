// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "pipeline/session_file.h"

#include <cmath>

#include "base/checked_file.h"

namespace photoslam {
namespace {

constexpr FileKind kSessionFile{"session", "PHSLSESS", 1};

}  // namespace

void SessionHeader::serialize(Archive& a) {
  a(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, bf, configuration);
}

Status write_session(const std::filesystem::path& path, const Archive& session) {
  return write_checked_file(path, kSessionFile, session.bytes());
}

Result<std::string> read_session(const std::filesystem::path& path) {
  std::error_code ignored;
  const bool is_folder = std::filesystem::is_directory(path, ignored);
  return read_checked_file(is_folder ? path / "session.photoslam" : path, kSessionFile);
}

SessionHeader session_header(const std::string& session) {
  SessionHeader header;
  Archive reader(session);
  reader(header);
  return header;
}

Status check_session_camera(const SessionHeader& session, const PinholeCamera& camera) {
  const PinholeCamera& c = session.camera;
  const auto differs = [](double a, double b) { return std::abs(a - b) > 1e-6 * (1 + std::abs(a)); };
  if (c.width == camera.width && c.height == camera.height && !differs(c.fx, camera.fx) && !differs(c.fy, camera.fy) &&
      !differs(c.cx, camera.cx) && !differs(c.cy, camera.cy)) {
    return {};
  }
  return error(
      "the session was made with a camera of {}x{}, f = {:.2f}, {:.2f}, centre {:.2f}, {:.2f}; this one has {}x{}, "
      "f = {:.2f}, {:.2f}, centre {:.2f}, {:.2f}: use frames of the same camera",
      c.width, c.height, c.fx, c.fy, c.cx, c.cy, camera.width, camera.height, camera.fx, camera.fy, camera.cx,
      camera.cy);
}

}  // namespace photoslam
