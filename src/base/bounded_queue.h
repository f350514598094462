// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace photoslam {

/// What a full queue does with one more element.
enum class Overflow {
  block,        ///< push waits until there is room.
  drop_oldest,  ///< the oldest element makes room and is counted.
  grow,         ///< nothing is lost and nobody waits: the capacity is where the queue begins.
};

/// First-in first-out channel between threads with a fixed capacity.
///
/// After close(), pushes are refused and pops deliver what is left, then nothing: the end of the stream.
template <class T>
class BoundedQueue {
 public:
  BoundedQueue(size_t capacity, Overflow overflow) : capacity_(capacity), overflow_(overflow) {}

  /// False when the queue is closed; the value is then dropped.
  bool push(T value) {
    return push(std::move(value), [](const T&, std::deque<T>&) {});
  }

  /// The same, but that first `make_way(value, waiting)` may change or remove what waits, oldest first. Everybody else
  /// is kept from the queue meanwhile.
  template <class MakeWay>
  bool push(T value, const MakeWay& make_way) {
    std::unique_lock lock(mutex_);
    if (!closed_) make_way(std::as_const(value), items_);
    if (overflow_ == Overflow::block) has_room_.wait(lock, [&] { return closed_ || items_.size() < capacity_; });
    if (closed_) return false;
    if (overflow_ == Overflow::drop_oldest && items_.size() >= capacity_) {
      items_.pop_front();
      ++dropped_;
    }
    items_.push_back(std::move(value));
    has_item_.notify_one();
    return true;
  }

  /// Waits for an element; empty at the end of the stream.
  std::optional<T> pop() {
    std::unique_lock lock(mutex_);
    has_item_.wait(lock, [&] { return closed_ || !items_.empty(); });
    return take();
  }

  /// An element if one is there.
  std::optional<T> try_pop() {
    std::unique_lock lock(mutex_);
    return take();
  }

  void close() {
    std::lock_guard lock(mutex_);
    closed_ = true;
    has_item_.notify_all();
    has_room_.notify_all();
  }

  size_t size() const {
    std::lock_guard lock(mutex_);
    return items_.size();
  }
  /// Closed and empty: pop() will return nothing, now and ever.
  bool finished() const {
    std::lock_guard lock(mutex_);
    return closed_ && items_.empty();
  }
  size_t dropped() const {
    std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  std::optional<T> take() {
    if (items_.empty()) return std::nullopt;
    std::optional<T> value(std::move(items_.front()));
    items_.pop_front();
    has_room_.notify_one();
    return value;
  }

  const size_t capacity_;
  const Overflow overflow_;
  mutable std::mutex mutex_;
  std::condition_variable has_item_;
  std::condition_variable has_room_;
  std::deque<T> items_;
  size_t dropped_ = 0;
  bool closed_ = false;
};

}  // namespace photoslam
