// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/landmark_table.h"

#include <algorithm>

#include "base/check.h"

namespace photoslam {

LandmarkId LandmarkTable::give_out(size_t count) {
  const LandmarkId first(static_cast<int32_t>(size_));
  size_ += count;
  return first;
}

Landmark& LandmarkTable::insert(LandmarkId id) {
  PHOTOSLAM_CHECK(id.valid() && static_cast<size_t>(id.value) < size_, "landmark {} of {}", id.value, size_);
  return living_[id];
}

const Landmark* LandmarkTable::find(LandmarkId id) const {
  const auto found = living_.find(id);
  return found == living_.end() ? nullptr : &found->second;
}

std::vector<LandmarkId> LandmarkTable::living() const {
  std::vector<LandmarkId> ids;
  ids.reserve(living_.size());
  for (const auto& [id, landmark] : living_) ids.push_back(id);
  std::ranges::sort(ids);
  return ids;
}

LandmarkId LandmarkTable::replace(LandmarkId id, LandmarkId by) {
  replacements_[id] = by;
  replaced_.push_back(id);
  if (replaced_.size() <= kMaxReplacements) return {};
  const LandmarkId forgotten = replaced_.front();
  replaced_.pop_front();
  replacements_.erase(forgotten);
  return forgotten;
}

LandmarkId LandmarkTable::replacement(LandmarkId id) const {
  const auto found = replacements_.find(id);
  return found == replacements_.end() ? LandmarkId{} : found->second;
}

}  // namespace photoslam
