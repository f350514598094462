// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// Included once per SIMD target, inside the target's pass of Highway's foreach_target.
#if defined(PHOTOSLAM_SPLATTING_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PHOTOSLAM_SPLATTING_LANES_INL_H
#undef PHOTOSLAM_SPLATTING_LANES_INL_H
#else
#define PHOTOSLAM_SPLATTING_LANES_INL_H
#endif

#include <cstddef>

#include "hwy/contrib/math/math-inl.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace photoslam::splatting::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// At most 16 lanes: a vector is one 4x4 pixel block or a part of it, or a part of a block of gaussians.
using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using Vec = hn::Vec<Floats>;
using Mask = hn::Mask<Floats>;
inline constexpr Floats kFloats;
inline constexpr size_t kLanes = hn::MaxLanes(Floats());

/// A comparison of lanes; a scalar's counterpart is bool.
struct LaneMask {
  Mask m;
  HWY_INLINE LaneMask operator&(LaneMask o) const { return {hn::And(m, o.m)}; }
  HWY_INLINE LaneMask operator|(LaneMask o) const { return {hn::Or(m, o.m)}; }
};

/// A vector that the scalar formulas take as their number type.
struct Lanes {
  Vec v;
  Lanes() = default;
  HWY_INLINE Lanes(Vec x) : v(x) {}  // NOLINT(google-explicit-constructor)
  HWY_INLINE explicit Lanes(float x) : v(hn::Set(kFloats, x)) {}

  friend HWY_INLINE Lanes operator+(Lanes a, Lanes b) { return hn::Add(a.v, b.v); }
  friend HWY_INLINE Lanes operator-(Lanes a, Lanes b) { return hn::Sub(a.v, b.v); }
  friend HWY_INLINE Lanes operator*(Lanes a, Lanes b) { return hn::Mul(a.v, b.v); }
  friend HWY_INLINE Lanes operator/(Lanes a, Lanes b) { return hn::Div(a.v, b.v); }
  friend HWY_INLINE Lanes operator-(Lanes a) { return hn::Neg(a.v); }
  friend HWY_INLINE LaneMask operator<(Lanes a, Lanes b) { return {hn::Lt(a.v, b.v)}; }
  friend HWY_INLINE LaneMask operator>(Lanes a, Lanes b) { return {hn::Gt(a.v, b.v)}; }
  friend HWY_INLINE LaneMask operator<=(Lanes a, Lanes b) { return {hn::Le(a.v, b.v)}; }
  friend HWY_INLINE LaneMask operator>=(Lanes a, Lanes b) { return {hn::Ge(a.v, b.v)}; }
};

HWY_INLINE Lanes mul_add(Lanes a, Lanes b, Lanes c) { return hn::MulAdd(a.v, b.v, c.v); }
HWY_INLINE Lanes neg_mul_add(Lanes a, Lanes b, Lanes c) { return hn::NegMulAdd(a.v, b.v, c.v); }
HWY_INLINE Lanes minimum(Lanes a, Lanes b) { return hn::Min(a.v, b.v); }
HWY_INLINE Lanes maximum(Lanes a, Lanes b) { return hn::Max(a.v, b.v); }
HWY_INLINE Lanes square_root(Lanes a) { return hn::Sqrt(a.v); }
HWY_INLINE Lanes absolute(Lanes a) { return hn::Abs(a.v); }
HWY_INLINE Lanes select(LaneMask m, Lanes a, Lanes b) { return hn::IfThenElse(m.m, a.v, b.v); }
HWY_INLINE Lanes exponential(Lanes a) { return hn::Exp(kFloats, a.v); }
HWY_INLINE Lanes logarithm2(Lanes a) { return hn::Log2(kFloats, a.v); }

HWY_INLINE Lanes load(const float* p) { return hn::Load(kFloats, p); }
HWY_INLINE void store(Lanes a, float* p) { hn::Store(a.v, kFloats, p); }

/// x ← 2^x for |x| < 126, relative error below 2.5e-7 (degree-5 minimax over one octave).
/// N vectors in lockstep: one alone would mostly wait for its own chain of dependent operations.
template <size_t N>
HWY_INLINE void exp2_fast(Vec (&x)[N]) {
#if HWY_TARGET <= HWY_AVX3
  // x − floor(x), and the scaling by 2^floor(x): one instruction each.
  constexpr float kCoefficients[5] = {8.98933938e-3f, 5.58263167e-2f, 2.40153627e-1f, 6.93153032e-1f, 9.99999842e-1f};
  constexpr int kFloor = 0x09;
  Vec r[N], p[N];
  for (size_t k = 0; k < N; ++k) r[k] = Vec{_mm512_reduce_ps(x[k].raw, kFloor)};
  for (size_t k = 0; k < N; ++k) p[k] = hn::Set(kFloats, 1.87757675e-3f);
  for (const float c : kCoefficients)
    for (size_t k = 0; k < N; ++k) p[k] = hn::MulAdd(p[k], r[k], hn::Set(kFloats, c));
  for (size_t k = 0; k < N; ++k) x[k] = Vec{_mm512_scalef_ps(p[k].raw, x[k].raw)};
#else
  constexpr float kCoefficients[5] = {9.67554096e-3f, 5.55071309e-2f, 2.40221202e-1f, 6.93146944e-1f, 1.0f};
  const Vec magic = hn::Set(kFloats, 12582912.0f);  // 1.5 * 2^23: the sum's low mantissa bits are round(x)
  constexpr Ints ints;
  Vec shifted[N], p[N];
  for (size_t k = 0; k < N; ++k) shifted[k] = hn::Add(x[k], magic);
  for (size_t k = 0; k < N; ++k) x[k] = hn::Sub(x[k], hn::Sub(shifted[k], magic));
  for (size_t k = 0; k < N; ++k) p[k] = hn::Set(kFloats, 1.32764725e-3f);
  for (const float c : kCoefficients)
    for (size_t k = 0; k < N; ++k) p[k] = hn::MulAdd(p[k], x[k], hn::Set(kFloats, c));
  for (size_t k = 0; k < N; ++k)
    x[k] = hn::BitCast(kFloats, hn::Add(hn::BitCast(ints, p[k]), hn::ShiftLeft<23>(hn::BitCast(ints, shifted[k]))));
#endif
}

/// 1/x to nearly full precision (estimate and Newton steps: cheaper than a division).
HWY_INLINE Vec reciprocal(Vec x) {
  Vec r = hn::ApproximateReciprocal(x);
  const Vec two = hn::Set(kFloats, 2.0f);
  r = hn::Mul(r, hn::NegMulAdd(x, r, two));
#if HWY_ARCH_ARM
  r = hn::Mul(r, hn::NegMulAdd(x, r, two));
#endif
  return r;
}

/// 1/sqrt(x) to nearly full precision, x >= 1e-37.
HWY_INLINE Vec reciprocal_sqrt(Vec x) {
  Vec r = hn::ApproximateReciprocalSqrt(x);
  const Vec half = hn::Mul(hn::Set(kFloats, -0.5f), x);
  const Vec three_halves = hn::Set(kFloats, 1.5f);
  r = hn::Mul(r, hn::MulAdd(hn::Mul(half, r), r, three_halves));
#if HWY_ARCH_ARM
  r = hn::Mul(r, hn::MulAdd(hn::Mul(half, r), r, three_halves));
#endif
  return r;
}

HWY_INLINE Lanes reciprocal_root(Lanes a) { return reciprocal_sqrt(a.v); }

}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard
