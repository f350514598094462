// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/brief.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/random.h"

namespace photoslam {
namespace {

constexpr int kSide = 2 * kPatchRadius + 1;

bool in_disc(int x, int y) { return x * x + y * y <= kPatchRadius * kPatchRadius; }

/// What corners have in common once they are turned upright: grey levels rise along x, near the keypoint as well as
/// over the whole disc, the middle differs from its surroundings, and the two axes differ. A test that answers to one
/// of these says little about which corner it is. The values are weights of the pixel at (x, y).
constexpr int kNumCommonTraits = 4;
double common_trait(int trait, int x, int y) {
  const int squared = x * x + y * y;
  switch (trait) {
    case 0:
      return x;
    case 1:
      return squared <= 64 ? x : 0;
    case 2:
      return squared <= 25 ? 1 : 0;
    default:
      return x * x - y * y;
  }
}

/// Second-order statistics of a patch of a natural image: E (I(p) − I(q))² = D(p − q) grows like the distance beyond
/// the width of the blur.
class PatchModel {
 public:
  PatchModel() {
    for (int y = 0; y < kTableSide; ++y) {
      for (int x = 0; x < kTableSide; ++x) structure_[y][x] = std::sqrt(x * x + y * y + kBlur * kBlur) - kBlur;
    }
    for (int y = -kPatchRadius; y <= kPatchRadius; ++y) {
      for (int x = -kPatchRadius; x <= kPatchRadius; ++x) {
        if (in_disc(x, y)) disc_.push_back({x, y});
      }
    }
    for (int i = 0; i < kNumCommonTraits; ++i) traits_[i] = make_trait(i);
  }

  /// Correlation of I(a1) − I(b1) with I(a2) − I(b2).
  double correlation(const BriefTest& s, const BriefTest& t) const {
    const double covariance = 0.5 * (structure(s.ax - t.bx, s.ay - t.by) + structure(s.bx - t.ax, s.by - t.ay) -
                                     structure(s.ax - t.ax, s.ay - t.ay) - structure(s.bx - t.bx, s.by - t.by));
    return covariance / std::sqrt(variance(s) * variance(t));
  }

  /// Largest absolute correlation of I(a) − I(b) with a common trait.
  double correlation_with_traits(const BriefTest& t) const {
    double largest = 0;
    for (const Trait& trait : traits_) {
      const double covariance = trait.covariance[t.ay + kPatchRadius][t.ax + kPatchRadius] -
                                trait.covariance[t.by + kPatchRadius][t.bx + kPatchRadius];
      largest = std::max(largest, std::abs(covariance) / std::sqrt(variance(t) * trait.variance));
    }
    return largest;
  }

 private:
  static constexpr int kTableSide = 2 * kSide;
  static constexpr double kBlur = 2.0;
  struct Pixel {
    int x, y;
  };
  struct Trait {
    double covariance[kSide][kSide] = {};  // With the grey level at a pixel, up to a constant.
    double variance = 0;
  };

  Trait make_trait(int index) const {
    double mean = 0;
    for (const Pixel& p : disc_) mean += common_trait(index, p.x, p.y) / static_cast<double>(disc_.size());
    Trait trait;
    for (const Pixel& p : disc_) {
      double sum = 0;
      for (const Pixel& q : disc_)
        sum -= 0.5 * (common_trait(index, q.x, q.y) - mean) * structure(p.x - q.x, p.y - q.y);
      trait.covariance[p.y + kPatchRadius][p.x + kPatchRadius] = sum;
      trait.variance += (common_trait(index, p.x, p.y) - mean) * sum;
    }
    return trait;
  }
  double structure(int dx, int dy) const { return structure_[std::abs(dy)][std::abs(dx)]; }
  double variance(const BriefTest& t) const { return structure(t.ax - t.bx, t.ay - t.by); }

  double structure_[kTableSide][kTableSide];
  std::vector<Pixel> disc_;
  Trait traits_[kNumCommonTraits];
};

/// A random test: both ends roughly normal around the keypoint, inside the disc, a few pixels apart.
BriefTest random_test(Random& random) {
  // The sum of two uniform integers; unlike a normal deviate it needs no function that differs between platforms.
  const auto coordinate = [&random] { return random.index(16) + random.index(16) - 15; };
  while (true) {
    const int ax = coordinate(), ay = coordinate(), bx = coordinate(), by = coordinate();
    const int dx = ax - bx, dy = ay - by;
    if (in_disc(ax, ay) && in_disc(bx, by) && dx * dx + dy * dy >= 4) {
      return {static_cast<int8_t>(ax), static_cast<int8_t>(ay), static_cast<int8_t>(bx), static_cast<int8_t>(by)};
    }
  }
}

}  // namespace

BriefPattern make_brief_pattern() {
  constexpr size_t kCandidates = 4000;
  constexpr double kMaxTraitCorrelation = 0.3;
  const PatchModel model;
  Random random(256);
  std::vector<BriefTest> candidates;
  while (candidates.size() < kCandidates) {
    const BriefTest test = random_test(random);
    if (model.correlation_with_traits(test) <= kMaxTraitCorrelation) candidates.push_back(test);
  }
  BriefPattern pattern;
  size_t count = 0;
  for (double limit = 0.2; count < pattern.size(); limit += 0.05) {
    std::vector<BriefTest> rest;
    for (const BriefTest& test : candidates) {
      bool fits = count < pattern.size();
      for (size_t i = 0; i < count && fits; ++i) fits = std::abs(model.correlation(test, pattern[i])) <= limit;
      if (fits) {
        pattern[count++] = test;
      } else {
        rest.push_back(test);
      }
    }
    candidates.swap(rest);
  }
  return pattern;
}

BriefDescriber::BriefDescriber() : pattern_(make_brief_pattern()) {}

void BriefDescriber::set_stride(ptrdiff_t stride) {
  stride_ = stride;
  offsets_.resize(static_cast<size_t>(kAngleBins) * pattern_.size() * 2);
  int32_t* offset = offsets_.data();
  for (int bin = 0; bin < kAngleBins; ++bin) {
    const double angle = 2 * std::numbers::pi * bin / kAngleBins;
    const double c = std::cos(angle), s = std::sin(angle);
    const auto rotated = [&](int x, int y) {
      return static_cast<int32_t>(std::lround(s * x + c * y) * stride + std::lround(c * x - s * y));
    };
    for (const BriefTest& test : pattern_) {
      *offset++ = rotated(test.ax, test.ay);
      *offset++ = rotated(test.bx, test.by);
    }
  }
}

Descriptor BriefDescriber::describe(const GreyView& image, int x, int y, float angle) {
  if (image.stride != stride_) set_stride(image.stride);
  constexpr float kBinsPerRadian = static_cast<float>(kAngleBins / (2 * std::numbers::pi));
  const int bin = static_cast<int>(std::lround(angle * kBinsPerRadian)) % kAngleBins;
  const int32_t* offset = offsets_.data() + static_cast<size_t>(bin) * pattern_.size() * 2;
  const uint8_t* center = image.at(x, y);
  Descriptor descriptor{};
  for (uint64_t& word : descriptor) {
    for (int bit = 0; bit < 64; ++bit, offset += 2) {
      word |= static_cast<uint64_t>(center[offset[0]] < center[offset[1]]) << bit;
    }
  }
  return descriptor;
}

}  // namespace photoslam
