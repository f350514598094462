// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the engine's tests run on: the GPU where nvcc compiles them, the host in its role elsewhere.

#include <vector>

#include "splatting/cuda/engine.h"
#include "splatting/model.h"

#ifdef __CUDACC__
#include "splatting/cuda/cuda_device.h"
#else
#include "splatting/cuda/host_device.h"
#endif

namespace photoslam::splatting::cuda {

#ifdef __CUDACC__
using TestDevice = CudaDevice;
#else
using TestDevice = HostDevice;
#endif

/// An array on the test's device, with what a vector holds.
template <class T>
Array<T, TestDevice> to_device(TestDevice& device, Memory<TestDevice>& memory, const std::vector<T>& values) {
  Array<T, TestDevice> array(memory);
  array.take(values.size());
  device.upload(array.data(), values.data(), values.size() * sizeof(T));
  return array;
}
template <class T>
std::vector<T> to_host(TestDevice& device, const Array<T, TestDevice>& array, size_t size) {
  std::vector<T> values(size);
  device.download(values.data(), array.data(), size * sizeof(T));
  return values;
}

/// Puts a model on an engine, all of it from the host.
inline void upload_model(const GaussianModel& model, DeviceEngine& engine) {
  const size_t slots = model.index_end();
  std::vector<uint32_t> sources(slots, ModelChanges::kFromNowhere);
  std::vector<int32_t> anchors, counts;
  std::vector<float> records;
  for (size_t b = 0; b < model.num_blocks(); ++b) {
    const Block& block = model.block(b);
    anchors.push_back(block.anchor);
    counts.push_back(block.count);
    for (int lane = 0; lane < block.count; ++lane) {
      sources[b * kBlockSize + static_cast<size_t>(lane)] =
          ModelChanges::kFromHost + static_cast<uint32_t>(records.size() / row::kTableRows);
      for (int r = 0; r < row::kTableRows; ++r) records.push_back((&block.parameters[0][0])[r * kBlockSize + lane]);
    }
  }
  Arrangement a;
  a.num_blocks = static_cast<uint32_t>(model.num_blocks());
  a.sources = sources.data();
  a.anchors = anchors.data();
  a.counts = counts.data();
  a.records = records.data();
  a.num_records = static_cast<uint32_t>(records.size() / row::kTableRows);
  engine.arrange(a);
}

}  // namespace photoslam::splatting::cuda
