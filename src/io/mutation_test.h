// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>

#include "base/random.h"

namespace photoslam {

/// A damaged copy of a file's content: one to four bytes changed, parts lost, doubled, exchanged or the end cut off.
inline std::string mutated(std::string content, Random& random) {
  const auto position = [&] { return static_cast<size_t>(random.index(static_cast<int>(content.size()) + 1)); };
  for (int i = random.index(4); i >= 0; --i) {
    const size_t at = position();
    const size_t length = std::min(content.size() - at, static_cast<size_t>(random.index(16) + 1));
    switch (random.index(6)) {
      case 0:
        for (size_t k = at; k < at + std::min<size_t>(length, 4); ++k) content[k] = static_cast<char>(random.next());
        break;
      case 1:
        if (at < content.size()) content[at] = static_cast<char>(content[at] ^ (1 << random.index(8)));
        break;
      case 2:
        content.erase(at, length);
        break;
      case 3:
        content.insert(position(), content.substr(at, length));
        break;
      case 4:
        std::swap_ranges(content.begin() + static_cast<std::ptrdiff_t>(at),
                         content.begin() + static_cast<std::ptrdiff_t>(at + length / 2),
                         content.begin() + static_cast<std::ptrdiff_t>(at + length / 2));
        break;
      default:
        if (random.index(4) == 0) content.resize(at);
    }
  }
  return content;
}

}  // namespace photoslam
