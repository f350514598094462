// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "base/options.h"
#include "base/random.h"

namespace photoslam {

class Archive;

struct ScheduleOptions {
  int pyramid_levels = 2;
  int uses_per_level = 4;
  int online_level = 1;
  double newest_probability = 0.2;
  void visit(OptionVisitor& visitor);
};

/// Which keyframe is trained next, and on which level of its pyramid (paper, Sec. 3.4, Eq. 5).
///
/// Each keyframe starts at the coarsest level n = pyramid_levels and moves down one level every uses_per_level uses,
/// until it reaches the finest one allowed: online_level while frames arrive, the full image in refinement.
class KeyframeSchedule {
 public:
  struct Choice {
    int view = 0;   ///< Index of the keyframe in order of arrival.
    int level = 0;  ///< 0 is the full resolution; level l is shrunk by 2^l.
  };

  KeyframeSchedule(const ScheduleOptions& options, uint64_t seed) : options_(options), random_(seed) {}

  void add_view() { uses_.push_back(0); }
  int num_views() const { return static_cast<int>(uses_.size()); }

  /// The next view; there must be one. Views take turns at random, each once per round; the newest one also comes in
  /// between with newest_probability while online.
  Choice next(bool refining);

  int uses(int view) const { return uses_[static_cast<size_t>(view)]; }
  void serialize(Archive& archive);

 private:
  int draw();

  ScheduleOptions options_;
  Random random_;
  std::vector<int> uses_;
  std::vector<int> round_;  // views still to come in this round
};

}  // namespace photoslam
