// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "geometry/depth_sweep.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/check.h"
#include "geometry/sweep_kernels.h"

namespace photoslam {
namespace {

using internal::find_best_plane;
using internal::follow_path;
using internal::kCostScale;
using internal::kPlaneLanes;
using internal::kSignatureBits;
using internal::kSignatureRadius;
using internal::match_row;
using internal::SweepRow;

using Signatures = Image<uint32_t>;

/// One bit for each of the 24 neighbours: is it darker than the centre?
Signatures census(const ImageU8& grey) {
  Signatures result(grey.width(), grey.height());
  for (int y = kSignatureRadius; y < grey.height() - kSignatureRadius; ++y) {
    uint32_t* const target = result.row(y);
    for (int dy = -kSignatureRadius; dy <= kSignatureRadius; ++dy) {
      const uint8_t* const centre = grey.row(y);
      const uint8_t* const other = grey.row(y + dy);
      for (int dx = -kSignatureRadius; dx <= kSignatureRadius; ++dx) {
        if (dx == 0 && dy == 0) continue;
        for (int x = kSignatureRadius; x < grey.width() - kSignatureRadius; ++x) {
          target[x] = 2 * target[x] + (other[x + dx] < centre[x] ? 1u : 0u);
        }
      }
    }
  }
  return result;
}

/// Where pixel (x, y) of the reference at inverse depth w appears in a view: h = linear (x, y, 1) + w offset,
/// then divided by its third coordinate.
struct Transfer {
  Mat3 linear;
  Vec3 offset;
  Transfer(const PinholeCamera& reference, const SweepView& view) {
    Mat3 calibration, inverse;
    calibration << view.camera.fx, 0, view.camera.cx, 0, view.camera.fy, view.camera.cy, 0, 0, 1;
    inverse << 1 / reference.fx, 0, -reference.cx / reference.fx, 0, 1 / reference.fy, -reference.cy / reference.fy, 0,
        0, 1;
    linear = calibration * view.camera_from_reference.rotation.toRotationMatrix() * inverse;
    offset = calibration * view.camera_from_reference.translation;
  }
  Vec3 at(double x, double y, double w) const { return linear * Vec3(x, y, 1) + w * offset; }
};

/// The planes, and what each pixel pays for lying on each.
struct Sweep {
  double nearest = 0, farthest = 0;  // inverse depths of the last and of the first plane [1/m]
  int planes = 0;                    // a multiple of kPlaneLanes
  int width = 0, height = 0;
  std::vector<int16_t> cost;   // [H, W, planes] matching costs
  std::vector<int16_t> total;  // [H, W, planes] summed along the directions
  double inverse_depth(double plane) const { return farthest + (nearest - farthest) * plane / (planes - 1); }
  size_t at(int x, int y) const {
    return (static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)) * static_cast<size_t>(planes);
  }
};

/// The longest way that a pixel of a coarse grid travels through any view while the plane is swept [px].
double longest_path(const PinholeCamera& camera, std::span<const SweepView> views, double farthest, double nearest) {
  double longest = 0;
  for (const SweepView& view : views) {
    const Transfer transfer(camera, view);
    for (int i = 0; i < 9; ++i) {
      const double x = 0.5 * (i % 3) * (camera.width - 1), y = 0.5 * static_cast<int>(i / 3) * (camera.height - 1);
      const Vec3 far = transfer.at(x, y, farthest), near = transfer.at(x, y, nearest);
      if (far.z() <= 0 || near.z() <= 0) continue;
      longest = std::max(longest, (far.hnormalized() - near.hnormalized()).norm());
    }
  }
  return longest;
}

/// Row y of the reference, on its way into a view.
SweepRow sweep_row(const Transfer& transfer, const Signatures& signatures, int y) {
  SweepRow row{.signatures = signatures.row(0), .width = signatures.width(), .height = signatures.height()};
  const Vec3 start = transfer.linear * Vec3(0, y, 1);
  for (int i = 0; i < 3; ++i) {
    row.start[i] = static_cast<float>(start[i]);
    row.step[i] = static_cast<float>(transfer.linear(i, 0));
    row.offset[i] = static_cast<float>(transfer.offset[i]);
  }
  return row;
}

/// Sums path costs along `count` lines of `length` pixels: line i starts at (x0, y0) + i (lx, ly) and runs by (dx, dy).
struct Direction {
  int x0, y0, lx, ly, dx, dy, count, length;
};

void aggregate(Sweep& sweep, const Direction& direction, int16_t small_penalty, int16_t large_penalty,
               Executor& executor) {
  constexpr int16_t kNever = 8000;  // the planes beside the first and the last
  executor.for_each(direction.count, [&](int line, int) {
    const auto planes = static_cast<size_t>(sweep.planes);
    std::vector<int16_t> previous(planes + 2, 0), path(planes + 2, 0);
    previous.front() = previous.back() = path.front() = path.back() = kNever;
    int16_t least = 0;
    for (int i = 0; i < direction.length; ++i) {
      const int x = direction.x0 + line * direction.lx + i * direction.dx;
      const int y = direction.y0 + line * direction.ly + i * direction.dy;
      const size_t at = sweep.at(x, y);
      least = follow_path(sweep.planes, sweep.cost.data() + at, previous.data() + 1, least, small_penalty,
                          large_penalty, path.data() + 1, sweep.total.data() + at);
      std::swap(previous, path);
    }
  });
}

/// The best plane of each pixel, between planes by a parabola; negative where the match is poor or ambiguous.
ImageF choose_planes(const DepthSweepOptions& options, const Sweep& sweep, int num_directions) {
  const auto max_cost = static_cast<int16_t>(options.max_cost * kCostScale * kSignatureBits);
  const auto margin = static_cast<int16_t>(options.min_margin * kCostScale * kSignatureBits * num_directions);
  ImageF plane(sweep.width, sweep.height, 1, -1.0f);
  for (int y = kSignatureRadius; y < sweep.height - kSignatureRadius; ++y) {
    for (int x = kSignatureRadius; x < sweep.width - kSignatureRadius; ++x) {
      const int16_t* const total = sweep.total.data() + sweep.at(x, y);
      const auto [best, ambiguous] = find_best_plane(sweep.planes, total, margin);
      if (ambiguous || sweep.cost[sweep.at(x, y) + static_cast<size_t>(best)] > max_cost) continue;
      plane(x, y) = static_cast<float>(best);
      if (best == 0 || best == sweep.planes - 1) continue;
      const float before = total[best - 1], here = total[best], after = total[best + 1];
      const float curvature = before - 2 * here + after;
      if (curvature > 0) plane(x, y) += 0.5f * (before - after) / curvature;
    }
  }
  return plane;
}

/// Forgets pixels that every view either does not see or sees hidden behind a nearer one.
void forget_occluded(const Sweep& sweep, std::span<const SweepView> views, std::span<const Transfer> transfers,
                     ImageF& plane) {
  constexpr float kTolerance = 1.5f;  // planes
  ImageU8 visible(plane.width(), plane.height());
  for (size_t v = 0; v < views.size(); ++v) {
    ImageF nearest(views[v].camera.width, views[v].camera.height, 1, -1.0f);
    const auto for_each_pixel = [&](auto&& function) {
      for (int y = 0; y < plane.height(); ++y) {
        for (int x = 0; x < plane.width(); ++x) {
          if (plane(x, y) < 0) continue;
          const Vec3 h = transfers[v].at(x, y, sweep.inverse_depth(static_cast<double>(plane(x, y))));
          if (!(h.z() > 0) || !views[v].camera.contains(h.hnormalized())) continue;
          const Vec2 pixel = h.hnormalized();
          function(x, y, nearest(static_cast<int>(pixel.x() + 0.5), static_cast<int>(pixel.y() + 0.5)));
        }
      }
    };
    for_each_pixel([&](int x, int y, float& front) { front = std::max(front, plane(x, y)); });
    for_each_pixel([&](int x, int y, float& front) {
      if (plane(x, y) >= front - kTolerance) visible(x, y) = 1;
    });
  }
  for (size_t i = 0; i < plane.values().size(); ++i) {
    if (visible.values()[i] == 0) plane.values()[i] = -1.0f;
  }
}

}  // namespace

void DepthSweepOptions::visit(OptionVisitor& v) {
  v.value({"max_hypotheses", "", 16, 1024, "Planes at most; more are finer when the views are far apart."},
          max_hypotheses);
  v.value({"small_penalty", "", 0.0, 10.0, "Cost of a step to the neighbouring plane, in units of the worst match."},
          small_penalty);
  v.value({"large_penalty", "", 0.0, 10.0, "Cost of any larger step."}, large_penalty);
  v.value({"max_cost", "", 0.0, 1.0, "Share of differing signature bits above which a match is none."}, max_cost);
  v.value({"min_margin", "", 0.0, 1.0, "By how much the second best plane must be worse, per direction."}, min_margin);
}

ImageF sweep_depth(const DepthSweepOptions& options, const ImageU8& grey, const PinholeCamera& camera,
                   std::span<const SweepView> views, const DepthRange& range, Executor& executor) {
  PHOTOSLAM_CHECK(grey.channels() == 1 && grey.width() == camera.width && grey.height() == camera.height, "{}x{}x{}",
                  grey.width(), grey.height(), grey.channels());
  PHOTOSLAM_CHECK(range.nearest > 0 && range.farthest > range.nearest, "[{}, {}]", range.nearest, range.farthest);
  Sweep sweep;
  sweep.nearest = 1 / range.nearest;
  sweep.farthest = 1 / range.farthest;
  sweep.width = camera.width;
  sweep.height = camera.height;
  const double path = longest_path(camera, views, sweep.farthest, sweep.nearest);
  const int wanted = std::clamp(static_cast<int>(std::ceil(path)) + 1, 2, options.max_hypotheses);
  sweep.planes = (wanted + kPlaneLanes - 1) / kPlaneLanes * kPlaneLanes;
  ImageF depth(camera.width, camera.height);
  if (path < 2) return depth;  // nothing can be told apart

  std::vector<Signatures> signatures;
  std::vector<Transfer> transfers;
  for (const SweepView& view : views) {
    signatures.push_back(census(*view.grey));
    transfers.emplace_back(camera, view);
  }
  const Signatures reference = census(grey);
  sweep.cost.resize(sweep.at(0, sweep.height));
  sweep.total.assign(sweep.cost.size(), 0);
  std::vector<float> inverse_depths;
  for (int k = 0; k < sweep.planes; ++k) inverse_depths.push_back(static_cast<float>(sweep.inverse_depth(k)));
  executor.for_each(sweep.height, [&](int y, int) {
    std::vector<SweepRow> rows;
    for (size_t v = 0; v < transfers.size(); ++v) rows.push_back(sweep_row(transfers[v], signatures[v], y));
    match_row(reference.row(y), sweep.width, inverse_depths, rows, sweep.cost.data() + sweep.at(0, y));
  });

  const int w = sweep.width, h = sweep.height;
  const Direction directions[] = {
      {0, 0, 0, 1, 1, 0, h, w}, {w - 1, 0, 0, 1, -1, 0, h, w}, {0, 0, 1, 0, 0, 1, w, h}, {0, h - 1, 1, 0, 0, -1, w, h}};
  const auto penalty = [](double share) {
    return static_cast<int16_t>(std::lround(share * kCostScale * kSignatureBits));
  };
  for (const Direction& direction : directions) {
    aggregate(sweep, direction, penalty(options.small_penalty), penalty(options.large_penalty), executor);
  }
  ImageF plane = choose_planes(options, sweep, static_cast<int>(std::size(directions)));
  forget_occluded(sweep, views, transfers, plane);
  for (size_t i = 0; i < plane.values().size(); ++i) {
    const float p = plane.values()[i];
    if (p > 0) depth.values()[i] = static_cast<float>(1 / sweep.inverse_depth(static_cast<double>(p)));
  }
  return depth;
}

}  // namespace photoslam
