// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/archive.h"
#include "base/result.h"
#include "photorealistic_mapping/photorealistic_mapper.h"
#include "pipeline/system_options.h"

namespace photoslam {

/// Name of the session in the output folder of a run.
inline constexpr const char* kSessionFile = "session.photoslam";

/// What a session says of itself before the map begins.
struct SessionHeader {
  MapperSensor sensor;        ///< Its camera is undistorted or rectified, as everything in the map sees the world.
  double bf = 0;              ///< fx * baseline [px m]; 0: one camera without depth.
  std::string configuration;  ///< TOML, for the record.
  int num_settled = 0;        ///< See LoopCloser: in the keyframes after these, loops are still to be looked for.
  void serialize(Archive& archive);
};

/// The file of a session: header, geometric map, photorealistic map, in one archive, compressed. Written atomically, so
/// that the session before survives a crash at any moment.
Status write_session(const std::filesystem::path& path, const Archive& session);

/// For a user whose session could not be saved: why, and what there is instead.
std::string describe_unsaved_session(const std::filesystem::path& path, const std::string& why);

/// The bytes of a session, checked; its folder may be given instead of the file.
Result<std::string> read_session(const std::filesystem::path& path);

/// What the bytes begin with.
SessionHeader session_header(const std::string& session);

/// Whether frames fit to a session, by their camera and by what a depth is worth (bf as in the header): the error says
/// what differs.
Status check_session_sensor(const SessionHeader& session, const PinholeCamera& camera, double bf);

/// What whoever continues a session with other options should know, one line per value that differs: what it is now,
/// what it was, and what the loaded map keeps of it.
std::vector<std::string> describe_changed_options(const SessionHeader& session, SystemOptions options);

}  // namespace photoslam
