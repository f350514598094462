// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "sources/synthetic/sequence_writer.h"

namespace photoslam::synthetic {

/// Names, units and files of one layout of sequences.
class LayoutWriter {
 public:
  virtual ~LayoutWriter() = default;
  virtual double metres_per_depth_unit() const { return SyntheticCamera::kMetresPerDepthUnit; }
  /// Makes the folders.
  virtual Status prepare() const = 0;
  /// Safe to call from several threads.
  virtual Status write_frame(const Frame& frame) const = 0;
  /// Lists, calibration and true poses.
  virtual Status write_description() const = 0;
};

/// The camera must outlive the writer.
std::unique_ptr<const LayoutWriter> make_layout(const SyntheticCamera& camera, const SequenceSettings& settings,
                                                const std::filesystem::path& folder);

}  // namespace photoslam::synthetic
