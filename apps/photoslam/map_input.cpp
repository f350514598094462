// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map_input.h"

#include "pipeline/session_file.h"
#include "run_folder.h"
#include "sources/camera_file.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

fs::path session_in(const fs::path& folder) { return folder / kSessionFile; }

/// At its end a run writes the session, then map.ply.
bool session_is_newer(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::exists(session_in(folder), ignored)) return false;
  if (!fs::exists(folder / "map.ply", ignored)) return true;
  return fs::last_write_time(session_in(folder), ignored) > fs::last_write_time(folder / "map.ply", ignored);
}

}  // namespace

Result<MapInput> MapInput::open(const fs::path& path) {
  MapInput input(path);
  const bool is_folder = fs::is_directory(path);
  if (is_folder ? session_is_newer(path) : path.extension() == ".photoslam") {
    auto view = view_session(path);
    if (!view) return view.error();
    input.session_ = std::move(*view);
  } else {
    auto map = read_gaussian_ply(is_folder ? path / "map.ply" : path);
    if (!map) return map.error();
    input.map_ = std::move(*map);
  }
  if (input.map().size() == 0) return error("{} holds no gaussians", path.string());
  return input;
}

Result<PinholeCamera> MapInput::camera() const {
  if (session_) return session_->camera;
  if (fs::exists(path_ / "run.json")) {
    const auto description = read_run_description(path_);
    if (!description) return description.error();
    return description->camera;
  }
  if (fs::exists(session_in(path_))) {
    const auto session = read_session(path_);
    if (!session) return session.error();
    return session_header(*session).sensor.camera;
  }
  if (fs::exists(path_ / kMapCameraFile)) {
    const auto file = read_camera_yaml(path_ / kMapCameraFile);
    if (!file) return file.error();
    return file->camera;
  }
  return error(
      "{}: neither the folder of a run or of `train` nor a session: --trajectory and --orbit need --camera camera.yaml",
      path_.string());
}

Result<Trajectory> MapInput::keyframes() const {
  if (session_) return session_->keyframes;
  const bool has_session = fs::exists(session_in(path_));
  const bool of_one_walk = fs::exists(path_ / "run.json") || (!has_session && fs::exists(path_ / kMapCameraFile));
  if (of_one_walk && fs::exists(path_ / "keyframes.tum")) return read_tum_trajectory(path_ / "keyframes.tum");
  if (!has_session) return Trajectory{};
  auto view = view_session(path_);  // of a merge: by time the keyframes of two walks would be mixed
  if (!view) return view.error();
  return std::move(view->keyframes);
}

}  // namespace photoslam
