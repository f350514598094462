// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

#include "base/archive.h"
#include "image/image.h"

namespace photoslam {

/// Archives an image without loss in a form that general compression makes small: values as differences to the mean of
/// their left and upper neighbours, bytes of equal significance together. The bits of floating-point values are taken
/// as integers.
template <class T>
void serialize_image(Archive& archive, Image<T>& image) {
  using Word = std::conditional_t<sizeof(T) == 1, uint8_t, std::conditional_t<sizeof(T) == 2, uint16_t, uint32_t>>;
  static_assert(sizeof(Word) == sizeof(T));
  int width = image.width(), height = image.height(), channels = image.channels();
  archive(width, height, channels);
  if (archive.reading()) image = width > 0 ? Image<T>(width, height, channels) : Image<T>();
  const size_t count = image.values().size(), row = static_cast<size_t>(width) * static_cast<size_t>(channels);
  const auto step = static_cast<size_t>(channels);
  std::vector<Word> words(count);
  const auto predicted = [&](size_t i) {
    const uint64_t left = i % row >= step ? words[i - step] : 0, up = i >= row ? words[i - row] : left;
    return static_cast<Word>((i % row >= step ? left + up : 2 * up) / 2);
  };
  std::vector<uint8_t> planes(count * sizeof(T));
  if (!archive.reading()) {
    if (count > 0) std::memcpy(words.data(), image.values().data(), planes.size());
    for (size_t i = 0; i < count; ++i) {
      const auto difference = static_cast<Word>(words[i] - predicted(i));
      for (size_t b = 0; b < sizeof(T); ++b) planes[b * count + i] = static_cast<uint8_t>(difference >> (8 * b));
    }
  }
  archive.raw(planes.data(), planes.size());
  if (!archive.reading() || count == 0) return;
  for (size_t i = 0; i < count; ++i) {
    uint64_t difference = 0;
    for (size_t b = 0; b < sizeof(T); ++b) difference |= static_cast<uint64_t>(planes[b * count + i]) << (8 * b);
    words[i] = static_cast<Word>(difference + predicted(i));
  }
  std::memcpy(image.values().data(), words.data(), planes.size());
}

}  // namespace photoslam
