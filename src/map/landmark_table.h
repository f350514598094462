// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <unordered_map>
#include <utility>
#include <vector>

#include "map/landmark.h"

namespace photoslam {

/// The landmarks of a map by their ids, which are given out once and in order. The dead take no room, so a map that is
/// in use for a long time does not grow with all the landmarks it ever had.
class LandmarkTable {
 public:
  /// So many replacements are remembered, the newest: whoever still asks for an older one has missed thousands.
  static constexpr size_t kMaxReplacements = 16384;

  /// Gives out the next ids, for landmarks that are dead as yet; returns the first.
  LandmarkId give_out(size_t count);
  /// Ids given out.
  size_t size() const { return size_; }

  /// A landmark of an id that was given out.
  Landmark& insert(LandmarkId id);
  /// nullptr: dead.
  const Landmark* find(LandmarkId id) const;
  Landmark* find(LandmarkId id) { return const_cast<Landmark*>(std::as_const(*this).find(id)); }
  /// Those alive, in order.
  std::vector<LandmarkId> living() const;
  void bury(LandmarkId id) { living_.erase(id); }

  /// A dead landmark's observations are those of another one now. Returns the landmark whose replacement is forgotten
  /// for it; invalid: none.
  LandmarkId replace(LandmarkId id, LandmarkId by);
  /// Invalid: none, or forgotten.
  LandmarkId replacement(LandmarkId id) const;
  /// Those with a replacement, in the order in which they got it.
  const std::deque<LandmarkId>& replaced() const { return replaced_; }

 private:
  size_t size_ = 0;
  std::unordered_map<LandmarkId, Landmark> living_;
  std::unordered_map<LandmarkId, LandmarkId> replacements_;
  std::deque<LandmarkId> replaced_;
};

}  // namespace photoslam
