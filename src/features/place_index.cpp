// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "features/place_index.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/check.h"
#include "base/random.h"

namespace photoslam {
namespace {

/// Differing bits of the 32 in a signature up to which two descriptors count as similar: chance gives 16 ± 3, the same
/// corner seen again (one bit in eight flipped) 4 ± 2.
constexpr int kMaxSignatureDistance = 6;

template <size_t N>
uint32_t gather_bits(const Descriptor& descriptor, const std::array<uint8_t, N>& bits) {
  uint32_t value = 0;
  for (const uint8_t bit : bits) value = (value << 1) | ((descriptor[bit / 64] >> (bit % 64)) & 1);
  return value;
}

}  // namespace

std::vector<Descriptor> strongest_descriptors(const Features& features) {
  constexpr size_t kCount = 300;
  std::vector<size_t> order(features.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const size_t count = std::min(kCount, order.size());
  std::ranges::partial_sort(order, order.begin() + static_cast<std::ptrdiff_t>(count), [&](size_t a, size_t b) {
    const float ra = features.keypoints[a].response, rb = features.keypoints[b].response;
    return ra != rb ? ra > rb : a < b;
  });
  std::vector<Descriptor> descriptors;
  for (size_t i = 0; i < count; ++i) descriptors.push_back(features.descriptors[order[i]]);
  return descriptors;
}

PlaceIndex::PlaceIndex() {
  // The keys of different tables share no bit; the signature of a table shares none with its key.
  static_assert(kTables * kKeyBits + 32 <= 256);
  std::array<uint8_t, 256> order;
  for (size_t i = 0; i < order.size(); ++i) order[i] = static_cast<uint8_t>(i);
  Random random(14);
  for (size_t i = order.size() - 1; i > 0; --i) {
    std::swap(order[i], order[static_cast<size_t>(random.index(static_cast<int>(i + 1)))]);
  }
  for (size_t t = 0; t < kTables; ++t) {
    Table& table = tables_[t];
    const size_t begin = t * kKeyBits, end = begin + kKeyBits;
    for (size_t i = 0; i < kKeyBits; ++i) table.key_bits[i] = order[begin + i];
    for (size_t i = 0; i < 32; ++i) table.signature_bits[i] = order[(end + i) % order.size()];
    table.buckets.resize(size_t{1} << kKeyBits);
  }
}

void PlaceIndex::add(int place, std::span<const Descriptor> descriptors) {
  PHOTOSLAM_CHECK(place >= 0, "{}", place);
  if (descriptors.empty()) return;
  const auto p = static_cast<size_t>(place);
  if (p >= keys_.size()) {
    keys_.resize(p + 1);
    visited_.resize(p + 1, 0);
    score_.resize(p + 1, 0);
  }
  num_places_ += keys_[p].empty();
  for (const Descriptor& descriptor : descriptors) {
    Keys& keys = keys_[p].emplace_back();
    for (size_t t = 0; t < kTables; ++t) {
      Table& table = tables_[t];
      keys[t] = static_cast<uint16_t>(gather_bits(descriptor, table.key_bits));
      table.buckets[keys[t]].push_back({place, gather_bits(descriptor, table.signature_bits)});
    }
  }
}

void PlaceIndex::remove(int place) {
  const auto p = static_cast<size_t>(place);
  if (place < 0 || p >= keys_.size() || keys_[p].empty()) return;
  --num_places_;
  for (const Keys& keys : std::exchange(keys_[p], {})) {
    for (size_t t = 0; t < kTables; ++t) {
      std::erase_if(tables_[t].buckets[keys[t]], [place](const Entry& e) { return e.place == place; });
    }
  }
}

void PlaceIndex::find_similar(const Descriptor& descriptor) {
  similar_.clear();
  if (++visit_ == 0) {  // Wrapped around: marks of long ago would look new.
    std::fill(visited_.begin(), visited_.end(), 0);
    visit_ = 1;
  }
  for (const Table& table : tables_) {
    const uint32_t signature = gather_bits(descriptor, table.signature_bits);
    for (const Entry& entry : table.buckets[gather_bits(descriptor, table.key_bits)]) {
      if (std::popcount(entry.signature ^ signature) > kMaxSignatureDistance) continue;
      uint32_t& visited = visited_[static_cast<size_t>(entry.place)];
      if (visited == visit_) continue;
      visited = visit_;
      similar_.push_back(entry.place);
    }
  }
}

std::vector<PlaceCandidate> PlaceIndex::query(std::span<const Descriptor> descriptors, int count,
                                              const std::function<bool(int place)>& accept) {
  std::fill(score_.begin(), score_.end(), 0.0);
  for (const Descriptor& descriptor : descriptors) {
    find_similar(descriptor);
    if (similar_.empty()) continue;
    const double weight = std::log1p(static_cast<double>(num_places_) / static_cast<double>(similar_.size()));
    for (const int place : similar_) score_[static_cast<size_t>(place)] += weight;
  }
  std::vector<PlaceCandidate> candidates;
  for (size_t i = 0; i < score_.size(); ++i) {
    const int place = static_cast<int>(i);
    if (score_[i] > 0 && (!accept || accept(place))) candidates.push_back({place, score_[i]});
  }
  const auto better = [](const PlaceCandidate& a, const PlaceCandidate& b) {
    return a.score != b.score ? a.score > b.score : a.place < b.place;
  };
  const auto kept = std::min(candidates.size(), static_cast<size_t>(std::max(count, 0)));
  std::partial_sort(candidates.begin(), candidates.begin() + static_cast<ptrdiff_t>(kept), candidates.end(), better);
  candidates.resize(kept);
  return candidates;
}

}  // namespace photoslam
