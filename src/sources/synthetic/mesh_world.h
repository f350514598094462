// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "base/executor.h"
#include "base/result.h"
#include "sources/synthetic/world.h"

namespace photoslam {

/// A user's mesh (PLY or OBJ, see read_mesh) as a world. Its colours are light as it is, without shadows or
/// highlights of ours: scans carry theirs. The camera's tone curve applies. Where there is no surface the picture is
/// black and has no depth. The walk is that of a TUM trajectory in the mesh's frame (metres; camera axes x right, y
/// down, z forward), at the times of its poses.
///
/// Errors name the file: no mesh, no colours, an image that cannot be read, no poses.
struct MeshWorld {
  std::shared_ptr<const SyntheticWorld> world;
  double seconds = 0;  ///< Length of the walk.
};
Result<MeshWorld> open_mesh_world(const std::filesystem::path& mesh, const std::filesystem::path& trajectory,
                                  Executor& executor);

}  // namespace photoslam
