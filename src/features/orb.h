// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/options.h"
#include "image/image.h"

namespace photoslam {

class GreyPyramid;

/// A 256-bit binary descriptor.
using Descriptor = std::array<uint64_t, 4>;

/// Number of differing bits, in [0, 256].
///
/// Counts bits in ever wider fields: five times as fast as four library calls, which is what std::popcount becomes
/// where the compiler must not assume a population count instruction.
inline int hamming_distance(const Descriptor& a, const Descriptor& b) {
  constexpr uint64_t kPairs = 0x5555555555555555, kNibbles = 0x3333333333333333, kBytes = 0x0F0F0F0F0F0F0F0F,
                     kWords = 0x00FF00FF00FF00FF, kSumOfWords = 0x0001000100010001;
  uint64_t bytes = 0;  // At most 4 * 8 each.
  for (size_t i = 0; i < a.size(); ++i) {
    uint64_t x = a[i] ^ b[i];
    x -= (x >> 1) & kPairs;
    x = (x & kNibbles) + ((x >> 2) & kNibbles);
    bytes += (x + (x >> 4)) & kBytes;
  }
  return static_cast<int>((((bytes & kWords) + ((bytes >> 8) & kWords)) * kSumOfWords) >> 48);
}

/// An oriented corner, in pixels of the full image.
struct Keypoint {
  float x = 0, y = 0;
  float angle = 0;     ///< Orientation [rad] in [0, 2π), x towards y.
  float response = 0;  ///< Corner strength; comparable within one octave.
  int octave = 0;      ///< Pyramid level; its scale is OrbOptions::scale_factor ^ octave.
};

/// Keypoints and their descriptors, index by index.
struct Features {
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;
  size_t size() const { return keypoints.size(); }
};

struct OrbOptions {
  int num_features = 1250;
  int num_levels = 8;
  double scale_factor = 1.2;
  int fast_threshold = 20;  ///< Grey levels; cells without a corner retry with min_fast_threshold.
  int min_fast_threshold = 7;
  void visit(OptionVisitor& visitor);
};

/// Extracts ORB features: FAST corners on a pyramid, spread evenly, oriented by the intensity centroid, described by
/// rotated BRIEF. Keypoint positions are refined to sub-pixel accuracy. Keeps its buffers between calls; deterministic.
class OrbExtractor {
 public:
  explicit OrbExtractor(const OrbOptions& options);
  ~OrbExtractor();
  OrbExtractor(OrbExtractor&&) noexcept;
  OrbExtractor& operator=(OrbExtractor&&) noexcept;

  /// `grey` has one channel. Images smaller than 64 pixels on a side give no features.
  void extract(const ImageU8& grey, Features& features);

  /// The levels on which the features of the last image were found.
  const GreyPyramid& pyramid() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace photoslam
