// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/options.h"
#include "base/random.h"

namespace photoslam {

class Archive;

struct ScheduleOptions {
  int pyramid_levels = 3;
  int start_pixels = 130000;
  int uses_per_level = 4;
  int online_pixels = 130000;
  int online_uses = 32;
  double newest_probability = 0.2;
  double worse_probability = 0;
  double seam_px = 2.0;
  int seam_uses = 10;
  void visit(OptionVisitor& visitor);
};

/// Which keyframe is trained next, and on which level of its pyramid (paper, Sec. 3.4, Eq. 5).
///
/// Each keyframe starts at the coarsest level n and moves down one level every uses_per_level uses, until it reaches
/// the finest one allowed: the full image in refinement, less while frames arrive where that is too costly. What counts
/// is how large the pictures are, so the levels follow from that. When online_uses have taught what a smaller picture
/// can teach, the next finer level is allowed while frames arrive, too. Keyframes at which a correction of the map left
/// a seam go before all others, but in turns with the newest one until that has been used uses_per_level times on each
/// level there is while frames arrive.
class KeyframeSchedule {
 public:
  struct Choice {
    int view = 0;   ///< Index of the keyframe in order of arrival.
    int level = 0;  ///< 0 is the full resolution; level l is shrunk by 2^l.
  };

  KeyframeSchedule(const ScheduleOptions& options, int width, int height, uint64_t seed);

  /// n in Eq. (5).
  int coarsest_level() const { return coarsest_level_; }
  /// The finest one while frames arrive, at first.
  int online_level() const { return online_level_; }

  void add_view();
  /// This view does not come again.
  void retire(int view);
  /// Adds all views of another, used as often as they were.
  void append(const KeyframeSchedule& other);
  int num_views() const { return static_cast<int>(uses_.size()); }
  /// Those that are not retired, in order of arrival.
  std::span<const int> active() const { return active_; }

  /// These views, but those that are retired, come seam_uses times each before the others go on.
  void revisit(std::span<const int> views);
  bool is_revisiting() const { return !revisits_.empty(); }

  /// The next view; there must be one. Views take turns at random, each once per round. In between comes, with
  /// newest_probability while online, the newest, and with worse_probability the one of larger loss out of two.
  Choice next(bool refining);
  /// What the training of a view came to.
  void report(int view, double loss) { losses_[static_cast<size_t>(view)] = loss; }

  int uses(int view) const { return uses_[static_cast<size_t>(view)]; }
  void serialize(Archive& archive);

 private:
  int draw();
  int draw_worse();
  int take(std::vector<int>& views);
  bool newest_is_due() const;

  ScheduleOptions options_;
  int coarsest_level_, online_level_;
  Random random_;
  std::vector<int> uses_;
  std::vector<double> losses_;  // as last reported; views not trained yet come first
  std::vector<int> active_;
  std::vector<int> round_;     // views still to come in this round
  std::vector<int> revisits_;  // views that go before them, each as often as it is to come
  bool newest_came_last_ = false;
};

}  // namespace photoslam
