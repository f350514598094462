// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// Implementation of the oracle, and the finite differences that vouch for its gradients.
#include "splatting/testing/reference_rasterizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/random.h"

namespace photoslam::reference {
namespace {

using Vec3 = std::array<double, 3>;
using Mat3 = std::array<std::array<double, 3>, 3>;

Mat3 multiply(const Mat3& a, const Mat3& b) {
  Mat3 c{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) c[i][j] += a[i][k] * b[k][j];
  return c;
}

Mat3 transpose(const Mat3& a) {
  Mat3 t{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) t[i][j] = a[j][i];
  return t;
}

Mat3 add(const Mat3& a, const Mat3& b) {
  Mat3 c = a;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[i][j] += b[i][j];
  return c;
}

Mat3 quaternion_matrix(double w, double x, double y, double z) {
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

std::array<double, 16> basis(double x, double y, double z) {
  return {0.28209479177387814,
          -0.4886025119029199 * y,
          0.4886025119029199 * z,
          -0.4886025119029199 * x,
          1.0925484305920792 * x * y,
          -1.0925484305920792 * y * z,
          0.31539156525252005 * (2 * z * z - x * x - y * y),
          -1.0925484305920792 * x * z,
          0.5462742152960396 * (x * x - y * y),
          -0.5900435899266435 * y * (3 * x * x - y * y),
          2.890611442640554 * x * y * z,
          -0.4570457994644658 * y * (4 * z * z - x * x - y * y),
          0.3731763325901154 * z * (2 * z * z - 3 * x * x - 3 * y * y),
          -0.4570457994644658 * x * (4 * z * z - x * x - y * y),
          1.445305721320277 * z * (x * x - y * y),
          -0.5900435899266435 * x * (x * x - 3 * y * y)};
}

/// Central differences of the basis: cubic polynomials, so a Richardson step makes them exact up to rounding.
std::array<Vec3, 16> basis_gradient(const Vec3& d) {
  std::array<Vec3, 16> gradient{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto difference = [&](double h) {
      Vec3 plus = d, minus = d;
      plus[axis] += h;
      minus[axis] -= h;
      const auto a = basis(plus[0], plus[1], plus[2]), b = basis(minus[0], minus[1], minus[2]);
      std::array<double, 16> slope{};
      for (int k = 0; k < 16; ++k) slope[k] = (a[k] - b[k]) / (2 * h);
      return slope;
    };
    const auto coarse = difference(0.5), fine = difference(0.25);
    for (int k = 0; k < 16; ++k) gradient[k][axis] = (4 * fine[k] - coarse[k]) / 3;
  }
  return gradient;
}

struct Projected {
  bool visible = false;
  Vec3 camera{};  // mean in the camera frame
  double u = 0, v = 0;
  double a = 0, b = 0, c = 0;  // covariance
  double conic_a = 0, conic_b = 0, conic_c = 0;
  double full_a = 0, full_c = 0;  // of the covariance in the picture that was shrunk, in these pixels
  double opacity = 0, peak = 0;
  Vec3 color{};
  std::array<bool, 3> clamped{};
};

Mat3 pose_rotation(const Pose& pose) {
  Mat3 r{};
  for (int i = 0; i < 9; ++i) r[i / 3][i % 3] = pose.rotation[i];
  return r;
}

/// Camera centre in the anchor frame for a rotation that may be rounded (not exactly orthonormal): solves R c = −t.
Vec3 camera_center(const Pose& pose) {
  const Mat3 r = pose_rotation(pose);
  const auto determinant = [](const Mat3& m) {
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  };
  Vec3 center{};
  for (int j = 0; j < 3; ++j) {
    Mat3 m = r;
    for (int i = 0; i < 3; ++i) m[i][j] = -pose.translation[i];
    center[j] = determinant(m) / determinant(r);
  }
  return center;
}

struct Jacobian {
  std::array<Vec3, 2> j;
  double x, y, x_clamped, y_clamped;
};

Jacobian jacobian(const Vec3& p, const View& view) {
  const double x = p[0] / p[2], y = p[1] / p[2];
  const double x_low = -(view.cx + 0.5) / view.fx - 0.15 * view.width / view.fx;
  const double x_high = (view.width - 0.5 - view.cx) / view.fx + 0.15 * view.width / view.fx;
  const double y_low = -(view.cy + 0.5) / view.fy - 0.15 * view.height / view.fy;
  const double y_high = (view.height - 0.5 - view.cy) / view.fy + 0.15 * view.height / view.fy;
  const double xc = std::clamp(x, x_low, x_high), yc = std::clamp(y, y_low, y_high);
  return {{{{view.fx / p[2], 0, -view.fx * xc / p[2]}, {0, view.fy / p[2], -view.fy * yc / p[2]}}}, x, y, xc, yc};
}

/// Σ in the camera frame: W R S² Rᵀ Wᵀ.
Mat3 camera_covariance(const Parameters& g, const Mat3& w) {
  const double n = std::sqrt(g[3] * g[3] + g[4] * g[4] + g[5] * g[5] + g[6] * g[6]);
  const Mat3 r = quaternion_matrix(g[3] / n, g[4] / n, g[5] / n, g[6] / n);
  Mat3 s2{};
  for (int i = 0; i < 3; ++i) s2[i][i] = std::exp(2 * g[7 + i]);
  const Mat3 wr = multiply(w, r);
  return multiply(multiply(wr, s2), transpose(wr));
}

Projected project(const Gaussian& gaussian, const View& view) {
  const Parameters& g = gaussian.parameters;
  const Pose& pose = view.camera_from_anchor[gaussian.anchor];
  const Mat3 w = pose_rotation(pose);
  Projected out;
  for (int i = 0; i < 3; ++i) out.camera[i] = w[i][0] * g[0] + w[i][1] * g[1] + w[i][2] * g[2] + pose.translation[i];
  if (!(out.camera[2] > view.near)) return out;
  out.u = view.fx * out.camera[0] / out.camera[2] + view.cx;
  out.v = view.fy * out.camera[1] / out.camera[2] + view.cy;
  const Jacobian jac = jacobian(out.camera, view);
  const Mat3 cov = camera_covariance(g, w);
  const auto form = [&](int r, int s) {
    double sum = 0;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) sum += jac.j[r][i] * cov[i][k] * jac.j[s][k];
    return sum;
  };
  // A pixel of the full picture has a variance of 0.3, s² pixels side by side spread by another (s² − 1) / 12.
  const double s2 = view.shrink_factor * view.shrink_factor, spread = (s2 - 1) / 12 / s2;
  out.full_a = form(0, 0) + 0.3 / s2;
  out.full_c = form(1, 1) + 0.3 / s2;
  out.a = out.full_a + spread;
  out.b = form(0, 1);
  out.c = out.full_c + spread;
  const double det = out.a * out.c - out.b * out.b;
  out.conic_a = out.c / det;
  out.conic_b = -out.b / det;
  out.conic_c = out.a / det;
  out.opacity = 1 / (1 + std::exp(-g[10]));
  out.peak = out.opacity * std::sqrt((out.full_a * out.full_c - out.b * out.b) / det);
  const Vec3 center = camera_center(pose);
  Vec3 d{g[0] - center[0], g[1] - center[1], g[2] - center[2]};
  const double norm = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  const auto y = basis(d[0] / norm, d[1] / norm, d[2] / norm);
  const int count = (view.sh_degree + 1) * (view.sh_degree + 1);
  for (int ch = 0; ch < 3; ++ch) {
    double value = 0.5;
    for (int k = 0; k < count; ++k) value += y[k] * g[11 + 3 * k + ch];
    out.clamped[ch] = value <= 0;
    out.color[ch] = std::max(0.0, value);
  }
  out.visible = true;
  return out;
}

struct Contribution {
  int gaussian;
  double raw, alpha, before;  // exp form, clamped, transmittance in front
  double dx, dy;
};

struct Scene {
  std::vector<Projected> projected;
  std::vector<int> order;

  Scene(const std::vector<Gaussian>& gaussians, const View& view) {
    for (const Gaussian& g : gaussians) projected.push_back(project(g, view));
    order.resize(gaussians.size());
    std::iota(order.begin(), order.end(), 0);
    std::erase_if(order, [&](int i) { return !projected[i].visible; });
    std::stable_sort(order.begin(), order.end(), [&](int i, int j) {
      return static_cast<float>(projected[i].camera[2]) < static_cast<float>(projected[j].camera[2]);
    });
  }

  /// What blends at pixel (x, y), front to back; returns the transmittance left.
  double trace(int x, int y, double noise, std::vector<Contribution>& list, bool& ambiguous) const {
    list.clear();
    double t = 1;
    double previous_z = -1;
    for (int i : order) {
      const Projected& p = projected[i];
      const double dx = x - p.u, dy = y - p.v;
      const double power = -0.5 * (p.conic_a * dx * dx + p.conic_c * dy * dy) - p.conic_b * dx * dy;
      const double raw = p.peak * std::exp(power), alpha = std::min(0.99, raw);
      if (std::abs(raw * 255 - 1) < noise * 10) ambiguous = true;
      if (raw < 1.0 / 255) continue;
      if (std::abs(raw / 0.99 - 1) < noise) ambiguous = true;
      if (p.camera[2] - previous_z < 1e-6 * p.camera[2]) ambiguous = true;
      previous_z = p.camera[2];
      const double after = t * (1 - alpha);
      if (std::abs(after / 1e-4 - 1) < noise * 100) ambiguous = true;
      if (after <= 1e-4) break;
      list.push_back({i, raw, alpha, t, dx, dy});
      t = after;
    }
    return t;
  }
};

/// Gradients at one gaussian's screen quantities.
struct ScreenGradients {
  double u = 0, v = 0, conic_a = 0, conic_b = 0, conic_c = 0, opacity = 0, z = 0;
  Vec3 color{};
};

/// Adds the gradients of the harmonics; returns dL/d(mean − camera centre) in the anchor frame.
Vec3 color_backward(const Parameters& g, const View& view, const Projected& p, const Pose& pose, const Vec3& color,
                    Parameters& out) {
  const Vec3 center = camera_center(pose);
  const Vec3 d{g[0] - center[0], g[1] - center[1], g[2] - center[2]};
  const double norm = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  const Vec3 n{d[0] / norm, d[1] / norm, d[2] / norm};
  const auto y = basis(n[0], n[1], n[2]);
  const auto dy = basis_gradient(n);
  Vec3 dn{};
  const int count = (view.sh_degree + 1) * (view.sh_degree + 1);
  for (int c = 0; c < 3; ++c) {
    if (p.clamped[c]) continue;
    for (int i = 0; i < count; ++i) {
      out[11 + 3 * i + c] += y[i] * color[c];
      for (int axis = 0; axis < 3; ++axis) dn[axis] += color[c] * g[11 + 3 * i + c] * dy[i][axis];
    }
  }
  const double radial = dn[0] * n[0] + dn[1] * n[1] + dn[2] * n[2];
  Vec3 dd{};
  for (int i = 0; i < 3; ++i) dd[i] = (dn[i] - n[i] * radial) / norm;
  return dd;
}

void geometry_backward(const Gaussian& gaussian, const View& view, const Projected& p, const ScreenGradients& s,
                       Parameters& out, std::array<double, 6>& pose_gradient) {
  const Parameters& g = gaussian.parameters;
  const Pose& pose = view.camera_from_anchor[gaussian.anchor];
  const Mat3 w = pose_rotation(pose);
  // Conic = Cov⁻¹, so dL/dCov = −Conic (dL/dConic) Conic, with the off-diagonal gradient shared by both entries.
  const double k[2][2] = {{p.conic_a, p.conic_b}, {p.conic_b, p.conic_c}};
  const double gk[2][2] = {{s.conic_a, s.conic_b / 2}, {s.conic_b / 2, s.conic_c}};
  double gcov[2][2] = {};
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      for (int m = 0; m < 2; ++m)
        for (int n = 0; n < 2; ++n) gcov[i][j] -= k[i][m] * gk[m][n] * k[n][j];
  // The logarithm of the peak holds half that of the determinants' ratio: dL/dCov = (Full⁻¹ − Conic) dL/d(ln peak) / 2.
  const double full_det = p.full_a * p.full_c - p.b * p.b, half = 0.5 * s.opacity * p.opacity;
  const double full[2][2] = {{p.full_c / full_det, -p.b / full_det}, {-p.b / full_det, p.full_a / full_det}};
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) gcov[i][j] += half * (full[i][j] - k[i][j]);

  const Jacobian jac = jacobian(p.camera, view);
  const Mat3 cov = camera_covariance(g, w);
  Mat3 dcov{};  // dL/d(camera covariance) = Jᵀ G J
  std::array<Vec3, 2> dj{};
  for (int r = 0; r < 2; ++r)
    for (int q = 0; q < 2; ++q)
      for (int i = 0; i < 3; ++i)
        for (int m = 0; m < 3; ++m) {
          dcov[i][m] += jac.j[r][i] * gcov[r][q] * jac.j[q][m];
          dj[r][i] += 2 * gcov[r][q] * jac.j[q][m] * cov[m][i];
        }
  const double z = p.camera[2];
  Vec3 dp{};
  dp[0] = s.u * view.fx / z;
  dp[1] = s.v * view.fy / z;
  dp[2] = -s.u * view.fx * p.camera[0] / (z * z) - s.v * view.fy * p.camera[1] / (z * z) + s.z;
  dp[2] += -dj[0][0] * view.fx / (z * z) - dj[1][1] * view.fy / (z * z);
  dp[2] += dj[0][2] * view.fx * jac.x_clamped / (z * z) + dj[1][2] * view.fy * jac.y_clamped / (z * z);
  if (jac.x == jac.x_clamped) {
    dp[0] += -dj[0][2] * view.fx / (z * z);
    dp[2] += dj[0][2] * view.fx / z * p.camera[0] / (z * z);
  }
  if (jac.y == jac.y_clamped) {
    dp[1] += -dj[1][2] * view.fy / (z * z);
    dp[2] += dj[1][2] * view.fy / z * p.camera[1] / (z * z);
  }

  const Vec3 dd = color_backward(g, view, p, pose, s.color, out);
  Vec3 dd_camera{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      out[i] += w[j][i] * dp[j];
      dd_camera[i] += w[i][j] * dd[j];
    }
  for (int i = 0; i < 3; ++i) out[i] += dd[i];

  // Σ = (W R) S² (W R)ᵀ; with A = W R: dL/dA = 2 G A S².
  const double qn = std::sqrt(g[3] * g[3] + g[4] * g[4] + g[5] * g[5] + g[6] * g[6]);
  const double q[4] = {g[3] / qn, g[4] / qn, g[5] / qn, g[6] / qn};
  const Mat3 r = quaternion_matrix(q[0], q[1], q[2], q[3]);
  const Mat3 a = multiply(w, r);
  const Mat3 ga = multiply(dcov, a);
  Mat3 dr{};
  for (int j = 0; j < 3; ++j) {
    const double s2 = std::exp(2 * g[7 + j]);
    double dlog = 0;
    for (int i = 0; i < 3; ++i) dlog += a[i][j] * ga[i][j];
    out[7 + j] += 2 * s2 * dlog;
    for (int i = 0; i < 3; ++i)
      for (int m = 0; m < 3; ++m) dr[i][j] += w[m][i] * 2 * ga[m][j] * s2;
  }
  // dR/dq is linear in q: differences of quaternion_matrix are its exact derivative up to the constant diagonal.
  double dq[4];
  for (int i = 0; i < 4; ++i) {
    double plus[4] = {q[0], q[1], q[2], q[3]}, minus[4] = {q[0], q[1], q[2], q[3]};
    plus[i] += 0.5;
    minus[i] -= 0.5;
    const Mat3 rp = quaternion_matrix(plus[0], plus[1], plus[2], plus[3]);
    const Mat3 rm = quaternion_matrix(minus[0], minus[1], minus[2], minus[3]);
    dq[i] = 0;
    for (int m = 0; m < 3; ++m)
      for (int j = 0; j < 3; ++j) dq[i] += dr[m][j] * (rp[m][j] - rm[m][j]);
  }
  const double along = dq[0] * q[0] + dq[1] * q[1] + dq[2] * q[2] + dq[3] * q[3];
  for (int i = 0; i < 4; ++i) out[3 + i] += (dq[i] - q[i] * along) / qn;
  out[10] += s.opacity * p.opacity * (1 - p.opacity);

  // Pose: p ← p + ρ + φ × p, Σ ← [φ] Σ + Σ [φ]ᵀ, direction in the anchor frame ← d + Wᵀ ρ.
  for (int i = 0; i < 3; ++i) pose_gradient[i] += dp[i] + dd_camera[i];
  const Vec3 torque{p.camera[1] * dp[2] - p.camera[2] * dp[1], p.camera[2] * dp[0] - p.camera[0] * dp[2],
                    p.camera[0] * dp[1] - p.camera[1] * dp[0]};
  const Mat3 gs = add(dcov, transpose(dcov));
  const Mat3 m = multiply(cov, gs);  // dL = tr(gsᵀ [φ] Σ) = Σ over [φ]_ij m_ji
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, l = (i + 2) % 3;
    pose_gradient[3 + i] += torque[i] + m[j][l] - m[l][j];
  }
}

}  // namespace

Image render(const std::vector<Gaussian>& gaussians, const View& view, double noise) {
  const Scene scene(gaussians, view);
  const size_t plane = static_cast<size_t>(view.width) * static_cast<size_t>(view.height);
  Image image{std::vector<double>(3 * plane), std::vector<double>(plane), std::vector<double>(plane),
              std::vector<uint8_t>(plane)};
  std::vector<Contribution> list;
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) {
      const size_t at = static_cast<size_t>(y * view.width + x);
      bool ambiguous = false;
      const double left = scene.trace(x, y, noise, list, ambiguous);
      for (const Contribution& c : list) {
        for (size_t k = 0; k < 3; ++k)
          image.rgb[k * plane + at] += c.alpha * c.before * scene.projected[c.gaussian].color[k];
        image.depth[at] += c.alpha * c.before * scene.projected[c.gaussian].camera[2];
      }
      for (size_t k = 0; k < 3; ++k) image.rgb[k * plane + at] += left * view.background[k];
      image.alpha[at] = 1 - left;
      image.ambiguous[at] = ambiguous;
    }
  return image;
}

Gradients backward(const std::vector<Gaussian>& gaussians, const View& view, const std::vector<double>& dl_drgb,
                   const std::vector<double>& dl_ddepth, const std::vector<double>& dl_dalpha) {
  const Scene scene(gaussians, view);
  const size_t plane = static_cast<size_t>(view.width) * static_cast<size_t>(view.height);
  std::vector<ScreenGradients> screen(gaussians.size());
  std::vector<Contribution> list;
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) {
      const size_t at = static_cast<size_t>(y * view.width + x);
      bool ambiguous = false;
      scene.trace(x, y, 0, list, ambiguous);
      // Back to front: `behind` is the colour, depth and alpha seen behind a splat, as if it were not there.
      Vec3 behind = view.background;
      double behind_depth = 0, behind_alpha = 0;
      for (size_t i = list.size(); i-- > 0;) {
        const Contribution& c = list[i];
        const Projected& p = scene.projected[c.gaussian];
        ScreenGradients& s = screen[c.gaussian];
        double d_alpha = 0;
        for (size_t k = 0; k < 3; ++k) {
          const double g = dl_drgb[k * plane + at];
          d_alpha += g * c.before * (p.color[k] - behind[k]);
          s.color[k] += g * c.before * c.alpha;
          behind[k] = c.alpha * p.color[k] + (1 - c.alpha) * behind[k];
        }
        d_alpha += dl_ddepth[at] * c.before * (p.camera[2] - behind_depth);
        s.z += dl_ddepth[at] * c.before * c.alpha;
        behind_depth = c.alpha * p.camera[2] + (1 - c.alpha) * behind_depth;
        d_alpha += dl_dalpha[at] * c.before * (1 - behind_alpha);
        behind_alpha = c.alpha + (1 - c.alpha) * behind_alpha;
        if (c.raw > 0.99) continue;
        s.opacity += d_alpha * c.raw / p.opacity;
        const double d_power = d_alpha * c.raw;
        s.conic_a += -0.5 * c.dx * c.dx * d_power;
        s.conic_b += -c.dx * c.dy * d_power;
        s.conic_c += -0.5 * c.dy * c.dy * d_power;
        s.u += d_power * (p.conic_a * c.dx + p.conic_b * c.dy);
        s.v += d_power * (p.conic_b * c.dx + p.conic_c * c.dy);
      }
    }
  Gradients out{std::vector<Parameters>(gaussians.size(), Parameters{}), {}};
  for (size_t i = 0; i < gaussians.size(); ++i)
    if (scene.projected[i].visible)
      geometry_backward(gaussians[i], view, scene.projected[i], screen[i], out.parameters[i], out.pose);
  return out;
}

namespace {

struct TestScene {
  std::vector<Gaussian> gaussians;
  View view;
  std::vector<double> dl_drgb, dl_ddepth, dl_dalpha;

  double loss(const std::vector<Gaussian>& g, const View& v) const {
    const Image image = render(g, v);
    double sum = 0;
    for (size_t i = 0; i < image.rgb.size(); ++i) sum += dl_drgb[i] * image.rgb[i];
    for (size_t i = 0; i < image.depth.size(); ++i)
      sum += dl_ddepth[i] * image.depth[i] + dl_dalpha[i] * image.alpha[i];
    return sum;
  }
};

TestScene make_scene(int shrink_factor) {
  Random random(5);
  TestScene scene;
  scene.view = {.width = 29,
                .height = 21,
                .fx = 30,
                .fy = 33,
                .cx = 12.3,
                .cy = 11.8,
                .shrink_factor = shrink_factor,
                .background = {0.2, 0.4, 0.1},
                .camera_from_anchor = {Pose{{0.8, 0, 0.6, 0, 1, 0, -0.6, 0, 0.8}, {0.1, -0.2, 0.3}}}};
  for (int i = 0; i < 40; ++i) {
    Gaussian g;
    const Vec3 camera{random.uniform(-1.5, 1.5), random.uniform(-1.2, 1.2), random.uniform(0.8, 4)};
    const Pose& pose = scene.view.camera_from_anchor[0];
    for (int k = 0; k < 3; ++k)
      for (int m = 0; m < 3; ++m) g.parameters[k] += pose.rotation[3 * m + k] * (camera[m] - pose.translation[m]);
    for (int k = 3; k < 7; ++k) g.parameters[k] = random.normal();
    for (int k = 7; k < 10; ++k) g.parameters[k] = random.uniform(-3.0, -0.5);
    g.parameters[10] = random.uniform(-1.0, 3.0);
    for (int k = 11; k < 59; ++k) g.parameters[k] = 0.3 * random.normal();
    scene.gaussians.push_back(g);
  }
  const size_t plane = 29 * 21;
  for (size_t i = 0; i < 3 * plane; ++i) scene.dl_drgb.push_back(random.normal());
  for (size_t i = 0; i < plane; ++i) scene.dl_ddepth.push_back(0.3 * random.normal());
  for (size_t i = 0; i < plane; ++i) scene.dl_dalpha.push_back(0.3 * random.normal());
  const Image image = render(scene.gaussians, scene.view, 3e-4);  // finite steps must not cross a threshold
  for (size_t i = 0; i < plane; ++i)
    if (image.ambiguous[i]) {
      for (size_t k = 0; k < 3; ++k) scene.dl_drgb[k * plane + i] = 0;
      scene.dl_ddepth[i] = scene.dl_dalpha[i] = 0;
    }
  return scene;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<long>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

void expect_gradients_of_finite_differences(const TestScene& scene) {
  const Gradients analytic = backward(scene.gaussians, scene.view, scene.dl_drgb, scene.dl_ddepth, scene.dl_dalpha);
  Random random(6);
  std::vector<double> errors;
  for (int probe = 0; probe < 200; ++probe) {
    const size_t i = static_cast<size_t>(random.index(40)), k = static_cast<size_t>(probe % kNumParameters);
    const double h = 1e-6;
    std::vector<Gaussian> plus = scene.gaussians, minus = scene.gaussians;
    plus[i].parameters[k] += h;
    minus[i].parameters[k] -= h;
    const double numeric = (scene.loss(plus, scene.view) - scene.loss(minus, scene.view)) / (2 * h);
    const double exact = analytic.parameters[i][k];
    if (std::abs(exact) + std::abs(numeric) < 1e-4) continue;
    errors.push_back(std::abs(numeric - exact) / std::max(std::abs(exact), 1e-2));
  }
  ASSERT_GE(errors.size(), 100u);
  EXPECT_LE(median(errors), 1e-6);
  std::sort(errors.begin(), errors.end());
  EXPECT_LE(errors[errors.size() * 95 / 100], 1e-4);  // the rest crossed a threshold
}

TEST(ReferenceRasterizer, GradientsAgreeWithFiniteDifferences) {
  for (const int shrink_factor : {1, 3}) expect_gradients_of_finite_differences(make_scene(shrink_factor));
}

void expect_pose_gradient_of_finite_differences(const TestScene& scene) {
  const Gradients analytic = backward(scene.gaussians, scene.view, scene.dl_drgb, scene.dl_ddepth, scene.dl_dalpha);
  for (int k = 0; k < 6; ++k) {
    const double h = 1e-6;
    const auto moved = [&](double step) {
      // exp(ξ) for a single coordinate of the twist.
      Pose twist;
      if (k < 3) {
        twist.translation[static_cast<size_t>(k)] = step;
      } else {
        const size_t a = static_cast<size_t>((k - 3 + 1) % 3), b = static_cast<size_t>((k - 3 + 2) % 3);
        twist.rotation[4 * a] = twist.rotation[4 * b] = std::cos(step);
        twist.rotation[3 * a + b] = -std::sin(step);
        twist.rotation[3 * b + a] = std::sin(step);
      }
      View view = scene.view;
      const Pose& old = scene.view.camera_from_anchor[0];
      Pose& pose = view.camera_from_anchor[0];
      for (size_t i = 0; i < 3; ++i) {
        pose.translation[i] = twist.translation[i];
        for (size_t j = 0; j < 3; ++j) {
          pose.translation[i] += twist.rotation[3 * i + j] * old.translation[j];
          pose.rotation[3 * i + j] = 0;
          for (size_t m = 0; m < 3; ++m)
            pose.rotation[3 * i + j] += twist.rotation[3 * i + m] * old.rotation[3 * m + j];
        }
      }
      return view;
    };
    const double numeric = (scene.loss(scene.gaussians, moved(h)) - scene.loss(scene.gaussians, moved(-h))) / (2 * h);
    EXPECT_NEAR(numeric, analytic.pose[static_cast<size_t>(k)], 1e-5 * std::abs(numeric) + 1e-4) << "coordinate " << k;
  }
}

TEST(ReferenceRasterizer, PoseGradientAgreesWithFiniteDifferences) {
  for (const int shrink_factor : {1, 3}) expect_pose_gradient_of_finite_differences(make_scene(shrink_factor));
}

}  // namespace
}  // namespace photoslam::reference
