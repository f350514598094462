// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

#include "map/landmark.h"

namespace photoslam {

/// Views of kSize consecutive landmark ids. Dead ones take no room, so a map in use for a long time does not grow with
/// all the landmarks it ever had.
class LandmarkChunk {
 public:
  static constexpr int kSize = 256;

  /// In ascending order of slots, each at most once.
  void add(int slot, const LandmarkView& view) {
    alive_[word(slot)] |= bit(slot);
    for (size_t later = word(slot) + 1; later < kWords; ++later) ++before_[later];
    views_.push_back(view);
  }
  /// The landmark has died; another one has taken over its observations.
  void replace(int slot, LandmarkId by) { replaced_.emplace_back(slot, by); }

  bool empty() const { return views_.empty() && replaced_.empty(); }

  /// nullptr: dead.
  const LandmarkView* find(int slot) const {
    const uint64_t bits = alive_[word(slot)];
    if (!(bits & bit(slot))) return nullptr;
    return &views_[before_[word(slot)] + static_cast<size_t>(std::popcount(bits & (bit(slot) - 1)))];
  }
  /// Invalid: none.
  LandmarkId replacement(int slot) const {
    for (const auto& [dead, by] : replaced_) {
      if (dead == slot) return by;
    }
    return {};
  }

 private:
  static constexpr size_t kWords = kSize / 64;
  static size_t word(int slot) { return static_cast<size_t>(slot) / 64; }
  static uint64_t bit(int slot) { return uint64_t{1} << (slot % 64); }

  std::array<uint64_t, kWords> alive_{};   // a bit per slot
  std::array<uint16_t, kWords> before_{};  // living ones in the words before
  std::vector<LandmarkView> views_;        // of the living, by slot
  std::vector<std::pair<int, LandmarkId>> replaced_;
};

}  // namespace photoslam
