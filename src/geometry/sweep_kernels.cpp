// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry/sweep_kernels.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "geometry/sweep_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace photoslam::internal::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void match_row(const uint32_t* reference, int count, std::span<const float> inverse_depths,
               std::span<const SweepRow> views, int16_t* cost) {
  const hn::CappedTag<float, kPlaneLanes> df;
  const hn::RebindToSigned<decltype(df)> di;
  const hn::RebindToUnsigned<decltype(df)> du;
  const hn::Rebind<int16_t, decltype(di)> d16;
  const auto planes = static_cast<int>(inverse_depths.size());
  const auto border = hn::Set(df, static_cast<float>(kSignatureRadius));
  for (int x = 0; x < count; ++x, cost += planes) {
    const auto own = hn::Set(du, reference[x]);
    for (int k = 0; k < planes; k += static_cast<int>(hn::Lanes(df))) {
      const auto w = hn::LoadU(df, inverse_depths.data() + k);
      auto bits = hn::Zero(di), seen = hn::Zero(di);
      for (const SweepRow& view : views) {
        const auto coordinate = [&](int i) {
          return hn::MulAdd(w, hn::Set(df, view.offset[i]),
                            hn::Set(df, view.start[i] + static_cast<float>(x) * view.step[i]));
        };
        const auto z = coordinate(2);
        const auto inverse = hn::Div(hn::Set(df, 1.0f), z);
        const auto half = hn::Set(df, 0.5f);
        const auto px = hn::MulAdd(coordinate(0), inverse, half), py = hn::MulAdd(coordinate(1), inverse, half);
        const auto right = hn::Set(df, static_cast<float>(view.width - kSignatureRadius));
        const auto bottom = hn::Set(df, static_cast<float>(view.height - kSignatureRadius));
        const auto inside = hn::And(hn::And(hn::Gt(z, hn::Zero(df)), hn::And(hn::Ge(px, border), hn::Ge(py, border))),
                                    hn::And(hn::Lt(px, right), hn::Lt(py, bottom)));
        const auto ix = hn::ConvertTo(di, hn::IfThenElseZero(inside, px));
        const auto iy = hn::ConvertTo(di, hn::IfThenElseZero(inside, py));
        const auto at = hn::Add(hn::Mul(iy, hn::Set(di, view.width)), ix);
        const auto other = hn::GatherIndex(du, view.signatures, at);
        const auto differing = hn::BitCast(di, hn::PopulationCount(hn::Xor(own, other)));
        const auto counts = hn::RebindMask(di, inside);
        bits = hn::Add(bits, hn::IfThenElseZero(counts, differing));
        seen = hn::Add(seen, hn::IfThenElseZero(counts, hn::Set(di, 1)));
      }
      const auto scale = hn::Set(df, static_cast<float>(kCostScale));
      const auto mean = hn::Div(hn::Mul(scale, hn::ConvertTo(df, bits)), hn::ConvertTo(df, seen));
      const auto unknown = hn::Set(df, 0.5f * kCostScale * kSignatureBits);
      const auto is_seen = hn::RebindMask(df, hn::Gt(seen, hn::Zero(di)));
      const auto result = hn::ConvertTo(di, hn::IfThenElse(is_seen, mean, unknown));
      hn::StoreU(hn::DemoteTo(d16, result), d16, cost + k);
    }
  }
}

int16_t follow_path(int planes, const int16_t* cost, const int16_t* previous, int16_t least, int16_t small_penalty,
                    int16_t large_penalty, int16_t* path, int16_t* total) {
  const hn::CappedTag<int16_t, kPlaneLanes> d;
  const auto jump = hn::Set(d, static_cast<int16_t>(least + large_penalty));
  const auto small = hn::Set(d, small_penalty);
  const auto base = hn::Set(d, least);
  auto minimum = hn::Set(d, hwy::HighestValue<int16_t>());
  for (int k = 0; k < planes; k += static_cast<int>(hn::Lanes(d))) {
    const auto beside = hn::Add(hn::Min(hn::LoadU(d, previous + k - 1), hn::LoadU(d, previous + k + 1)), small);
    const auto best = hn::Min(hn::Min(hn::LoadU(d, previous + k), beside), jump);
    const auto here = hn::Add(hn::LoadU(d, cost + k), hn::Sub(best, base));
    hn::StoreU(here, d, path + k);
    hn::StoreU(hn::Add(hn::LoadU(d, total + k), here), d, total + k);
    minimum = hn::Min(minimum, here);
  }
  int16_t lanes[kPlaneLanes];
  hn::StoreU(minimum, d, lanes);
  return *std::min_element(lanes, lanes + hn::Lanes(d));
}

BestPlane find_best_plane(int planes, const int16_t* total, int16_t margin) {
  const hn::CappedTag<int16_t, kPlaneLanes> d;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  auto minimum = hn::LoadU(d, total);
  for (int k = lanes; k < planes; k += lanes) minimum = hn::Min(minimum, hn::LoadU(d, total + k));
  int16_t least[kPlaneLanes];
  hn::StoreU(minimum, d, least);
  BestPlane best;
  const int16_t value = *std::min_element(least, least + lanes);
  while (total[best.plane] != value) ++best.plane;
  const auto limit = hn::SaturatedAdd(hn::Set(d, value), hn::Set(d, margin));
  const auto two = hn::Set(d, int16_t{2});
  for (int k = 0; k < planes && !best.ambiguous; k += lanes) {
    const auto away = hn::Abs(hn::Iota(d, k - best.plane));
    best.ambiguous = !hn::AllFalse(d, hn::And(hn::Gt(away, two), hn::Lt(hn::LoadU(d, total + k), limit)));
  }
  return best;
}

}  // namespace photoslam::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace photoslam::internal {

HWY_EXPORT(match_row);
HWY_EXPORT(follow_path);
HWY_EXPORT(find_best_plane);

void match_row(const uint32_t* reference, int count, std::span<const float> inverse_depths,
               std::span<const SweepRow> views, int16_t* cost) {
  HWY_DYNAMIC_DISPATCH(match_row)(reference, count, inverse_depths, views, cost);
}

int16_t follow_path(int planes, const int16_t* cost, const int16_t* previous, int16_t least, int16_t small_penalty,
                    int16_t large_penalty, int16_t* path, int16_t* total) {
  return HWY_DYNAMIC_DISPATCH(follow_path)(planes, cost, previous, least, small_penalty, large_penalty, path, total);
}

BestPlane find_best_plane(int planes, const int16_t* total, int16_t margin) {
  return HWY_DYNAMIC_DISPATCH(find_best_plane)(planes, total, margin);
}

}  // namespace photoslam::internal
#endif  // HWY_ONCE
