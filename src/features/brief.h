// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "features/grey_view.h"
#include "features/orb.h"

namespace photoslam {

/// Radius of the disc of pixels that orientation and descriptor look at; a keypoint must be further than this from the
/// border of its image.
inline constexpr int kPatchRadius = 15;

/// One bit of a descriptor: whether the patch is darker at (ax, ay) than at (bx, by), relative to the keypoint and
/// turned with it.
struct BriefTest {
  int8_t ax, ay, bx, by;
  bool operator==(const BriefTest&) const = default;
};
using BriefPattern = std::array<BriefTest, 256>;

/// The 256 tests, the same on every machine (descriptors are stored in maps). They are drawn from a seeded generator
/// and chosen greedily so that, for images whose grey levels differ by a variance proportional to distance (a common
/// model of natural images), the bits are nearly uncorrelated with each other and with what all corners have in common.
BriefPattern make_brief_pattern();

/// Direction [rad] in [0, 2π), x towards y, from the pixel to the intensity centroid of the disc around it (Rosin
/// 1999).
float intensity_centroid_angle(const GreyView& image, int x, int y);

/// Computes rotated BRIEF descriptors (Calonder 2010, Rublee 2011) on blurred images.
class BriefDescriber {
 public:
  BriefDescriber();
  /// `image` should be blurred: single pixels are noise.
  Descriptor describe(const GreyView& image, int x, int y, float angle);

 private:
  static constexpr int kAngleBins = 256;
  void set_stride(ptrdiff_t stride);

  BriefPattern pattern_;
  ptrdiff_t stride_ = 0;
  std::vector<int32_t> offsets_;  // [bins, 256, 2] from the keypoint, for images of this stride
};

}  // namespace photoslam
