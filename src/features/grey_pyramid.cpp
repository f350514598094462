// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/grey_pyramid.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "features/grey_pyramid.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace photoslam::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Weights in 1/128 keep the blend of two pixels within int16.
constexpr int kWeightBits = 7;

/// target[x] = ((128 - weight) a[x] + weight b[x]), in 1/128 of a grey level.
void blend_rows(const uint8_t* a, const uint8_t* b, int weight, int count, int16_t* target) {
  const hn::CappedTag<int16_t, kRowPadding> tag;
  const hn::Rebind<uint8_t, decltype(tag)> bytes;
  const auto weight_a = hn::Set(tag, static_cast<int16_t>((1 << kWeightBits) - weight));
  const auto weight_b = hn::Set(tag, static_cast<int16_t>(weight));
  for (int x = 0; x < count; x += static_cast<int>(hn::Lanes(tag))) {
    const auto va = hn::PromoteTo(tag, hn::LoadU(bytes, a + x));
    const auto vb = hn::PromoteTo(tag, hn::LoadU(bytes, b + x));
    hn::StoreU(hn::Add(hn::Mul(va, weight_a), hn::Mul(vb, weight_b)), tag, target + x);
  }
}

/// target[x] = the blend of row[columns[x]] and row[columns[x] + 1], rounded to a grey level.
void blend_columns(const int16_t* row, const int32_t* columns, const int32_t* weights, int count, uint8_t* target) {
  const hn::CappedTag<int32_t, kRowPadding> tag;
  const hn::Rebind<uint8_t, decltype(tag)> bytes;
  const auto rounding = hn::Set(tag, 1 << (2 * kWeightBits - 1));
  for (int x = 0; x < count; x += static_cast<int>(hn::Lanes(tag))) {
    // One 32-bit load fetches both neighbours. In bytes, hence twice the column.
    const auto offset = hn::ShiftLeft<1>(hn::LoadU(tag, columns + x));
    const auto pair = hn::GatherOffset(tag, reinterpret_cast<const int32_t*>(row), offset);
    const auto weight = hn::LoadU(tag, weights + x);
    const auto low =
        hn::Mul(hn::ShiftRight<16>(hn::ShiftLeft<16>(pair)), hn::ShiftRight<16>(hn::ShiftLeft<16>(weight)));
    const auto high = hn::Mul(hn::ShiftRight<16>(pair), hn::ShiftRight<16>(weight));
    const auto sum = hn::ShiftRight<2 * kWeightBits>(hn::Add(hn::Add(low, high), rounding));
    hn::StoreU(hn::DemoteTo(bytes, sum), bytes, target + x);
  }
}

/// One pass of the Gaussian over seven neighbours v[0]..v[6] (already loaded by `load(k)`), weights in 1/256.
template <class Tag, class Load>
HWY_INLINE auto gaussian7(Tag tag, Load&& load) {
  const auto weighted = [&](auto v, int weight) { return hn::Mul(v, hn::Set(tag, static_cast<uint16_t>(weight))); };
  auto sum = weighted(hn::Add(load(0), load(6)), 18);
  sum = hn::Add(sum, weighted(hn::Add(load(1), load(5)), 33));
  sum = hn::Add(sum, weighted(hn::Add(load(2), load(4)), 49));
  sum = hn::Add(sum, weighted(load(3), 56));
  return hn::ShiftRight<8>(hn::Add(sum, hn::Set(tag, uint16_t{128})));
}

/// target[x] = Gaussian of rows[0..6][x].
void blur_rows(const uint8_t* const* rows, int count, uint8_t* target) {
  const hn::CappedTag<uint16_t, kRowPadding> tag;
  const hn::Rebind<uint8_t, decltype(tag)> bytes;
  for (int x = 0; x < count; x += static_cast<int>(hn::Lanes(tag))) {
    const auto v = gaussian7(tag, [&](int k) { return hn::PromoteTo(tag, hn::LoadU(bytes, rows[k] + x)); });
    hn::StoreU(hn::DemoteTo(bytes, hn::BitCast(hn::RebindToSigned<decltype(tag)>(), v)), bytes, target + x);
  }
}

/// target[x] = Gaussian of source[x - 3 .. x + 3].
void blur_columns(const uint8_t* source, int count, uint8_t* target) {
  const hn::CappedTag<uint16_t, kRowPadding> tag;
  const hn::Rebind<uint8_t, decltype(tag)> bytes;
  for (int x = 0; x < count; x += static_cast<int>(hn::Lanes(tag))) {
    const auto v = gaussian7(tag, [&](int k) { return hn::PromoteTo(tag, hn::LoadU(bytes, source + x + k - 3)); });
    hn::StoreU(hn::DemoteTo(bytes, hn::BitCast(hn::RebindToSigned<decltype(tag)>(), v)), bytes, target + x);
  }
}

}  // namespace photoslam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace photoslam {
namespace {

HWY_EXPORT(blend_rows);
HWY_EXPORT(blend_columns);
HWY_EXPORT(blur_rows);
HWY_EXPORT(blur_columns);

/// Where target coordinate i falls between two source pixels: the first of them and the weight of the second in 1/128.
struct Interpolation {
  int first;
  int weight;
  Interpolation(int i, double factor, int source_size) {
    const double x = (i + 0.5) * factor - 0.5;
    first = std::clamp(static_cast<int>(std::floor(x)), 0, source_size - 2);
    weight = std::clamp(static_cast<int>(std::lround((x - first) * 128)), 0, 128);
  }
};

}  // namespace

void GreyPyramid::build(const ImageU8& grey, int num_levels, double scale_factor) {
  PHOTOSLAM_CHECK(grey.channels() == 1 && num_levels >= 1, "{} channels, {} levels", grey.channels(), num_levels);
  PHOTOSLAM_CHECK(scale_factor > 1 && scale_factor <= 2, "{}", scale_factor);
  levels_.clear();
  scales_.clear();
  const auto padded = [](int width) { return (width + kRowPadding - 1) / kRowPadding * kRowPadding + kRowPadding; };
  const ptrdiff_t stride = padded(grey.width());
  int rows = 0;
  for (int i = 0; i < num_levels; ++i) {
    const int width = i == 0 ? grey.width() : static_cast<int>(levels_.back().width / scale_factor);
    const int height = i == 0 ? grey.height() : static_cast<int>(levels_.back().height / scale_factor);
    if (width < 2 || height < 2) break;
    levels_.push_back({nullptr, width, height, stride});
    scales_.push_back(i == 0 ? 1.0 : scales_.back() * scale_factor);
    rows += height;
  }
  pixels_.resize(static_cast<size_t>(rows) * static_cast<size_t>(stride));
  uint8_t* next = pixels_.data();
  for (auto& level : levels_) {
    level.pixels = next;
    next += level.height * stride;
  }

  if (levels_.empty()) return;
  for (int y = 0; y < grey.height(); ++y) {
    std::memcpy(levels_[0].row(y), grey.row(y), static_cast<size_t>(grey.width()));
  }
  columns_.resize(static_cast<size_t>(stride));
  weights_.resize(static_cast<size_t>(stride));
  blended_.resize(static_cast<size_t>(stride));
  for (size_t i = 1; i < levels_.size(); ++i) {
    const auto& source = levels_[i - 1];
    const auto& target = levels_[i];
    for (int x = 0; x < target.width; ++x) {
      const Interpolation column(x, scale_factor, source.width);
      columns_[static_cast<size_t>(x)] = column.first;
      weights_[static_cast<size_t>(x)] = (column.weight << 16) | (128 - column.weight);
    }
    for (int y = 0; y < target.height; ++y) {
      const Interpolation row(y, scale_factor, source.height);
      HWY_DYNAMIC_DISPATCH(blend_rows)
      (source.row(row.first), source.row(row.first + 1), row.weight, source.width, blended_.data());
      HWY_DYNAMIC_DISPATCH(blend_columns)
      (blended_.data(), columns_.data(), weights_.data(), target.width, target.row(y));
    }
  }
}

void blur(const GreyView& source, const MutableGreyView& target, std::vector<uint8_t>& scratch) {
  constexpr int kRadius = 3;
  scratch.resize(static_cast<size_t>(source.width + 2 * kRadius + kRowPadding));
  uint8_t* row = scratch.data() + kRadius;
  for (int y = 0; y < source.height; ++y) {
    const uint8_t* neighbours[2 * kRadius + 1];
    for (int k = 0; k <= 2 * kRadius; ++k)
      neighbours[k] = source.row(std::clamp(y + k - kRadius, 0, source.height - 1));
    HWY_DYNAMIC_DISPATCH(blur_rows)(neighbours, source.width, row);
    std::fill(row - kRadius, row, row[0]);
    std::fill(row + source.width, row + source.width + kRadius, row[source.width - 1]);
    HWY_DYNAMIC_DISPATCH(blur_columns)(row, source.width, target.row(y));
  }
}

}  // namespace photoslam
#endif  // HWY_ONCE
