// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "map/connected_components.h"

#include <algorithm>

namespace photoslam {

std::vector<int> connected_components(const MapSnapshot& map) {
  // Union-find; the root of a part is its first keyframe.
  std::vector<size_t> root(map.keyframes.size());
  for (size_t i = 0; i < root.size(); ++i) root[i] = i;
  const auto find = [&root](size_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  const auto connect = [&](size_t i, KeyframeId other) {
    if (!map.has(other)) return;
    const size_t a = find(i), b = find(static_cast<size_t>(other.value));
    root[std::max(a, b)] = std::min(a, b);
  };
  for (size_t i = 0; i < root.size(); ++i) {
    connect(i, map.keyframes[i]->keyframe.parent);
    for (const CovisibleKeyframe& neighbour : map.keyframes[i]->covisible) connect(i, neighbour.keyframe);
  }
  std::vector<int> component(root.size(), -1);
  int count = 0;
  for (size_t i = 0; i < root.size(); ++i) {
    const size_t r = find(i);
    if (component[r] < 0) component[r] = count++;
    component[i] = component[r];
  }
  return component;
}

}  // namespace photoslam
