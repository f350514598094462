// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// The engine on a GPU as the rest of the program sees it: the module photoslam_cuda.so makes one. Plain data crosses.

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>

#include "splatting/anchor_view.h"
#include "splatting/cuda/device_undistorter.h"
#include "splatting/density.h"
#include "splatting/update_constants.h"

namespace photoslam::splatting::cuda {

/// The GPU refuses, has no memory left, or is gone.
class DeviceError : public std::runtime_error {
 public:
  DeviceError(const std::string& what, bool is_memory) : std::runtime_error(what), out_of_memory(is_memory) {}
  bool out_of_memory;
};

/// ModelChanges as plain pointers.
struct Arrangement {
  uint32_t num_blocks = 0;
  const uint32_t* sources = nullptr;  // [num_blocks, 64]
  const int32_t* anchors = nullptr;   // [num_blocks]
  const int32_t* counts = nullptr;    // [num_blocks]
  const float* records = nullptr;     // [num_records, row::kTableRows]
  uint32_t num_records = 0;
  bool moves = false;
  bool clear_statistics = false;
};

struct DeviceView {
  int width = 0, height = 0;
  int sh_degree = 0;
  float background[3] = {0, 0, 0};
  const AnchorView* anchors = nullptr;  // [num_anchors]
  uint32_t num_anchors = 0;
};

/// A target image in the host's memory, and the part of its resolution to compare at: 1/factor. Both stay on the device
/// under its id, as long as there is room.
struct DeviceTarget {
  uint64_t id = 0;
  int width = 0, height = 0;
  int factor = 1;
  const uint8_t* rgb = nullptr;     // [3, H, W]
  const uint8_t* mask = nullptr;    // [H, W] or null
  const uint16_t* depth = nullptr;  // [H, W] or null
  float depth_unit = 0;
  int num_valid = 0, num_depth = 0;
};

struct DeviceLoss {
  float gain[3] = {1, 1, 1}, bias[3] = {0, 0, 0};
  float ssim_weight = 0, depth_weight = 0;
};

/// Sums over the pixels of one channel.
struct ChannelSums {
  double l1, mse, bias, value, ssim;
};

/// What an iteration leaves behind besides the model.
struct Figures {
  uint32_t visible = 0;
  uint32_t instances = 0;  ///< (gaussian, tile) pairs …
  uint32_t lost = 0;       ///< … and those that even all the memory allowed had no room for.
  ChannelSums channels[3] = {};
  int num_valid = 0, num_depth = 0;  ///< Pixels compared, and those with depth that was.
  double depth = 0;                  ///< Σ |D − A d|
  double pose[6] = {};               ///< dL/dξ
  float times[6] = {};               ///< Project, sort, forward, loss, backward, update [ms]
};

/// Host memory for a rendered image, or null: [3, H, W], [H, W], [H, W].
struct ImagePlanes {
  float* rgb = nullptr;
  float* depth = nullptr;
  float* alpha = nullptr;
};

/// One model and the scratch memory of its training. Every function may throw DeviceError and leaves the model as it
/// was then, as far as the device still answers.
class DeviceEngine {
 public:
  virtual ~DeviceEngine() = default;
  DeviceEngine() = default;
  DeviceEngine(const DeviceEngine&) = delete;
  DeviceEngine& operator=(const DeviceEngine&) = delete;

  virtual void arrange(const Arrangement& arrangement) = 0;
  /// Rows [first, first + count) of all blocks: [num_blocks, count, 64].
  virtual void fetch(int first_row, int num_rows, float* rows) = 0;

  /// A fate per slot: [num_blocks, 64].
  virtual void judge(const DensityRules& rules, Fate* fates) = 0;
  /// Appends blocks with these gaussians, filled one after the other, whose parents are slots. They are not drawn yet.
  virtual void breed(const Child* children, uint32_t count) = 0;

  /// Renders; with `keep` a call of backward() may follow.
  virtual Figures forward(const DeviceView& view, bool keep) = 0;
  /// The image rendered last.
  virtual void read_image(const ImagePlanes& image) = 0;
  /// See Trainer::backward(); null = zero. Writes dense gradients [num_blocks, row::kCount, 64].
  virtual Figures backward(const float* dl_drgb, const float* dl_ddepth, const float* dl_dalpha, float* dense) = 0;
  /// See Trainer::step().
  virtual Figures step(const DeviceView& view, const DeviceTarget& target, const DeviceLoss& loss,
                       const UpdateConstants& constants, bool update) = 0;
  virtual void forget_target(uint64_t id) = 0;

  /// Its memory counts against the engine's limit. May be made, used and destroyed while another thread trains.
  virtual std::unique_ptr<DeviceUndistorter> make_undistorter(const DeviceLens* lenses, int count) = 0;

  virtual uint64_t peak_bytes() const = 0;
};

inline constexpr int kModuleVersion = 4;

/// What the module exports as "photoslam_cuda_module".
struct Module {
  int version;
  /// Names the GPU and writes it to `text`; false: why there is none.
  bool (*describe)(char* text, int size);
  /// Null: `text` says why.
  DeviceEngine* (*open)(uint64_t memory_limit, char* text, int size);
};
using ModuleEntry = const Module* (*)();

}  // namespace photoslam::splatting::cuda
