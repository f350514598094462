// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/brief.h"

#include <cmath>
#include <numbers>

#include "base/random.h"

namespace photoslam {
namespace {

constexpr int kSide = 2 * kPatchRadius + 1;

bool in_disc(int x, int y) { return x * x + y * y <= kPatchRadius * kPatchRadius; }

/// Second-order statistics of a patch of a natural image: E (I(p) − I(q))² = D(p − q) grows like the distance beyond
/// the width of the blur.
class PatchModel {
 public:
  PatchModel() {
    for (int y = 0; y < kTableSide; ++y) {
      for (int x = 0; x < kTableSide; ++x) structure_[y][x] = std::sqrt(x * x + y * y + kBlur * kBlur) - kBlur;
    }
    for (int py = -kPatchRadius; py <= kPatchRadius; ++py) {
      for (int px = -kPatchRadius; px <= kPatchRadius; ++px) {
        if (!in_disc(px, py)) continue;
        moment_covariance_[py + kPatchRadius][px + kPatchRadius] = covariance_with_moment(px, py);
        moment_variance_ += px * moment_covariance_[py + kPatchRadius][px + kPatchRadius];
      }
    }
  }

  /// Correlation of I(a1) − I(b1) with I(a2) − I(b2).
  double correlation(const BriefTest& s, const BriefTest& t) const {
    const double covariance = 0.5 * (structure(s.ax - t.bx, s.ay - t.by) + structure(s.bx - t.ax, s.by - t.ay) -
                                     structure(s.ax - t.ax, s.ay - t.ay) - structure(s.bx - t.bx, s.by - t.by));
    return covariance / std::sqrt(variance(s) * variance(t));
  }

  /// Correlation of I(a) − I(b) with the first moment along x, which orientation makes positive.
  double correlation_with_orientation(const BriefTest& t) const {
    const double covariance = moment_covariance_[t.ay + kPatchRadius][t.ax + kPatchRadius] -
                              moment_covariance_[t.by + kPatchRadius][t.bx + kPatchRadius];
    return covariance / std::sqrt(variance(t) * moment_variance_);
  }

 private:
  static constexpr int kTableSide = 2 * kSide;
  static constexpr double kBlur = 2.0;

  double structure(int dx, int dy) const { return structure_[std::abs(dy)][std::abs(dx)]; }
  double variance(const BriefTest& t) const { return structure(t.ax - t.bx, t.ay - t.by); }
  double covariance_with_moment(int px, int py) const {
    double sum = 0;
    for (int y = -kPatchRadius; y <= kPatchRadius; ++y) {
      for (int x = -kPatchRadius; x <= kPatchRadius; ++x) {
        if (in_disc(x, y)) sum -= 0.5 * x * structure(px - x, py - y);
      }
    }
    return sum;
  }

  double structure_[kTableSide][kTableSide];
  double moment_covariance_[kSide][kSide] = {};
  double moment_variance_ = 0;
};

/// A random test: both ends roughly normal around the keypoint, inside the disc, a few pixels apart.
BriefTest random_test(Random& random) {
  // The sum of three uniform integers; unlike a normal deviate it needs no function that differs between platforms.
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
  constexpr double kMaxOrientationCorrelation = 0.3;
  const PatchModel model;
  Random random(256);
  std::vector<BriefTest> candidates;
  while (candidates.size() < kCandidates) {
    const BriefTest test = random_test(random);
    if (std::abs(model.correlation_with_orientation(test)) <= kMaxOrientationCorrelation) candidates.push_back(test);
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
