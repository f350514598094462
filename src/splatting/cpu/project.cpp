// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "splatting/cpu/project.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/check.h"
#include "splatting/cpu/targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "splatting/cpu/project.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "splatting/cpu/colors-inl.h"
#include "splatting/cpu/lanes-inl.h"
#include "splatting/formulas.h"

#ifndef PHOTOSLAM_SPLATTING_PROJECT_ONCE
#define PHOTOSLAM_SPLATTING_PROJECT_ONCE
namespace photoslam::splatting {

/// Tiles of the bounding boxes of a block's splats, inclusive.
struct TileBoxes {
  alignas(64) int32_t left[kBlockSize], right[kBlockSize], top[kBlockSize], bottom[kBlockSize];
};

}  // namespace photoslam::splatting
#endif

HWY_BEFORE_NAMESPACE();
namespace photoslam::splatting::HWY_NAMESPACE {

inline constexpr int kSplatRows = 15;
using SplatRows = float[kSplatRows][kBlockSize];
enum SplatRow { kRgb = 6 };

/// Projects one vector of gaussians: everything of a splat but its colours, the tiles of its bounding box, and the
/// basis functions for the colours. Returns the lanes whose box holds a pixel centre. Not-a-number fails every
/// comparison, so garbage never passes.
HWY_INLINE Mask project_lanes(const Block& block, const AnchorView& view, int width, int height, int degree,
                              size_t lane, SplatRows& rows, TileBoxes& boxes, ShBasis& basis) {
  Lanes mean[3], rotation[4], log_scale[3];
  for (int i = 0; i < 3; ++i) mean[i] = load(block.parameters[row::kMean + i] + lane);
  for (int i = 0; i < 4; ++i) rotation[i] = load(block.parameters[row::kRotation + i] + lane);
  for (int i = 0; i < 3; ++i) log_scale[i] = load(block.parameters[row::kLogScale + i] + lane);
  Projection<Lanes> g;
  project(view, mean, rotation, log_scale, g);

  const Lanes logit = load(block.parameters[row::kOpacity] + lane);
  const Lanes log2_opacity = -logarithm2(flattening(g) * (Lanes(1.0f) + exponential(minimum(-logit, Lanes(80.0f)))));
  const Lanes cut = log2_opacity + Lanes(kLog2Cut);
  const Lanes radius2 = cut * Lanes(2.0f * 0.6931471805599453f);
  const Lanes extent_x = square_root(radius2 * g.a), extent_y = square_root(radius2 * g.c);
  const Lanes inv_c = Lanes(1.0f) / g.c, inv_det = Lanes(1.0f) / g.det;
  const Lanes half_log2e(0.5f * 1.4426950408889634f);

  // First and last pixel of the box, inside the image.
  const Lanes zero(0.0f), absurd(kAbsurd);
  const Lanes left = hn::Ceil(maximum(g.u - extent_x, zero).v), top = hn::Ceil(maximum(g.v - extent_y, zero).v);
  const Lanes right = hn::Floor(minimum(g.u + extent_x, Lanes(static_cast<float>(width - 1))).v);
  const Lanes bottom = hn::Floor(minimum(g.v + extent_y, Lanes(static_cast<float>(height - 1))).v);
  LaneMask ok = (g.p[2] > Lanes(view.near)) & (g.p[2] < absurd) & (cut > zero) & (g.a < absurd) & (g.c < absurd) &
                (g.inv_norm > Lanes(1.0f / kAbsurd)) & (absolute(log_scale[0]) < absurd) &
                (absolute(log_scale[1]) < absurd) & (absolute(log_scale[2]) < absurd) & (g.det > zero) &
                (inv_det > zero) & (left <= right) & (top <= bottom) & (right >= zero) & (bottom >= zero);
  const size_t rest = static_cast<size_t>(block.count) - lane;
  ok = ok & LaneMask{hn::FirstN(kFloats, std::min(rest, kLanes))};
  if (hn::AllFalse(kFloats, ok.m)) return ok.m;

  constexpr Ints ints;
  static_assert(kTileSize == 32);
  const auto tile = [&](Lanes pixel)
                        HWY_ATTR { return hn::ShiftRight<5>(hn::ConvertTo(ints, hn::IfThenElseZero(ok.m, pixel.v))); };
  hn::Store(tile(left), ints, boxes.left + lane);
  hn::Store(tile(right), ints, boxes.right + lane);
  hn::Store(tile(top), ints, boxes.top + lane);
  hn::Store(tile(bottom), ints, boxes.bottom + lane);

  store(g.u, rows[0] + lane);
  store(g.v, rows[1] + lane);
  store(g.b * inv_c, rows[2] + lane);
  store(-half_log2e * g.c * inv_det, rows[3] + lane);
  store(-half_log2e * inv_c, rows[4] + lane);
  store(log2_opacity, rows[5] + lane);
  store(g.p[2], rows[9] + lane);
  store(cut, rows[10] + lane);
  store(g.det * inv_c / half_log2e, rows[11] + lane);
  store(g.b * extent_x / g.a, rows[12] + lane);
  store(extent_x, rows[13] + lane);
  store(extent_y, rows[14] + lane);
  Lanes direction[3], functions[kNumShCoefficients];
  normalize(g.offset, direction);
  sh_basis(degree, direction, functions);
  for (int k = 0; k < num_sh_coefficients(degree); ++k) store(functions[k], basis[k] + lane);
  return ok.m;
}

/// Projects one block into `splats` [64]; returns the lanes whose ellipse may touch a pixel. Fetches what the next
/// block (or null) will need first.
uint64_t project_block(const Block& block, const AnchorView& view, int width, int height, int degree, const Block* next,
                       Splat* splats, TileBoxes& boxes) {
  alignas(64) SplatRows rows;
  alignas(64) ShBasis basis;
  Mask masks[kBlockSize / kLanes];
  uint32_t parts = 0;
  for (size_t i = 0; i < kBlockSize / kLanes; ++i) {
    masks[i] = hn::FirstN(kFloats, 0);
    if (static_cast<int>(i * kLanes) >= block.count) continue;
    for (int r = 0; r < row::kSh; ++r) prefetch_row(block, next, row::kSh + 3 * num_sh_coefficients(degree), r, i);
    masks[i] = project_lanes(block, view, width, height, degree, i * kLanes, rows, boxes, basis);
    parts |= static_cast<uint32_t>(!hn::AllFalse(kFloats, masks[i])) << i;
  }
  if (parts == 0) return 0;
  block_colors(block, next, basis, degree, parts, rows + kRgb);

  uint64_t visible = 0;
  const Lanes absurd(kAbsurd);
  for (size_t i = 0; i < kBlockSize / kLanes; ++i) {
    if (((parts >> i) & 1) == 0) continue;
    LaneMask ok{masks[i]};
    for (size_t c = 0; c < 3; ++c) {
      float* at = rows[kRgb + c] + i * kLanes;
      ok = ok & (absolute(load(at)) < absurd);
      store(maximum(load(at), Lanes(0.0f)), at);
    }
    uint8_t bits[8] = {};
    hn::StoreMaskBits(kFloats, ok.m, bits);
    visible |= static_cast<uint64_t>(bits[0] | (bits[1] << 8)) << (i * kLanes);
  }
  for (uint64_t rest = visible; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    float* splat = &splats[lane].u;
    for (int i = 0; i < kSplatRows; ++i) splat[i] = rows[i][lane];
  }
  return visible;
}

}  // namespace photoslam::splatting::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace photoslam::splatting {
namespace {

HWY_EXPORT(project_block);

/// Can any gaussian of the block touch a pixel? With s the largest deviation and the Jacobian bounded by its clamp, a
/// splat reaches at most 3.33 (f/z sqrt(1 + clamp²) s + sqrt(0.3)) px beyond its centre, less in shrunk pictures, so
/// each image border is a plane in camera space.
bool block_in_view(const Block& block, const AnchorView& view, const Frame& frame) {
  float d[3], p[3];
  for (int i = 0; i < 3; ++i) d[i] = (block.center[i] - view.center[i]) - view.center_low[i];
  for (int i = 0; i < 3; ++i)
    p[i] = view.rotation[3 * i] * d[0] + view.rotation[3 * i + 1] * d[1] + view.rotation[3 * i + 2] * d[2];
  const float radius = block.radius * 1.0001f;
  if (p[2] + radius <= view.near) return false;
  constexpr float kReach = 3.331f, kMargin = 2.0f;
  const auto outside = [&](float f, float center, float size, float position, float low, float high) {
    const float bound = std::max(std::abs(low), std::abs(high));
    const float reach = kReach * f * std::sqrt(1 + bound * bound) * block.max_scale;
    const float before = center + kMargin, after = size - 1 - center + kMargin;
    return f * position + before * p[2] + reach + radius * std::hypot(f, before) < 0 ||
           -f * position + after * p[2] + reach + radius * std::hypot(f, after) < 0;
  };
  return !outside(view.fx, view.cx, static_cast<float>(frame.width), p[0], view.min_x, view.max_x) &&
         !outside(view.fy, view.cy, static_cast<float>(frame.height), p[1], view.min_y, view.max_y);
}

/// Appends the tiles with a pixel inside the splat's cut ellipse, row by row.
void append_tiles(const Splat& s, const Frame& frame, const TileBoxes& boxes, size_t lane,
                  std::vector<uint32_t>& tiles) {
  const int left = boxes.left[lane], right = boxes.right[lane], top = boxes.top[lane], bottom = boxes.bottom[lane];
  const bool one_column = left == right, one_row = top == bottom;
  for (int ty = top; ty <= bottom; ++ty) {
    int from = left, to = right;
    if (!one_column && !one_row) {
      // The span of the ellipse over the tile's rows of pixel centres.
      const float low = std::max(static_cast<float>(ty * kTileSize) - s.v, -s.extent_y);
      const float high = std::min(static_cast<float>(ty * kTileSize + kTileSize - 1) - s.v, s.extent_y);
      const auto edge = [&](float side) {
        const float dy = std::clamp(side * s.peak_dy, low, high);
        const float x =
            s.u + s.slope * dy + side * (std::sqrt(std::max(0.0f, (s.cut + s.kc * dy * dy) * s.inv_ka)) + 1e-3f);
        return std::clamp(x, -1.0f, static_cast<float>(frame.width - 1));
      };
      // Conversion truncates; the library's ceiling and floor are slow.
      const float begin = std::max(edge(-1), 0.0f);
      const int truncated = static_cast<int>(begin);
      from = std::max(left, (truncated + (begin > static_cast<float>(truncated) ? 1 : 0)) / kTileSize);
      to = std::min(right, (static_cast<int>(edge(1) + 1.0f) - 1) / kTileSize);
    }
    for (int tx = from; tx <= to; ++tx) tiles.push_back(static_cast<uint32_t>(ty * frame.tiles_x + tx));
  }
}

void project_rank(const GaussianModel& model, Frame& frame, size_t rank, std::vector<uint32_t>& tiles) {
  const Block& block = model.block(frame.blocks[rank]);
  const Block* next = rank + 1 < frame.blocks.size() ? &model.block(frame.blocks[rank + 1]) : nullptr;
  const AnchorView& view = frame.anchors[static_cast<size_t>(block.anchor)];
  Splat* splats = &frame.splats[rank * kBlockSize];
  TileBoxes boxes;
  const uint64_t candidates =
      HWY_DYNAMIC_DISPATCH(project_block)(block, view, frame.width, frame.height, frame.sh_degree, next, splats, boxes);
  uint64_t visible = 0;
  for (uint64_t rest = candidates; rest != 0; rest &= rest - 1) {
    const size_t lane = static_cast<size_t>(std::countr_zero(rest));
    const size_t first = tiles.size();
    append_tiles(splats[lane], frame, boxes, lane, tiles);
    if (tiles.size() == first) continue;
    visible |= uint64_t{1} << lane;
    frame.instances[rank * kBlockSize + lane] = {static_cast<uint32_t>(first),
                                                 static_cast<uint32_t>(tiles.size() - first)};
  }
  frame.visible[rank] = visible;
}

}  // namespace

void project_model(const GaussianModel& model, const View& view, const RenderOptions& options, Executor& executor,
                   Frame& frame) {
  PHOTOSLAM_CHECK(view.camera.width >= 1 && view.camera.height >= 1, "{}x{}", view.camera.width, view.camera.height);
  PHOTOSLAM_CHECK(view.camera_from_anchor.size() >= static_cast<size_t>(model.num_anchors()), "{} poses, {} anchors",
                  view.camera_from_anchor.size(), model.num_anchors());
  frame.width = view.camera.width;
  frame.height = view.camera.height;
  frame.tiles_x = (frame.width + kTileSize - 1) / kTileSize;
  frame.tiles_y = (frame.height + kTileSize - 1) / kTileSize;
  frame.sh_degree = std::clamp(std::min(options.sh_degree, model.sh_degree()), 0, kMaxShDegree);
  std::copy_n(options.background, 3, frame.background);
  frame.anchors.clear();
  for (const Pose& pose : view.camera_from_anchor)
    frame.anchors.push_back(make_anchor_view(pose, view.camera, options));

  frame.blocks.clear();
  for (size_t b = 0; b < model.num_blocks(); ++b) {
    const Block& block = model.block(b);
    if (block_in_view(block, frame.anchors[static_cast<size_t>(block.anchor)], frame))
      frame.blocks.push_back(static_cast<uint32_t>(b));
  }
  frame.visible.assign(frame.blocks.size(), 0);
  frame.splats.reserve(frame.blocks.size() * kBlockSize);
  frame.instances.reserve(frame.blocks.size() * kBlockSize);
  if (frame.task_tiles.size() < static_cast<size_t>(frame.num_tasks()))
    frame.task_tiles.resize(static_cast<size_t>(frame.num_tasks()));
  executor.for_each(frame.num_tasks(), [&](int task, int) {
    std::vector<uint32_t>& tiles = frame.task_tiles[static_cast<size_t>(task)];
    tiles.clear();
    const int end = std::min((task + 1) * kBlocksPerTask, frame.num_ranks());
    for (int rank = task * kBlocksPerTask; rank < end; ++rank)
      project_rank(model, frame, static_cast<size_t>(rank), tiles);
  });
}

}  // namespace photoslam::splatting
#endif  // HWY_ONCE
