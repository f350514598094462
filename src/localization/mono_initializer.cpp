// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "localization/mono_initializer.h"

#include <fmt/format.h>

#include <cmath>

#include "math/median.h"

namespace photoslam {

namespace {

/// Whether two motions, each of a length of its own, are more than different estimates of the same one.
bool are_apart(const SE3& a, const SE3& b) {
  constexpr double kTurn = 0.01, kDirection = 0.95;  // [rad], cosine
  return so3_log(a.rotation * b.rotation.inverse()).norm() > kTurn ||
         a.translation.normalized().dot(b.translation.normalized()) < kDirection;
}

}  // namespace

void MonoInitializerOptions::visit(OptionVisitor& v) {
  v.value({"search_radius", "", 0.01, 1.0, "How far a point may move between the two views, in image widths."},
          search_radius);
  v.value({"min_matches", "", 10, 10000, "Matches that the first view keeps; with fewer another one is chosen."},
          min_matches);
  v.value({"max_gap_s", "s", 0.1, 100.0, "Longest time between the two views."}, max_gap_s);
  v.value({"min_score_lead", "", 0, 1,
           "Where two motions are possible, the share by which one must fit better than the other."},
          min_score_lead);
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
  std::vector<Refined> found;
  for (const TwoViewMotion& motion : views.motions) found.push_back(refined(*frame, motion));
  const auto best = std::ranges::max_element(found, {}, &Refined::score);
  for (const Refined& rival : found) {
    if (best->score - rival.score < options_.min_score_lead * best->score &&
        are_apart(best->pair.second_from_first, rival.pair.second_from_first)) {
      reason = "two motions are possible";
      return std::nullopt;
    }
  }
  if (static_cast<int>(best->pair.points.size()) < options_.two_view.min_points) {
    reason = "too few points after refinement";
    return std::nullopt;
  }
  return std::move(best->pair);
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

/// The motion and its points by bundle adjustment of both views, without what does not fit then.
MonoInitializer::Refined MonoInitializer::refined(const FeatureFrame& frame, const TwoViewMotion& motion) {
  BundleProblem problem;
  problem.camera_from_world = {SE3{}, motion.b_from_a};
  problem.pose_is_fixed = {1, 0};
  std::vector<InitialPair::Point> points;
  for (size_t i = 0; i < matches_.size(); ++i) {
    if (!motion.good[i]) continue;
    const auto& [a, b] = matches_[i];
    const int point = static_cast<int>(points.size());
    points.push_back({a, b, motion.points[i]});
    problem.points_in_world.push_back(motion.points[i]);
    problem.observations.push_back({0, point, first_->observations[static_cast<size_t>(a)]});
    problem.observations.push_back({1, point, frame.observations[static_cast<size_t>(b)]});
  }
  adjuster_.solve({.max_iterations = 20}, camera_, 0, problem);

  Refined result;
  result.pair.first = first_;
  std::vector<double> depths;
  for (size_t i = 0; i < points.size(); ++i) {
    constexpr double kMaxChi2 = 5.991;
    const auto chi2 = [&](size_t view) {
      return reprojection_chi2(camera_, 0, problem.camera_from_world[view], problem.points_in_world[i],
                               problem.observations[2 * i + view].pixel);
    };
    const double in_first = chi2(0), in_second = chi2(1);
    if (!(in_first <= kMaxChi2 && in_second <= kMaxChi2)) continue;
    result.score += 2 * kMaxChi2 - in_first - in_second;
    result.pair.points.push_back(points[i]);
    result.pair.points.back().in_first = problem.points_in_world[i];
    depths.push_back(problem.points_in_world[i].z());
  }
  if (depths.empty()) return result;
  const double unit = lower_median(depths);
  for (InitialPair::Point& point : result.pair.points) point.in_first /= unit;
  result.pair.second_from_first = problem.camera_from_world[1];
  result.pair.second_from_first.translation /= unit;
  return result;
}

}  // namespace photoslam
