// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>

namespace photoslam::splatting {

/// Aligned scratch memory that only grows and whose contents are not initialised.
template <class T>
class Buffer {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// Room for `size` elements; contents are undefined afterwards when it had to grow.
  void reserve(size_t size) {
    if (size <= capacity_) return;
    data_.reset();
    const size_t capacity = size + size / 8;
    data_.reset(static_cast<T*>(::operator new(capacity * sizeof(T), kAlignment)));
    capacity_ = capacity;
  }
  T* data() { return data_.get(); }
  const T* data() const { return data_.get(); }
  T& operator[](size_t i) { return data_.get()[i]; }
  const T& operator[](size_t i) const { return data_.get()[i]; }

 private:
  static constexpr std::align_val_t kAlignment{64};
  struct Free {
    void operator()(T* p) const { ::operator delete(p, kAlignment); }
  };
  std::unique_ptr<T, Free> data_;
  size_t capacity_ = 0;
};

}  // namespace photoslam::splatting
