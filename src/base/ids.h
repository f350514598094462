// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstdint>
#include <functional>

namespace photoslam {

/// An integer that names one kind of thing; ids of different kinds do not mix. Negative means "none".
template <class Tag>
struct Id {
  int32_t value = -1;

  constexpr Id() = default;
  constexpr explicit Id(int32_t v) : value(v) {}
  constexpr bool valid() const { return value >= 0; }
  constexpr auto operator<=>(const Id&) const = default;
};

using FrameId = Id<struct FrameTag>;        ///< Index of an input frame in its sequence.
using KeyframeId = Id<struct KeyframeTag>;  ///< Creation order of keyframes.
using LandmarkId = Id<struct LandmarkTag>;  ///< Creation order of landmarks.

}  // namespace photoslam

template <class Tag>
struct std::hash<photoslam::Id<Tag>> {
  std::size_t operator()(photoslam::Id<Tag> id) const noexcept { return std::hash<int32_t>{}(id.value); }
};
