// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "base/options.h"
#include "photorealistic_mapping/depth_picture.h"
#include "photorealistic_mapping/feature_depth.h"
#include "splatting/gaussian.h"
#include "splatting/renderer.h"

namespace photoslam {

struct SeedingOptions {
  bool dense = true;
  bool active_features = true;
  bool inactive_features = true;
  int cell_px = 6;
  double sigma_cells = 0.7;
  double thickness = 0.2;
  double max_stretch = 2.9;
  double opacity = 0.5;
  double min_transmittance = 0.5;
  double min_color_error = 0.10;
  double min_depth_error = 0.10;
  double consistency_tolerance = 0.05;
  double feature_sigma_px = 2.0;
  double feature_color_error = 0.05;
  void visit(OptionVisitor& visitor);
};

/// What one look at a picture is to find.
struct SeedingRound {
  int cell;                ///< Side of the cells, in pixels of the picture.
  double min_color_error;  ///< Cells are seeded whose mean colour is off by more (squared, all channels).
  /// In a picture without depth the holes of the map take the depth that is drawn around them. Not for what a new
  /// keyframe sees first, nor where a measurement was wanted and failed: what is open there is no hole.
  bool fills_holes = false;
  /// Depths of the picture that another picture agrees with [H, W], 0 elsewhere; empty: nobody was asked.
  ImageF confirmed = {};
};

/// What cells have become.
struct CellSeeds {
  std::vector<splatting::Gaussian> measured;
  std::vector<splatting::Gaussian> guessed;  ///< Their depth is borrowed.
};

/// New gaussians in the frame of the view's camera.
///
/// A cell of the image becomes one gaussian, a disc on the measured surface as large as its cell, where `render` (of
/// the present map, same camera) does not explain it: mostly transparent, or of another colour. A measurement before
/// what is drawn is a reason only where another picture confirms it: else, where the map looks right, it is more often
/// the measurement that is wrong.
/// Cells without depth take the nearest measured one, of several the farthest, and only where the map is transparent.
/// Cells without data in three quarters of their pixels are left out.
CellSeeds seed_cells(const SeedingOptions& options, const DepthPicture& view, const splatting::RenderResult& render,
                     const SeedingRound& round);

/// Share of the cells with data that `render` leaves mostly transparent or shows in another colour.
double unexplained_share(const SeedingOptions& options, const DepthPicture& view, const splatting::RenderResult& render,
                         int cell);

/// Geometry-based densification (paper, Sec. 3.3.1): gaussians at features, the places of complex texture, as large as
/// their pixel's footprint, where the render of the present map is mostly transparent or of another colour. `view` is
/// the full image shrunk by `factor`.
std::vector<splatting::Gaussian> seed_features(const SeedingOptions& options, const DepthPicture& view, int factor,
                                               const splatting::RenderResult& render,
                                               std::span<const DepthPixel> features);

}  // namespace photoslam
