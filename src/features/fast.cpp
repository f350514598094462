// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/fast.h"

#include <algorithm>
#include <array>
#include <bit>
#include <memory>

#include "base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "features/fast.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace photoslam::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<uint8_t, kRowPadding>;
using Vec = hn::Vec<Tag>;

/// Largest s such that nine neighbouring values of the ring are all at least s.
HWY_INLINE Vec best_arc(const Vec (&ring)[16]) {
  // The run of eight from odd k on is part of two arcs of nine, which differ in the value before and the value after
  // it.
  Vec pair[8], four[8];
  for (int i = 0; i < 8; ++i) pair[i] = hn::Min(ring[2 * i + 1], ring[(2 * i + 2) % 16]);
  for (int i = 0; i < 8; ++i) four[i] = hn::Min(pair[i], pair[(i + 1) % 8]);
  Vec best = hn::Zero(Tag());
  for (int i = 0; i < 8; ++i) {
    const Vec eight = hn::Min(four[i], four[(i + 2) % 8]);
    best = hn::Max(best, hn::Min(eight, hn::Max(ring[2 * i], ring[(2 * i + 9) % 16])));
  }
  return best;
}

/// An upper bound of the score from the ring values 0, 4, 8 and 12: every arc of nine holds two neighbours of them.
HWY_INLINE Vec bound(Vec v0, Vec v4, Vec v8, Vec v12) { return hn::Min(hn::Max(v0, v8), hn::Max(v4, v12)); }

void fast_score_row(const uint8_t* center, const ptrdiff_t* ring_offsets, int count, int threshold, uint8_t* scores) {
  const Tag tag;
  const Vec limit = hn::Set(tag, static_cast<uint8_t>(threshold));
  const int lanes = static_cast<int>(hn::Lanes(tag));
  for (int x = 0; x < count; x += lanes) {
    const Vec c = hn::LoadU(tag, center + x);
    const Vec p0 = hn::LoadU(tag, center + x + ring_offsets[0]), p4 = hn::LoadU(tag, center + x + ring_offsets[4]);
    const Vec p8 = hn::LoadU(tag, center + x + ring_offsets[8]), p12 = hn::LoadU(tag, center + x + ring_offsets[12]);
    const Vec brighter = hn::SaturatedSub(bound(p0, p4, p8, p12), c);
    // The same bound for darker arcs, with minimum and maximum exchanged.
    const Vec darker = hn::SaturatedSub(c, hn::Max(hn::Min(p0, p8), hn::Min(p4, p12)));
    Vec score = hn::Zero(tag);
    if (!hn::AllFalse(tag, hn::Gt(hn::Max(brighter, darker), limit))) {
      Vec ring[16], difference[16];
      for (int i = 0; i < 16; ++i) ring[i] = hn::LoadU(tag, center + x + ring_offsets[i]);
      for (int i = 0; i < 16; ++i) difference[i] = hn::SaturatedSub(ring[i], c);
      score = best_arc(difference);
      for (int i = 0; i < 16; ++i) difference[i] = hn::SaturatedSub(c, ring[i]);
      score = hn::Max(score, best_arc(difference));
      score = hn::IfThenElseZero(hn::Gt(score, limit), score);
    }
    hn::StoreU(score, tag, scores + x);
  }
}

/// Sets bit i of `maxima` [ceil(count / 64)] where score i of the middle row is positive and a local maximum.
void find_maxima(const uint8_t* above, const uint8_t* middle, const uint8_t* below, int count, uint64_t* maxima) {
  const Tag tag;
  const int lanes = static_cast<int>(hn::Lanes(tag));
  std::fill(maxima, maxima + (count + 63) / 64, 0);
  for (int x = 0; x < count; x += lanes) {
    const Vec score = hn::LoadU(tag, middle + x);
    if (hn::AllTrue(tag, hn::Eq(score, hn::Zero(tag)))) continue;
    const Vec before = hn::Max(hn::Max(hn::LoadU(tag, above + x - 1), hn::LoadU(tag, above + x)),
                               hn::Max(hn::LoadU(tag, above + x + 1), hn::LoadU(tag, middle + x - 1)));
    const Vec after = hn::Max(hn::Max(hn::LoadU(tag, below + x - 1), hn::LoadU(tag, below + x)),
                              hn::Max(hn::LoadU(tag, below + x + 1), hn::LoadU(tag, middle + x + 1)));
    uint8_t bits[64 / 8] = {};
    hn::StoreMaskBits(tag, hn::And(hn::Gt(score, before), hn::Eq(hn::Max(score, after), score)), bits);
    uint64_t word = 0;
    for (int i = 0; i < (lanes + 7) / 8; ++i) word |= static_cast<uint64_t>(bits[i]) << (8 * i);
    maxima[x / 64] |= word << (x % 64);
  }
}

}  // namespace photoslam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace photoslam {
namespace {

HWY_EXPORT(fast_score_row);
HWY_EXPORT(find_maxima);

/// Offsets of the sixteen pixels on the circle of radius 3, in order around it.
std::array<ptrdiff_t, 16> ring_offsets(ptrdiff_t stride) {
  constexpr int kX[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
  std::array<ptrdiff_t, 16> offsets;
  for (size_t i = 0; i < 16; ++i) offsets[i] = kX[i] - stride * kX[(i + 4) % 16];
  return offsets;
}

}  // namespace

void fast_score_row(const GreyView& image, int y, int left, int right, int threshold, uint8_t* scores) {
  PHOTOSLAM_CHECK(left >= 3 && right <= image.width - 3 && y >= 3 && y < image.height - 3, "[{}, {}) of row {}", left,
                  right, y);
  const auto offsets = ring_offsets(image.stride);
  HWY_DYNAMIC_DISPATCH(fast_score_row)(image.at(left, y), offsets.data(), right - left, threshold, scores);
}

void detect_fast(const GreyView& image, int border, int threshold, std::vector<uint8_t>& scratch,
                 std::vector<Corner>& corners) {
  PHOTOSLAM_CHECK(border >= 4 && threshold >= 0 && threshold < 255, "border {}, threshold {}", border, threshold);
  const int count = image.width - 2 * border;
  if (count <= 0 || image.height <= 2 * border) return;

  // Three rows of scores with one neighbour on each side, and one row of bits.
  const size_t row_size = static_cast<size_t>(count + 2 + kRowPadding);
  const size_t words = static_cast<size_t>(count + 63) / 64 + 1;
  scratch.assign(3 * row_size + (words + 1) * sizeof(uint64_t), 0);
  uint8_t* rows[3] = {scratch.data(), scratch.data() + row_size, scratch.data() + 2 * row_size};
  void* aligned = scratch.data() + 3 * row_size;
  size_t space = (words + 1) * sizeof(uint64_t);
  auto* maxima = static_cast<uint64_t*>(std::align(alignof(uint64_t), words * sizeof(uint64_t), aligned, space));

  const auto score_row = [&](int y, uint8_t* scores) {
    fast_score_row(image, y, border - 1, image.width - border + 1, threshold, scores);
  };
  score_row(border - 1, rows[0]);
  score_row(border, rows[1]);
  for (int y = border; y < image.height - border; ++y) {
    score_row(y + 1, rows[2]);
    HWY_DYNAMIC_DISPATCH(find_maxima)(rows[0] + 1, rows[1] + 1, rows[2] + 1, count, maxima);
    for (int word = 0; word * 64 < count; ++word) {
      for (uint64_t bits = maxima[word]; bits != 0; bits &= bits - 1) {
        const int x = word * 64 + std::countr_zero(bits);
        if (x >= count) break;  // A kernel works on whole vectors.
        corners.push_back({static_cast<int16_t>(border + x), static_cast<int16_t>(y), rows[1][x + 1]});
      }
    }
    std::rotate(rows, rows + 1, rows + 3);
  }
}

}  // namespace photoslam
#endif  // HWY_ONCE
