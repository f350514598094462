// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "photorealistic_mapping/seeding.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "math/median.h"
#include "math/se3.h"

namespace photoslam {
namespace {

constexpr double kSh0 = 0.28209479177387814;  // Y_0

/// What the image and the render say about one cell.
struct Cell {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // pixels [x0, x1) x [y0, y1)
  Vec3 color = Vec3::Zero();           // mean, [0, 1]
  double color_error = 0;              // squared difference of the means, summed over channels
  double transmittance = 1;
  bool has_data = false;
  double depth = 0;        // measured [m]; 0 = none
  bool measured = false;   // depth is the cell's own
  int distance = 0;        // to the cell whose depth it is [cells]
  double drawn_depth = 0;  // by the map [m]
  Vec2 center() const { return {0.5 * (x0 + x1 - 1), 0.5 * (y0 + y1 - 1)}; }
};

struct CellGrid {
  int columns = 0, rows = 0;
  std::vector<Cell> cells;
  Cell& at(int column, int row) { return cells[static_cast<size_t>(row * columns + column)]; }
  const Cell& at(int column, int row) const { return cells[static_cast<size_t>(row * columns + column)]; }
  bool contains(int column, int row) const { return column >= 0 && row >= 0 && column < columns && row < rows; }
};

Vec3 pixel_color(const ImageU8& image, int x, int y) {
  if (image.channels() == 1) return Vec3::Constant(image(x, y) / 255.0);
  return Vec3(image(x, y, 0), image(x, y, 1), image(x, y, 2)) / 255.0;
}

double median_depth(const ImageF& depth, const Cell& cell) {
  std::vector<float> values;
  for (int y = cell.y0; y < cell.y1; ++y) {
    for (int x = cell.x0; x < cell.x1; ++x) {
      if (depth(x, y) > 0) values.push_back(depth(x, y));
    }
  }
  const auto pixels = static_cast<size_t>((cell.x1 - cell.x0) * (cell.y1 - cell.y0));
  if (values.empty() || 4 * values.size() < pixels) return 0;
  return static_cast<double>(lower_median(values));
}

Cell summarize_cell(const DepthPicture& view, const splatting::RenderResult& render, int column, int row, int size) {
  Cell cell;
  cell.x0 = column * size;
  cell.y0 = row * size;
  cell.x1 = std::min(cell.x0 + size, view.camera.width);
  cell.y1 = std::min(cell.y0 + size, view.camera.height);
  const size_t plane = static_cast<size_t>(view.camera.width) * static_cast<size_t>(view.camera.height);
  Vec3 rendered = Vec3::Zero();
  double alpha = 0, depth = 0;
  int pixels = 0;
  for (int y = cell.y0; y < cell.y1; ++y) {
    for (int x = cell.x0; x < cell.x1; ++x) {
      const size_t i = static_cast<size_t>(y) * static_cast<size_t>(view.camera.width) + static_cast<size_t>(x);
      if (!view.has_data(i)) continue;
      ++pixels;
      cell.color += pixel_color(view.color, x, y);
      rendered += Vec3(static_cast<double>(render.rgb[i]), static_cast<double>(render.rgb[plane + i]),
                       static_cast<double>(render.rgb[2 * plane + i]));
      alpha += static_cast<double>(render.alpha[i]);
      depth += static_cast<double>(render.depth[i]);
    }
  }
  cell.has_data = 4 * pixels >= (cell.x1 - cell.x0) * (cell.y1 - cell.y0);
  if (!cell.has_data) return cell;
  cell.color /= pixels;
  cell.color_error = (rendered / pixels - alpha / pixels * cell.color).squaredNorm();
  cell.transmittance = 1.0 - alpha / pixels;
  if (!view.depth.empty()) cell.depth = median_depth(view.depth, cell);
  cell.measured = cell.depth > 0;
  if (alpha > 0) cell.drawn_depth = depth / alpha;
  return cell;
}

CellGrid summarize(const DepthPicture& view, const splatting::RenderResult& render, int cell_size) {
  CellGrid grid;
  grid.columns = (view.camera.width + cell_size - 1) / cell_size;
  grid.rows = (view.camera.height + cell_size - 1) / cell_size;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      grid.cells.push_back(summarize_cell(view, render, column, row, cell_size));
    }
  }
  return grid;
}

/// What the map covers is where it is drawn.
void take_drawn_depth(const SeedingOptions& options, CellGrid& grid) {
  for (Cell& cell : grid.cells) {
    if (cell.has_data && cell.transmittance <= options.min_transmittance) cell.depth = cell.drawn_depth;
  }
}

/// Cells without a depth take that of the nearest cells that have one, ring by ring; of several the
/// farthest, for what hides from one of two views, or is the sky behind a tree, lies behind.
void fill_missing_depth(CellGrid& grid) {
  std::vector<std::pair<int, int>> ring, next;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      if (grid.at(column, row).depth > 0) ring.emplace_back(column, row);
    }
  }
  for (int distance = 1; !ring.empty(); ++distance) {
    next.clear();
    for (const auto& [column, row] : ring) {
      for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (!grid.contains(column + dx, row + dy)) continue;
        Cell& neighbour = grid.at(column + dx, row + dy);
        if (neighbour.depth > 0 && neighbour.distance < distance) continue;
        if (!(neighbour.depth > 0)) next.emplace_back(column + dx, row + dy);
        neighbour.distance = distance;
        neighbour.depth = std::max(neighbour.depth, grid.at(column, row).depth);
      }
    }
    std::swap(ring, next);
  }
}

/// Unit surface normal towards the camera, from the neighbouring cells; the viewing direction at edges and gaps.
Vec3 surface_normal(const CellGrid& grid, const PinholeCamera& camera, int column, int row) {
  const Cell& cell = grid.at(column, row);
  const Vec3 center = camera.unproject(cell.center(), cell.depth);
  const auto difference = [&](int dx, int dy) -> Vec3 {
    for (const int sign : {1, -1}) {
      if (!grid.contains(column + sign * dx, row + sign * dy)) continue;
      const Cell& neighbour = grid.at(column + sign * dx, row + sign * dy);
      constexpr double kSurfaceStep = 0.1;  // larger relative steps between cells are edges
      if (!neighbour.measured || std::abs(neighbour.depth - cell.depth) > kSurfaceStep * cell.depth) continue;
      return sign * (camera.unproject(neighbour.center(), neighbour.depth) - center);
    }
    return Vec3::Zero();
  };
  const Vec3 towards_camera = -center.normalized();
  Vec3 normal = difference(1, 0).cross(difference(0, 1));
  if (!cell.measured || normal.norm() < 1e-12) return Vec3(towards_camera);
  normal.normalize();
  return normal.dot(towards_camera) < 0 ? Vec3(-normal) : normal;
}

/// A disc of radius sigma across the line of sight, stretched along the surface it lies on.
splatting::Gaussian make_disc(const SeedingOptions& options, const Vec3& mean, const Vec3& normal, double sigma,
                              const Vec3& color) {
  const Vec3 sight = mean.normalized();
  const double cosine = std::abs(normal.dot(sight));
  Vec3 tilt = sight - normal.dot(sight) * normal;  // direction in the surface that the view foreshortens
  if (tilt.norm() < 1e-6) tilt = normal.unitOrthogonal();
  tilt.normalize();
  Mat3 axes;
  axes << tilt, normal.cross(tilt), normal;
  const Quat rotation(axes);

  const double stretch = std::min(1.0 / std::max(cosine, 1e-3), options.max_stretch);
  splatting::Gaussian gaussian;
  for (int i = 0; i < 3; ++i) gaussian.mean[i] = static_cast<float>(mean[i]);
  gaussian.rotation[0] = static_cast<float>(rotation.w());
  gaussian.rotation[1] = static_cast<float>(rotation.x());
  gaussian.rotation[2] = static_cast<float>(rotation.y());
  gaussian.rotation[3] = static_cast<float>(rotation.z());
  gaussian.log_scale[0] = static_cast<float>(std::log(sigma * stretch));
  gaussian.log_scale[1] = static_cast<float>(std::log(sigma));
  gaussian.log_scale[2] = static_cast<float>(std::log(sigma * options.thickness));
  gaussian.opacity_logit = static_cast<float>(std::log(options.opacity / (1.0 - options.opacity)));
  for (int c = 0; c < 3; ++c) gaussian.sh[0][c] = static_cast<float>((color[c] - 0.5) / kSh0);
  return gaussian;
}

/// Whether the map draws most of the cell behind where two pictures saw it. Pixel by pixel: at an edge the mean of what
/// is drawn lies between two surfaces.
bool is_drawn_too_far(const SeedingOptions& options, const ImageF& confirmed, const splatting::RenderResult& render,
                      const Cell& cell) {
  if (confirmed.empty()) return false;
  const auto share = static_cast<float>(1 - options.min_depth_error);
  int count = 0;
  for (int y = cell.y0; y < cell.y1; ++y) {
    for (int x = cell.x0; x < cell.x1; ++x) {
      const size_t i = static_cast<size_t>(y) * static_cast<size_t>(confirmed.width()) + static_cast<size_t>(x);
      count += confirmed(x, y) > 0 && confirmed(x, y) * render.alpha[i] < share * render.depth[i];
    }
  }
  return 2 * count > (cell.x1 - cell.x0) * (cell.y1 - cell.y0);
}

}  // namespace

void SeedingOptions::visit(OptionVisitor& v) {
  v.value({"dense", "", 0, 0, "One gaussian per image cell where depth is known, beyond the paper."}, dense);
  v.value({"active_features", "", 0, 0, "Gaussians at features with a landmark."}, active_features);
  v.value(
      {"inactive_features", "", 0, 0, "Geometry-based densification: gaussians at features without a landmark too."},
      inactive_features);
  v.value({"cell_px", "px", 2, 64, "Side of the image cells that become one gaussian each, at full resolution."},
          cell_px);
  v.value({"sigma_cells", "cells", 0.1, 4.0, "Standard deviation of a new gaussian."}, sigma_cells);
  v.value({"thickness", "", 0.01, 1.0, "Its extent along the surface normal, relative to that across."}, thickness);
  v.value({"max_stretch", "", 1.0, 20.0, "Largest elongation of a disc on a surface seen at a grazing angle."},
          max_stretch);
  v.value({"opacity", "", 0.02, 0.98, "Opacity at birth."}, opacity);
  v.value({"min_transmittance", "", 0.0, 1.0,
           "Cells and features that the map leaves more transparent than this are seeded …"},
          min_transmittance);
  v.value({"min_color_error", "", 0.0, 3.0, "… and those whose mean colour is off by more (squared, all channels)."},
          min_color_error);
  v.value({"min_depth_error", "", 0.0, 1.0,
           "… and those whose surface two pictures saw nearer than it is drawn, by more than this share."},
          min_depth_error);
  v.value({"consistency_tolerance", "", 0.0, 1.0,
           "They saw it both when their depths differ by at most this share; 0: depths are not compared."},
          consistency_tolerance);
  v.value({"feature_sigma_px", "px", 0.3, 20.0, "Standard deviation of a gaussian at an inactive feature."},
          feature_sigma_px);
  v.value({"feature_color_error", "", 0.0, 3.0,
           "Features that the map covers and whose pixel is off by less are not seeded."},
          feature_color_error);
}

CellSeeds seed_cells(const SeedingOptions& options, const DepthPicture& view, const splatting::RenderResult& render,
                     const SeedingRound& round) {
  if (!options.dense) return {};
  CellGrid grid = summarize(view, render, round.cell);
  if (round.fills_holes && view.depth.empty()) take_drawn_depth(options, grid);
  fill_missing_depth(grid);

  CellSeeds seeds;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Cell& cell = grid.at(column, row);
      if (!(cell.depth > 0) || !cell.has_data) continue;
      const bool uncovered = cell.transmittance > options.min_transmittance;
      const bool wrong_color = cell.color_error > round.min_color_error;
      const bool wrong = cell.measured && (wrong_color || is_drawn_too_far(options, round.confirmed, render, cell));
      if (!uncovered && !wrong) continue;
      const double sigma = options.sigma_cells * round.cell * cell.depth / view.camera.fx;
      (cell.measured ? seeds.measured : seeds.guessed)
          .push_back(make_disc(options, view.camera.unproject(cell.center(), cell.depth),
                               surface_normal(grid, view.camera, column, row), sigma, cell.color));
    }
  }
  return seeds;
}

double unexplained_share(const SeedingOptions& options, const DepthPicture& view, const splatting::RenderResult& render,
                         int cell_size) {
  int with_data = 0, unexplained = 0;
  for (const Cell& cell : summarize(view, render, cell_size).cells) {
    if (!cell.has_data) continue;
    ++with_data;
    unexplained += cell.transmittance > options.min_transmittance || cell.color_error > options.min_color_error;
  }
  return with_data > 0 ? static_cast<double>(unexplained) / with_data : 0;
}

std::vector<splatting::Gaussian> seed_features(const SeedingOptions& options, const DepthPicture& view, int factor,
                                               const splatting::RenderResult& render,
                                               std::span<const DepthPixel> features) {
  const size_t plane = static_cast<size_t>(view.camera.width) * static_cast<size_t>(view.camera.height);
  std::vector<splatting::Gaussian> seeds;
  for (const DepthPixel& feature : features) {
    if (!(feature.active ? options.active_features : options.inactive_features)) continue;
    const Vec2 pixel((static_cast<double>(feature.x) + 0.5) / factor - 0.5,
                     (static_cast<double>(feature.y) + 0.5) / factor - 0.5);
    const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
    if (x < 0 || y < 0 || x >= view.camera.width || y >= view.camera.height) continue;
    const size_t i = static_cast<size_t>(y) * static_cast<size_t>(view.camera.width) + static_cast<size_t>(x);
    if (!view.has_data(i)) continue;
    const Vec3 color = pixel_color(view.color, x, y);
    const Vec3 rendered(static_cast<double>(render.rgb[i]), static_cast<double>(render.rgb[plane + i]),
                        static_cast<double>(render.rgb[2 * plane + i]));
    const bool uncovered = 1.0 - static_cast<double>(render.alpha[i]) > options.min_transmittance;
    if (!uncovered && (rendered - color).squaredNorm() < options.feature_color_error) continue;
    const auto depth = static_cast<double>(feature.depth);
    const Vec3 mean = view.camera.unproject(pixel, depth);
    const double sigma = options.feature_sigma_px / factor * depth / view.camera.fx;
    seeds.push_back(make_disc(options, mean, -mean.normalized(), sigma, color));
  }
  return seeds;
}

}  // namespace photoslam
