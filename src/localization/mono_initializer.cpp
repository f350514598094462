// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/mono_initializer.h"

#include <fmt/format.h>

#include <cmath>

#include "math/median.h"

namespace photoslam {

void MonoInitializerOptions::visit(OptionVisitor& v) {
  v.value({"search_radius", "", 0.01, 1.0, "How far a point may move between the two views, in image widths."},
          search_radius);
  v.value({"min_matches", "", 10, 10000, "Matches that the first view keeps; with fewer another one is chosen."},
          min_matches);
  v.value({"max_gap_s", "s", 0.1, 100.0, "Longest time between the two views."}, max_gap_s);
  v.group("two_view", "Structure and motion from two views.", two_view);
}

std::optional<InitialPair> MonoInitializer::add(const std::shared_ptr<const FeatureFrame>& frame, std::string& reason) {
  const auto begin_with = [&](std::string why) {
    first_ = frame;
    expected_.clear();
    for (const PixelObservation& o : frame->observations) expected_.push_back(o.pixel);
    reason = std::move(why);
    return std::nullopt;
  };
  if (static_cast<int>(frame->size()) < options_.min_matches) {
    first_.reset();
    reason = "too little texture";
    return std::nullopt;
  }
  if (!first_) return begin_with("first view");
  const double gap_s = 1e-9 * static_cast<double>(frame->timestamp_ns - first_->timestamp_ns);
  if (gap_s > options_.max_gap_s) return begin_with("no parallax for long");
  const int count = match(*frame);
  if (count < options_.min_matches) return begin_with(fmt::format("only {} matches with the first view", count));

  std::vector<Vec2> pixels_a, pixels_b;
  std::vector<double> sigmas;
  for (const auto& [a, b] : matches_) {
    const PixelObservation& first = first_->observations[static_cast<size_t>(a)];
    const PixelObservation& second = frame->observations[static_cast<size_t>(b)];
    pixels_a.push_back(first.pixel);
    pixels_b.push_back(second.pixel);
    sigmas.push_back(1 / std::sqrt(std::min(first.inverse_variance, second.inverse_variance)));
  }
  const TwoViewResult views = reconstruct_two_views(options_.two_view, camera_, pixels_a, pixels_b, sigmas);
  if (!views.success) {
    reason = views.reason;
    return std::nullopt;
  }
  return refined(*frame, views, reason);
}

/// Fills `matches_`; keypoints are looked for around the place where they were last found.
int MonoInitializer::match(const FeatureFrame& frame) {
  std::vector<ProjectionQuery> queries(first_->size());
  for (size_t i = 0; i < queries.size(); ++i) {
    const Keypoint& keypoint = first_->features.keypoints[i];
    queries[i] = {.x = static_cast<float>(expected_[i].x()),
                  .y = static_cast<float>(expected_[i].y()),
                  .radius = static_cast<float>(options_.search_radius * camera_.width),
                  .min_octave = keypoint.octave - 1,
                  .max_octave = keypoint.octave + 1,
                  .angle = keypoint.angle,
                  .descriptor = first_->features.descriptors[i]};
  }
  MatchOptions match_options;
  match_options.max_distance = 50;
  match_options.max_ratio = 0.9;
  matcher_.match(match_options, {frame.features, frame.grid, {}, {}}, queries, keypoint_of_first_);
  matches_.clear();
  for (size_t i = 0; i < queries.size(); ++i) {
    if (keypoint_of_first_[i] == kNoMatch) continue;
    matches_.emplace_back(static_cast<int>(i), keypoint_of_first_[i]);
    expected_[i] = frame.observations[static_cast<size_t>(keypoint_of_first_[i])].pixel;
  }
  return static_cast<int>(matches_.size());
}

std::optional<InitialPair> MonoInitializer::refined(const FeatureFrame& frame, const TwoViewResult& views,
                                                    std::string& reason) {
  BundleProblem problem;
  problem.camera_from_world = {SE3{}, views.b_from_a};
  problem.pose_is_fixed = {1, 0};
  InitialPair pair{.first = first_, .second_from_first = {}, .points = {}};
  for (size_t i = 0; i < matches_.size(); ++i) {
    if (!views.good[i]) continue;
    const auto& [a, b] = matches_[i];
    const int point = static_cast<int>(pair.points.size());
    pair.points.push_back({a, b, views.points[i]});
    problem.points_in_world.push_back(views.points[i]);
    problem.observations.push_back({0, point, first_->observations[static_cast<size_t>(a)]});
    problem.observations.push_back({1, point, frame.observations[static_cast<size_t>(b)]});
  }
  adjuster_.solve({.max_iterations = 20}, camera_, 0, problem);

  std::vector<InitialPair::Point> kept;
  std::vector<double> depths;
  for (size_t i = 0; i < pair.points.size(); ++i) {
    constexpr double kMaxChi2 = 5.991;
    bool fits = true;
    for (size_t view = 0; view < 2; ++view) {
      fits = fits && reprojection_chi2(camera_, 0, problem.camera_from_world[view], problem.points_in_world[i],
                                       problem.observations[2 * i + view].pixel) <= kMaxChi2;
    }
    if (!fits) continue;
    kept.push_back(pair.points[i]);
    kept.back().in_first = problem.points_in_world[i];
    depths.push_back(kept.back().in_first.z());
  }
  if (static_cast<int>(kept.size()) < options_.two_view.min_points) {
    reason = "too few points after refinement";
    return std::nullopt;
  }
  const double unit = lower_median(depths);
  for (InitialPair::Point& point : kept) point.in_first /= unit;
  pair.points = std::move(kept);
  pair.second_from_first = problem.camera_from_world[1];
  pair.second_from_first.translation /= unit;
  return pair;
}

}  // namespace photoslam
