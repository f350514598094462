// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/world_export.h"

#include <Eigen/Dense>
#include <numbers>
#include <vector>

#include "base/check.h"
#include "splatting/formulas.h"

namespace photoslam {
namespace {

using splatting::Gaussian;
using Table = GaussianTable;

constexpr int kDirections = 64;
using Basis = Eigen::Matrix<double, kDirections, 16>;

/// Directions spread evenly over the sphere (Fibonacci lattice).
Vec3 direction(int i) {
  const double z = 1.0 - (2.0 * i + 1.0) / kDirections;
  const double angle = std::numbers::pi * (3.0 - std::sqrt(5.0)) * i;
  const double r = std::sqrt(1.0 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// Values of the basis functions at the lattice directions, turned by `rotation`.
Basis basis_at_directions(const Mat3& rotation) {
  Basis basis;
  for (int i = 0; i < kDirections; ++i) {
    const Vec3 d = rotation * direction(i);
    double values[16];
    splatting::scalar::sh_basis(splatting::kMaxShDegree, d.data(), values);
    basis.row(i) = Eigen::Map<Eigen::Matrix<double, 1, 16>>(values);
  }
  return basis;
}

void write_row(const Gaussian& g, std::span<float, 59> row) {
  for (size_t i = 0; i < 3; ++i) row[Table::kPosition + i] = g.mean[i];
  for (size_t c = 0; c < 3; ++c) {
    row[Table::kShDc + c] = g.sh[0][c];
    for (size_t k = 1; k < 16; ++k) row[Table::kShRest + 15 * c + k - 1] = g.sh[k][c];
  }
  row[Table::kOpacity] = g.opacity_logit;
  for (size_t i = 0; i < 3; ++i) row[Table::kScale + i] = g.log_scale[i];
  for (size_t i = 0; i < 4; ++i) row[Table::kRotation + i] = g.rotation[i];
}

}  // namespace

ShRotation::ShRotation(const Mat3& rotation) {
  // A turned function is a combination of basis functions of the same degree; 64 directions determine it exactly.
  // Σ c'_k Y_k(d) = Σ c_k Y_k(Rᵀ d) for all d.
  const Basis fixed = basis_at_directions(Mat3::Identity());
  const Eigen::Matrix<double, 16, 16> least_squares =
      (fixed.transpose() * fixed).ldlt().solve(fixed.transpose() * basis_at_directions(rotation.transpose()));
  matrix_.setZero();  // degrees do not mix
  for (int degree = 0; degree <= splatting::kMaxShDegree; ++degree) {
    const int first = degree * degree, size = 2 * degree + 1;
    matrix_.block(first, first, size, size) = least_squares.block(first, first, size, size);
  }
}

void ShRotation::apply(float (&sh)[splatting::kNumShCoefficients][3]) const {
  for (int c = 0; c < 3; ++c) {
    Eigen::Matrix<double, 16, 1> coefficients;
    for (int k = 0; k < 16; ++k) coefficients[k] = static_cast<double>(sh[k][c]);
    coefficients = matrix_ * coefficients;
    for (int k = 1; k < 16; ++k) sh[k][c] = static_cast<float>(coefficients[k]);  // the constant one stays as it is
  }
}

Gaussian transform(const Gaussian& in_a, const SE3& b_from_a, const ShRotation& rotation) {
  const auto wide = [](float value) { return static_cast<double>(value); };
  const Vec3 mean = b_from_a * Vec3(wide(in_a.mean[0]), wide(in_a.mean[1]), wide(in_a.mean[2]));
  const Quat turned = b_from_a.rotation * Quat(wide(in_a.rotation[0]), wide(in_a.rotation[1]), wide(in_a.rotation[2]),
                                               wide(in_a.rotation[3]));
  Gaussian in_b = in_a;
  rotation.apply(in_b.sh);
  for (int i = 0; i < 3; ++i) in_b.mean[i] = static_cast<float>(mean[i]);
  in_b.rotation[0] = static_cast<float>(turned.w());
  for (int i = 0; i < 3; ++i) in_b.rotation[i + 1] = static_cast<float>(turned.vec()[i]);
  return in_b;
}

GaussianTable to_world(const splatting::GaussianModel& model, std::span<const SE3> anchors_from_world,
                       std::span<const uint8_t> chosen) {
  PHOTOSLAM_CHECK(chosen.empty() || chosen.size() == anchors_from_world.size(), "{} choices for {} anchors",
                  chosen.size(), anchors_from_world.size());
  const auto is_chosen = [&](size_t anchor) { return chosen.empty() || chosen[anchor] != 0; };
  std::vector<SE3> world_from_anchors;
  std::vector<ShRotation> rotations;
  for (const SE3& anchor_from_world : anchors_from_world) {
    world_from_anchors.push_back(anchor_from_world.inverse());
    rotations.emplace_back(world_from_anchors.back().matrix3());
  }
  const int used = splatting::num_sh_coefficients(model.sh_degree());
  GaussianTable table;
  size_t num_rows = 0, row = 0;
  for (size_t anchor = 0; anchor < anchors_from_world.size(); ++anchor) {
    if (is_chosen(anchor)) num_rows += model.size(static_cast<int>(anchor));
  }
  table.resize(num_rows);
  model.for_each([&](size_t index) {
    const auto anchor = static_cast<size_t>(model.anchor(index));
    if (!is_chosen(anchor)) return;
    Gaussian g = model.get(index);
    std::fill(&g.sh[0][0] + 3 * used, &g.sh[0][0] + 48, 0.0f);
    write_row(transform(g, world_from_anchors[anchor], rotations[anchor]), table.row(row++));
  });
  return table;
}

splatting::GaussianModel from_world(const GaussianTable& table) {
  std::vector<Gaussian> gaussians(table.size());
  for (size_t i = 0; i < table.size(); ++i) {
    const auto row = table.row(i);
    Gaussian& g = gaussians[i];
    for (size_t k = 0; k < 3; ++k) {
      g.mean[k] = row[Table::kPosition + k];
      g.log_scale[k] = row[Table::kScale + k];
      g.sh[0][k] = row[Table::kShDc + k];
      for (size_t b = 1; b < 16; ++b) g.sh[b][k] = row[Table::kShRest + 15 * k + b - 1];
    }
    for (size_t k = 0; k < 4; ++k) g.rotation[k] = row[Table::kRotation + k];
    g.opacity_logit = row[Table::kOpacity];
  }
  splatting::GaussianModel model;
  model.add(model.add_anchor(), gaussians);
  model.sort_spatially();
  return model;
}

}  // namespace photoslam
