// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map_input.h"

#include "pipeline/session_file.h"
#include "pipeline/session_view.h"
#include "run_folder.h"

namespace photoslam {
namespace {

namespace fs = std::filesystem;

Result<MapInput> input_from_session(const fs::path& path) {
  auto view = view_session(path);
  if (!view) return view.error();
  return MapInput{std::move(view->map), view->camera, std::move(view->keyframes)};
}

Result<MapInput> read_map_file(const fs::path& path) {
  auto map = read_gaussian_ply(path);
  if (!map) return map.error();
  return MapInput{std::move(*map), std::nullopt, {}};
}

}  // namespace

Result<MapInput> read_map_input(const fs::path& path) {
  if (!fs::is_directory(path)) return path.extension() == ".photoslam" ? input_from_session(path) : read_map_file(path);
  const bool has_session = fs::exists(path / "session.photoslam");
  if (!fs::exists(path / "map.ply") && has_session) return input_from_session(path);
  auto input = read_map_file(path / "map.ply");
  if (!input) return input;
  if (fs::exists(path / "run.json")) {
    const auto description = read_run_description(path);
    if (!description) return description.error();
    input->camera = description->camera;
  } else if (has_session) {
    const auto session = read_session(path);
    if (!session) return session.error();
    input->camera = session_header(*session).sensor.camera;
  }
  if (fs::exists(path / "keyframes.tum")) {
    auto keyframes = read_tum_trajectory(path / "keyframes.tum");
    if (!keyframes) return keyframes.error();
    input->keyframes = std::move(*keyframes);
  }
  return input;
}

}  // namespace photoslam
