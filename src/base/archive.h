// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/ids.h"

namespace photoslam {

/// Writes values into bytes or reads them back: one function `void serialize(Archive&)` describes both directions, so
/// that they cannot disagree. Little endian, no padding; equal values make equal bytes.
///
/// Whoever reads has made sure that the bytes are those once written (by a checksum): reading past the end is a
/// programmer error and throws.
class Archive {
 public:
  /// Writes; see bytes().
  Archive() = default;
  /// Reads from `bytes`, which must outlive the archive.
  explicit Archive(std::string_view bytes) : reading_(true), unread_(bytes) {}

  bool reading() const { return reading_; }
  bool at_end() const { return unread_.empty(); }
  const std::string& bytes() const { return written_; }
  std::string take_bytes() { return std::move(written_); }

  /// Archives values one after the other.
  template <class... T>
  void operator()(T&... values) {
    (archive(values), ...);
  }

  /// Memory as it is.
  void raw(void* data, size_t size) {
    if (!reading_) {
      written_.append(static_cast<const char*>(data), size);
      return;
    }
    PHOTOSLAM_CHECK(size <= unread_.size(), "{} bytes wanted, {} left", size, unread_.size());
    std::memcpy(data, unread_.data(), size);
    unread_.remove_prefix(size);
  }

  /// The size of a container; when reading, at most what could follow.
  uint64_t count(uint64_t size) {
    (*this)(size);
    PHOTOSLAM_CHECK(!reading_ || size <= unread_.size(), "{} elements in {} bytes", size, unread_.size());
    return size;
  }

 private:
  template <class T>
  static constexpr bool kIsPlain = std::is_arithmetic_v<T> || std::is_enum_v<T>;

  template <class T>
  void archive(T& value) {
    if constexpr (kIsPlain<T>) {
      raw(&value, sizeof(T));
    } else if constexpr (requires { value.serialize(*this); }) {
      value.serialize(*this);
    } else {
      serialize(*this, value);  // found by argument-dependent lookup
    }
  }
  template <class Tag>
  void archive(Id<Tag>& id) {
    archive(id.value);
  }
  void archive(std::string& text) {
    text.resize(count(text.size()));
    raw(text.data(), text.size());
  }
  template <class T, size_t kCount>
  void archive(std::array<T, kCount>& values) {
    for (T& value : values) archive(value);
  }
  template <class T>
  void archive(std::vector<T>& values) {
    values.resize(count(values.size()));
    if constexpr (kIsPlain<T>) {
      raw(values.data(), values.size() * sizeof(T));
    } else {
      for (T& value : values) archive(value);
    }
  }

  bool reading_ = false;
  std::string_view unread_;
  std::string written_;
};

}  // namespace photoslam
