// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// Runs kernels on the host, for tests: every thread of a block is a fiber, switched at barriers and warp collectives.

#include <setjmp.h>
#include <ucontext.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "base/check.h"
#include "base/random.h"
#include "splatting/cuda/group.h"

namespace photoslam::splatting::cuda {

/// In which order threads run up to their next collective, and blocks after each other. A kernel whose result depends
/// on it lacks a barrier.
enum class ThreadOrder { forwards, backwards, shuffled };

/// One block of threads, for launch after launch. Blocks run one after the other, threads of a block interleave at
/// collectives only.
class HostBlock {
 public:
  explicit HostBlock(int threads, ThreadOrder order = ThreadOrder::forwards)
      : order_(order),
        fibers_(static_cast<size_t>(threads)),
        gates_(static_cast<size_t>(1 + threads / kWarpSize)),
        sequence_(fibers_.size()) {
    PHOTOSLAM_CHECK(threads > 0 && threads % kWarpSize == 0, "{} threads are no whole warps", threads);
    std::iota(sequence_.begin(), sequence_.end(), size_t{0});
    if (order == ThreadOrder::backwards) std::reverse(sequence_.begin(), sequence_.end());
    for (Fiber& fiber : fibers_) fiber.stack = std::make_unique_for_overwrite<char[]>(kStackSize);
  }

  /// Calls body(thread) in a fiber each, as block `block` of `num_blocks`; ends when all have returned. A collective
  /// that some thread of its warp or block never reaches would hang a GPU: here it is an error, after which this object
  /// is of no more use.
  template <class Body>
  void run(int block, int num_blocks, Body&& body) {
    block_ = block;
    num_blocks_ = num_blocks;
    using Plain = std::remove_reference_t<Body>;
    invoke_ = [](void* self, int thread) { (*static_cast<Plain*>(self))(thread); };
    body_ = &body;
    for (Fiber& fiber : fibers_) {
      fiber.done = false;
      fiber.gate = nullptr;
    }
    size_t finished = 0;
    while (finished < fibers_.size()) {
      bool progress = false;
      if (order_ == ThreadOrder::shuffled) shuffle();
      for (const size_t thread : sequence_) {
        current_ = thread;
        Fiber& fiber = fibers_[thread];
        if (fiber.done || (fiber.gate != nullptr && fiber.gate->generation == fiber.generation)) continue;
        fiber.gate = nullptr;
        progress = true;
        resume(fiber);
        finished += fiber.done ? 1 : 0;
      }
      PHOTOSLAM_CHECK(progress, "block {}: {} of {} threads returned, the others wait for them", block_, finished,
                      fibers_.size());
    }
  }

  ThreadOrder order() const { return order_; }
  int block() const { return block_; }
  int num_blocks() const { return num_blocks_; }

  struct Gate {
    uint32_t generation = 0;
    uint32_t arrived = 0;
    std::vector<char> values[2];  ///< [members, kSlot], by parity of the generation.
  };
  static constexpr size_t kSlot = 64;

  Gate& block_gate() { return gates_[0]; }
  Gate& warp_gate(int warp) { return gates_[static_cast<size_t>(1 + warp)]; }

  /// Publishes a value and waits for all members of the gate; returns what they published.
  const char* exchange(Gate& gate, size_t member, size_t members, const void* value, size_t size) {
    std::vector<char>& values = gate.values[gate.generation % 2];
    values.resize(members * kSlot);
    std::memcpy(values.data() + member * kSlot, value, size);
    if (++gate.arrived == members) {
      gate.arrived = 0;
      ++gate.generation;
      return values.data();
    }
    Fiber& fiber = fibers_[current_];
    fiber.gate = &gate;
    fiber.generation = gate.generation;
    suspend(fiber);
    return values.data();
  }

 private:
  static constexpr size_t kStackSize = size_t{64} * 1024;

  struct Fiber {
    ucontext_t context{};
    std::unique_ptr<char[]> stack;
    const Gate* gate = nullptr;  ///< What it waits for: that the generation is over.
    uint32_t generation = 0;
    bool started = false, done = false;
    jmp_buf place;  ///< Where it waits.
  };

  // A fiber is entered by its context once. From then on jumps switch: they leave the signal mask alone, which a change
  // of context asks the kernel for every time.
  void resume(Fiber& fiber) {
    if (_setjmp(scheduler_) != 0) return;
    if (fiber.started) _longjmp(fiber.place, 1);
    fiber.started = true;
    getcontext(&fiber.context);
    fiber.context.uc_stack.ss_sp = fiber.stack.get();
    fiber.context.uc_stack.ss_size = kStackSize;
    fiber.context.uc_link = nullptr;
    const auto self = reinterpret_cast<uintptr_t>(this);  // arguments are ints: in two halves
    makecontext(&fiber.context, reinterpret_cast<void (*)()>(&HostBlock::enter), 2,
                static_cast<unsigned>(uint64_t{self} >> 32), static_cast<unsigned>(self));
    setcontext(&fiber.context);
  }
  void suspend(Fiber& fiber) {
    if (_setjmp(fiber.place) == 0) _longjmp(scheduler_, 1);
  }
  static void enter(unsigned high, unsigned low) {
    auto& self = *reinterpret_cast<HostBlock*>(static_cast<uintptr_t>((uint64_t{high} << 32) | low));
    const size_t thread = self.current_;
    while (true) {  // a body per block
      self.invoke_(self.body_, static_cast<int>(thread));
      self.fibers_[thread].done = true;
      self.suspend(self.fibers_[thread]);
    }
  }

  void shuffle() {
    for (size_t i = sequence_.size(); i > 1; --i)
      std::swap(sequence_[i - 1], sequence_[static_cast<size_t>(random_.index(static_cast<int>(i)))]);
  }

  ThreadOrder order_;
  Random random_{1};
  int block_ = 0, num_blocks_ = 1;
  std::vector<Fiber> fibers_;
  std::vector<Gate> gates_;
  std::vector<size_t> sequence_;
  jmp_buf scheduler_;
  size_t current_ = 0;
  void* body_ = nullptr;
  void (*invoke_)(void*, int) = nullptr;
};

/// DeviceGroup's counterpart.
class HostGroup {
 public:
  HostGroup(HostBlock& block, int thread, int threads) : block_(block), thread_(thread), threads_(threads) {}
  int thread() const { return thread_; }
  int block() const { return block_.block(); }
  int num_blocks() const { return block_.num_blocks(); }
  int lane() const { return thread_ % kWarpSize; }
  int warp() const { return thread_ / kWarpSize; }
  void sync() { in_block(0); }
  bool sync_any(bool predicate) {
    const char* all = in_block(predicate ? 1 : 0);
    for (size_t i = 0; i < static_cast<size_t>(threads_); ++i)
      if (all[i * HostBlock::kSlot] != 0) return true;
    return false;
  }
  void sync_warp() { in_warp(0); }
  uint32_t ballot(bool predicate) {
    const uint32_t own = predicate ? 1 : 0;
    const char* all = in_warp(own);
    uint32_t mask = 0;
    for (int i = 0; i < kWarpSize; ++i) mask |= value_of<uint32_t>(all, i) << i;
    return mask;
  }
  uint32_t match(uint32_t value) {
    const char* all = in_warp(value);
    uint32_t mask = 0;
    for (int i = 0; i < kWarpSize; ++i) mask |= static_cast<uint32_t>(value_of<uint32_t>(all, i) == value) << i;
    return mask;
  }
  template <class T>
  T from_previous(const T& value) {
    const char* all = in_warp(value);
    return value_of<T>(all, lane() == 0 ? 0 : lane() - 1);
  }
  float exchange(float value, int mask) {
    const char* all = in_warp(value);
    return value_of<float>(all, lane() ^ mask);
  }
  uint32_t add(uint32_t* sum, uint32_t value) {
    const uint32_t before = *sum;
    *sum += value;
    return before;
  }

 private:
  const char* in_block(char value) {
    return block_.exchange(block_.block_gate(), static_cast<size_t>(thread_), static_cast<size_t>(threads_), &value, 1);
  }
  template <class T>
  const char* in_warp(const T& value) {
    static_assert(sizeof(T) <= HostBlock::kSlot);
    return block_.exchange(block_.warp_gate(warp()), static_cast<size_t>(lane()), kWarpSize, &value, sizeof(T));
  }
  template <class T>
  static T value_of(const char* all, int lane) {
    T value;
    std::memcpy(&value, all + static_cast<size_t>(lane) * HostBlock::kSlot, sizeof(T));
    return value;
  }

  HostBlock& block_;
  int thread_, threads_;
};

/// Runs a kernel as a GPU would with <<<num_blocks, Kernel::kThreads>>>. Shared memory starts with garbage.
template <class Kernel>
void run_on_host(HostBlock& block, int num_blocks, const Kernel& kernel) {
  auto shared = std::make_unique<typename Kernel::Shared>();
  for (int k = 0; k < num_blocks; ++k) {
    const int i = block.order() == ThreadOrder::forwards ? k : num_blocks - 1 - k;
    std::memset(static_cast<void*>(shared.get()), 0xff, sizeof(typename Kernel::Shared));
    block.run(i, num_blocks, [&](int thread) {
      HostGroup group(block, thread, Kernel::kThreads);
      kernel(group, *shared);
    });
  }
}

}  // namespace photoslam::splatting::cuda
