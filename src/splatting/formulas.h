// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// The mathematics of one gaussian in one view, forwards and backwards, for any number type T: float, double, or a SIMD
// vector. T provides + - * /, construction from float, comparisons, and the functions of "Scalar vocabulary" below.
// Included once for scalars (also by nvcc) and once per SIMD target of Highway's foreach_target.
#if defined(PHOTOSLAM_SPLATTING_FORMULAS_H) == defined(HWY_TARGET_TOGGLE)
#ifdef PHOTOSLAM_SPLATTING_FORMULAS_H
#undef PHOTOSLAM_SPLATTING_FORMULAS_H
#else
#define PHOTOSLAM_SPLATTING_FORMULAS_H
#endif

#include <math.h>

#include "base/formula.h"
#include "splatting/anchor_view.h"
#include "splatting/gaussian.h"

#ifdef HWY_NAMESPACE
HWY_BEFORE_NAMESPACE();
namespace photoslam::splatting::HWY_NAMESPACE {
#else
namespace photoslam::splatting::scalar {
#endif

// --- Scalar vocabulary ---------------------------------------------------------------------------------------------
// clang-format off
PHOTOSLAM_FORMULA float mul_add(float a, float b, float c) { return a * b + c; }
PHOTOSLAM_FORMULA double mul_add(double a, double b, double c) { return a * b + c; }
PHOTOSLAM_FORMULA float square_root(float a) { return sqrtf(a); }
PHOTOSLAM_FORMULA double square_root(double a) { return sqrt(a); }
PHOTOSLAM_FORMULA float reciprocal_root(float a) { return 1.0f / sqrtf(a); }
PHOTOSLAM_FORMULA float exponential(float a) { return expf(a); }
PHOTOSLAM_FORMULA double exponential(double a) { return exp(a); }
PHOTOSLAM_FORMULA float logarithm2(float a) { return log2f(a); }
PHOTOSLAM_FORMULA double logarithm2(double a) { return log2(a); }
PHOTOSLAM_FORMULA float minimum(float a, float b) { return a < b ? a : b; }
PHOTOSLAM_FORMULA double minimum(double a, double b) { return a < b ? a : b; }
PHOTOSLAM_FORMULA float maximum(float a, float b) { return a > b ? a : b; }
PHOTOSLAM_FORMULA double maximum(double a, double b) { return a > b ? a : b; }
PHOTOSLAM_FORMULA float select(bool m, float a, float b) { return m ? a : b; }
PHOTOSLAM_FORMULA double select(bool m, double a, double b) { return m ? a : b; }
// clang-format on

template <class T>
PHOTOSLAM_FORMULA T dot3(const T* a, const T* b) {
  return mul_add(a[0], b[0], mul_add(a[1], b[1], a[2] * b[2]));
}

// --- Projection ----------------------------------------------------------------------------------------------------

/// Everything about a gaussian in a view that blending or the way back needs.
template <class T>
struct Projection {
  T offset[3];  ///< Mean − camera centre, anchor frame.
  T p[3];       ///< Mean in the camera frame.
  T inv_z;
  T x, y;      ///< p.x / z, p.y / z.
  T xc, yc;    ///< The same, clamped.
  T q[4];      ///< Normalised quaternion.
  T inv_norm;  ///< 1 / |quaternion|.
  T scale[3];
  T axes[9];       ///< Rotation * diag(scale): the half axes, anchor frame, as columns.
  T m[9];          ///< The same in the camera frame.
  T v0[3], v1[3];  ///< Half axes projected to the image: covariance = [v0; v1] [v0; v1]ᵀ + low-pass  [px].
  T a, b, c, det;  ///< 2D covariance [[a, b], [b, c]] and its determinant.
  T full_det;      ///< The same determinant in the picture that was shrunk, in these pixels.
  T u, v;          ///< Screen position [px].
};

/// (w, x, y, z) normalised → row-major rotation matrix.
template <class T>
PHOTOSLAM_FORMULA void rotation_matrix(const T* q, T* r) {
  const T two(2.0f), one(1.0f);
  r[0] = one - two * (q[2] * q[2] + q[3] * q[3]);
  r[1] = two * (q[1] * q[2] - q[0] * q[3]);
  r[2] = two * (q[1] * q[3] + q[0] * q[2]);
  r[3] = two * (q[1] * q[2] + q[0] * q[3]);
  r[4] = one - two * (q[1] * q[1] + q[3] * q[3]);
  r[5] = two * (q[2] * q[3] - q[0] * q[1]);
  r[6] = two * (q[1] * q[3] - q[0] * q[2]);
  r[7] = two * (q[2] * q[3] + q[0] * q[1]);
  r[8] = one - two * (q[1] * q[1] + q[2] * q[2]);
}

/// Projects one gaussian: perspective centre, first-order covariance (EWA), low-pass.
///
/// The determinant is summed from the minors of [v0; v1] (Cauchy-Binet): a c − b² would cancel for needles.
template <class T>
PHOTOSLAM_FORMULA void project(const AnchorView& view, const T* mean, const T* rotation, const T* log_scale,
                               Projection<T>& g) {
  for (int i = 0; i < 3; ++i) g.offset[i] = (mean[i] - T(view.center[i])) - T(view.center_low[i]);
  for (int i = 0; i < 3; ++i) {
    const T r[3] = {T(view.rotation[3 * i]), T(view.rotation[3 * i + 1]), T(view.rotation[3 * i + 2])};
    g.p[i] = dot3(r, g.offset);
  }
  g.inv_z = T(1.0f) / g.p[2];
  g.x = g.p[0] * g.inv_z;
  g.y = g.p[1] * g.inv_z;
  g.u = mul_add(T(view.fx), g.x, T(view.cx));
  g.v = mul_add(T(view.fy), g.y, T(view.cy));
  g.xc = minimum(maximum(g.x, T(view.min_x)), T(view.max_x));
  g.yc = minimum(maximum(g.y, T(view.min_y)), T(view.max_y));

  T norm2 = rotation[0] * rotation[0];
  for (int i = 1; i < 4; ++i) norm2 = mul_add(rotation[i], rotation[i], norm2);
  g.inv_norm = T(1.0f) / square_root(norm2);
  for (int i = 0; i < 4; ++i) g.q[i] = rotation[i] * g.inv_norm;
  rotation_matrix(g.q, g.axes);
  for (int j = 0; j < 3; ++j) {
    g.scale[j] = exponential(minimum(log_scale[j], T(80.0f)));
    for (int i = 0; i < 3; ++i) g.axes[3 * i + j] = g.axes[3 * i + j] * g.scale[j];
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const T column[3] = {g.axes[j], g.axes[3 + j], g.axes[6 + j]};
      const T r[3] = {T(view.rotation[3 * i]), T(view.rotation[3 * i + 1]), T(view.rotation[3 * i + 2])};
      g.m[3 * i + j] = dot3(r, column);
    }
  const T sx = T(view.fx) * g.inv_z, sy = T(view.fy) * g.inv_z;
  for (int j = 0; j < 3; ++j) {
    g.v0[j] = sx * (g.m[j] - g.xc * g.m[6 + j]);
    g.v1[j] = sy * (g.m[3 + j] - g.yc * g.m[6 + j]);
  }
  const T a = dot3(g.v0, g.v0), c = dot3(g.v1, g.v1);
  g.b = dot3(g.v0, g.v1);
  const T minors[3] = {g.v0[0] * g.v1[1] - g.v0[1] * g.v1[0], g.v0[1] * g.v1[2] - g.v0[2] * g.v1[1],
                       g.v0[2] * g.v1[0] - g.v0[0] * g.v1[2]};
  const T low_pass(view.low_pass), full_low_pass(view.full_low_pass), trace = a + c, squares = dot3(minors, minors);
  g.det = squares + low_pass * (trace + low_pass);
  g.full_det = squares + full_low_pass * (trace + full_low_pass);
  g.a = a + low_pass;
  g.c = c + low_pass;
}

/// dL/d of what blending sees of one gaussian.
template <class T>
struct ScreenGradient {
  T u, v;           ///< Screen position.
  T exx, exy, eyy;  ///< Σ h e eᵀ with e = covariance⁻¹ (pixel − position), h = dL/d(exponent): 2 dL/d(covariance).
  T z;              ///< Depth.
};

/// Opacity over the height of the peak, at least 1: shrinking a picture spreads a gaussian and keeps its volume.
template <class T>
PHOTOSLAM_FORMULA T flattening(const Projection<T>& g) {
  return square_root(g.det / g.full_det);
}

/// What blending leaves of one gaussian: sums over pixels of h = dL/d(ln alpha) times powers of t = dx − slope dy and
/// dy ((dx, dy) = pixel − screen position, slope = b/c), and of dL/d(depth).
template <class T>
struct PixelSums {
  T one, t, dy, tt, t_dy, dy_dy, z;
};

/// With e = covariance⁻¹ (dx, dy): e.x = a1 t, e.y = c1 dy − slope a1 t where a1 = c/det, c1 = 1/c. The logarithm of
/// the flattening adds the difference of the inverse covariances.
template <class T>
PHOTOSLAM_FORMULA ScreenGradient<T> screen_gradient(const AnchorView& view, const Projection<T>& g,
                                                    const PixelSums<T>& sums) {
  const T c1 = T(1.0f) / g.c, a1 = g.c / g.det;
  const T along = g.b * c1 * a1;  // slope a1
  ScreenGradient<T> s;
  s.u = a1 * sums.t;
  s.v = c1 * sums.dy - along * sums.t;
  s.exx = a1 * a1 * sums.tt;
  s.exy = a1 * (c1 * sums.t_dy - along * sums.tt);
  s.eyy = c1 * c1 * sums.dy_dy + along * (along * sums.tt - (c1 + c1) * sums.t_dy);
  const T spread(view.low_pass - view.full_low_pass), inv = sums.one / g.det, full_inv = sums.one / g.full_det;
  s.exx = s.exx + ((g.c - spread) * full_inv - g.c * inv);
  s.exy = s.exy + g.b * (inv - full_inv);
  s.eyy = s.eyy + ((g.a - spread) * full_inv - g.a * inv);
  s.z = sums.z;
  return s;
}

/// dL/d of the geometry of one gaussian, and its contribution to the pose.
template <class T>
struct GeometryGradient {
  T mean[3];
  T rotation[4];
  T log_scale[3];
  T pose[6];  ///< Left twist in the camera frame, translation first.
};

/// The way back through project(). `offset_gradient` is dL/d(offset) by other ways (the viewing direction).
template <class T>
PHOTOSLAM_FORMULA void project_backward(const AnchorView& view, const Projection<T>& g, const ScreenGradient<T>& s,
                                        const T* offset_gradient, GeometryGradient<T>& out) {
  const T zero(0.0f), two(2.0f);
  const T sx = T(view.fx) * g.inv_z, sy = T(view.fy) * g.inv_z;
  T dm[9], dxc = zero, dyc = zero, dlog_z = zero;
  for (int j = 0; j < 3; ++j) {
    const T dv0 = mul_add(s.exx, g.v0[j], s.exy * g.v1[j]);
    const T dv1 = mul_add(s.exy, g.v0[j], s.eyy * g.v1[j]);
    dm[j] = sx * dv0;
    dm[3 + j] = sy * dv1;
    dm[6 + j] = zero - mul_add(dm[j], g.xc, dm[3 + j] * g.yc);
    dxc = dxc - dm[j] * g.m[6 + j];
    dyc = dyc - dm[3 + j] * g.m[6 + j];
    dlog_z = dlog_z - mul_add(dv0, g.v0[j], dv1 * g.v1[j]);
  }
  const T free_x = select((g.x > T(view.min_x)) & (g.x < T(view.max_x)), dxc, zero);
  const T free_y = select((g.y > T(view.min_y)) & (g.y < T(view.max_y)), dyc, zero);
  const T dx = mul_add(T(view.fx), s.u, free_x);
  const T dy = mul_add(T(view.fy), s.v, free_y);
  const T dp[3] = {dx * g.inv_z, dy * g.inv_z, mul_add(g.inv_z, dlog_z - mul_add(dx, g.x, dy * g.y), s.z)};

  for (int i = 0; i < 3; ++i) {
    const T r[3] = {T(view.rotation[i]), T(view.rotation[3 + i]), T(view.rotation[6 + i])};
    out.mean[i] = dot3(r, dp) + offset_gradient[i];
  }
  for (int i = 0; i < 3; ++i) {
    const T r[3] = {T(view.rotation[3 * i]), T(view.rotation[3 * i + 1]), T(view.rotation[3 * i + 2])};
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    out.pose[i] = dp[i] + dot3(r, offset_gradient);
    T torque = g.p[j] * dp[k] - g.p[k] * dp[j];
    for (int n = 0; n < 3; ++n) torque = torque + (g.m[3 * j + n] * dm[3 * k + n] - g.m[3 * k + n] * dm[3 * j + n]);
    out.pose[3 + i] = torque;
  }

  T dr[9];  // dL/d(rotation matrix)
  for (int j = 0; j < 3; ++j) {
    const T column[3] = {dm[j], dm[3 + j], dm[6 + j]};
    T dlog = zero;
    for (int i = 0; i < 3; ++i) {
      const T r[3] = {T(view.rotation[i]), T(view.rotation[3 + i]), T(view.rotation[6 + i])};
      const T daxis = dot3(r, column);
      dlog = mul_add(daxis, g.axes[3 * i + j], dlog);
      dr[3 * i + j] = daxis * g.scale[j];
    }
    out.log_scale[j] = dlog;
  }
  const T w = g.q[0], x = g.q[1], y = g.q[2], z = g.q[3];
  const T xy = dr[1] + dr[3], xz = dr[2] + dr[6], yz = dr[5] + dr[7];
  const T ax = dr[7] - dr[5], ay = dr[2] - dr[6], az = dr[3] - dr[1];
  const T dq[4] = {two * (x * ax + y * ay + z * az), two * (y * xy + z * xz + w * ax - two * x * (dr[4] + dr[8])),
                   two * (x * xy + z * yz + w * ay - two * y * (dr[0] + dr[8])),
                   two * (x * xz + y * yz + w * az - two * z * (dr[0] + dr[4]))};
  const T radial = mul_add(w, dq[0], mul_add(x, dq[1], mul_add(y, dq[2], z * dq[3])));
  for (int i = 0; i < 4; ++i) out.rotation[i] = g.inv_norm * (dq[i] - g.q[i] * radial);
}

// --- Spherical harmonics -------------------------------------------------------------------------------------------

inline constexpr float kSh0 = 0.28209479177387814f;
inline constexpr float kSh1 = 0.4886025119029199f;
// Scalars, not arrays: device code cannot index constants of the host.
inline constexpr float kSh2_0 = 1.0925484305920792f, kSh2_1 = 0.31539156525252005f, kSh2_2 = 0.5462742152960396f;
inline constexpr float kSh3_0 = -0.5900435899266435f, kSh3_1 = 2.890611442640554f, kSh3_2 = -0.4570457994644658f;
inline constexpr float kSh3_3 = 0.3731763325901154f, kSh3_4 = 1.445305721320277f;

/// The real basis functions up to `degree` at a unit direction, in the order of 3DGS files.
template <class T>
PHOTOSLAM_FORMULA void sh_basis(int degree, const T* direction, T* basis) {
  const T x = direction[0], y = direction[1], z = direction[2];
  basis[0] = T(kSh0);
  if (degree < 1) return;
  basis[1] = T(-kSh1) * y;
  basis[2] = T(kSh1) * z;
  basis[3] = T(-kSh1) * x;
  if (degree < 2) return;
  const T xx = x * x, yy = y * y, zz = z * z, xy = x * y;
  basis[4] = T(kSh2_0) * xy;
  basis[5] = T(-kSh2_0) * (y * z);
  basis[6] = T(kSh2_1) * (zz + zz - xx - yy);
  basis[7] = T(-kSh2_0) * (x * z);
  basis[8] = T(kSh2_2) * (xx - yy);
  if (degree < 3) return;
  const T three(3.0f), four(4.0f);
  basis[9] = T(kSh3_0) * y * (three * xx - yy);
  basis[10] = T(kSh3_1) * xy * z;
  basis[11] = T(kSh3_2) * y * (four * zz - xx - yy);
  basis[12] = T(kSh3_3) * z * (zz + zz - three * (xx + yy));
  basis[13] = T(kSh3_2) * x * (four * zz - xx - yy);
  basis[14] = T(kSh3_4) * z * (xx - yy);
  basis[15] = T(kSh3_0) * x * (xx - three * yy);
}

/// Gradient with respect to the direction of Σ_k weights[k] basis[k]; weights[0] is not used.
template <class T>
PHOTOSLAM_FORMULA void sh_basis_backward(int degree, const T* direction, const T* weights, T* gradient) {
  const T x = direction[0], y = direction[1], z = direction[2];
  const T* w = weights;
  gradient[0] = gradient[1] = gradient[2] = T(0.0f);
  if (degree < 1) return;
  T gx = T(-kSh1) * w[3], gy = T(-kSh1) * w[1], gz = T(kSh1) * w[2];
  if (degree >= 2) {
    const T w4 = T(kSh2_0) * w[4], w5 = T(-kSh2_0) * w[5], w6 = T(2.0f * kSh2_1) * w[6];
    const T w7 = T(-kSh2_0) * w[7], w8 = T(2.0f * kSh2_2) * w[8];
    gx = gx + w4 * y + w7 * z + (w8 - w6) * x;
    gy = gy + w4 * x + w5 * z - (w8 + w6) * y;
    gz = gz + w5 * y + w7 * x + (w6 + w6) * z;
  }
  if (degree >= 3) {
    const T xx = x * x, yy = y * y, zz = z * z, xy = x * y, xz = x * z, yz = y * z;
    const T three(3.0f), four(4.0f), six(6.0f), eight(8.0f);
    const T w9 = T(kSh3_0) * w[9], w10 = T(kSh3_1) * w[10], w11 = T(kSh3_2) * w[11], w12 = T(kSh3_3) * w[12];
    const T w13 = T(kSh3_2) * w[13], w14 = T(kSh3_4) * w[14], w15 = T(kSh3_0) * w[15];
    gx = gx + six * xy * w9 + yz * w10 - (xy + xy) * w11 - six * xz * w12 + (four * zz - three * xx - yy) * w13 +
         (xz + xz) * w14 + three * (xx - yy) * w15;
    gy = gy + three * (xx - yy) * w9 + xz * w10 + (four * zz - xx - three * yy) * w11 - six * yz * w12 -
         (xy + xy) * w13 - (yz + yz) * w14 - six * xy * w15;
    gz = gz + xy * w10 + eight * yz * w11 + (six * zz - three * (xx + yy)) * w12 + eight * xz * w13 + (xx - yy) * w14;
  }
  gradient[0] = gx;
  gradient[1] = gy;
  gradient[2] = gz;
}

/// Unit vector; returns 1 / |v|.
template <class T>
PHOTOSLAM_FORMULA T normalize(const T* v, T* unit) {
  const T inverse = T(1.0f) / square_root(dot3(v, v));
  for (int i = 0; i < 3; ++i) unit[i] = v[i] * inverse;
  return inverse;
}

/// dL/dv of normalize() given dL/d(unit).
template <class T>
PHOTOSLAM_FORMULA void normalize_backward(const T* unit, T inverse, const T* gradient, T* out) {
  const T radial = dot3(unit, gradient);
  for (int i = 0; i < 3; ++i) out[i] = inverse * (gradient[i] - unit[i] * radial);
}

// --- Optimiser -----------------------------------------------------------------------------------------------------

/// 1 − exp(x) for x <= 0, accurate near zero.
template <class T>
PHOTOSLAM_FORMULA T one_minus_exp(T x) {
  T series(1.0f / 40320.0f);
  series = mul_add(series, x, T(1.0f / 5040.0f));
  series = mul_add(series, x, T(1.0f / 720.0f));
  series = mul_add(series, x, T(1.0f / 120.0f));
  series = mul_add(series, x, T(1.0f / 24.0f));
  series = mul_add(series, x, T(1.0f / 6.0f));
  series = mul_add(series, x, T(0.5f));
  series = mul_add(series, x, T(1.0f));
  return select(x > T(-0.35f), -(series * x), T(1.0f) - exponential(x));
}

/// One step of Adam on one parameter: renews its moments and returns by how much it shrinks. `scale1` and `scale2`
/// correct the bias: 1 / (1 − β^n), or 1.
template <class T>
PHOTOSLAM_FORMULA T adam_step(T gradient, T beta1, T beta2, T epsilon2, T scale1, T scale2, T rate, T& first,
                              T& second) {
  first = mul_add(beta1, first - gradient, gradient);
  const T square = gradient * gradient;
  second = mul_add(beta2, second - square, square);
  return rate * scale1 * first * reciprocal_root(mul_add(second, scale2, epsilon2));
}

#ifdef HWY_NAMESPACE
}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#else
}  // namespace photoslam::splatting::scalar
#endif

#endif  // include guard
