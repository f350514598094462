// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0

// Compiles every kernel for the device; scripts/check_device_code.sh reads what ptxas says about them.
#include "splatting/cuda/gradient_kernels.h"
#include "splatting/cuda/sort_kernels.h"

namespace photoslam::splatting::cuda {

template __global__ void run_kernel<ProjectKernel>(ProjectKernel);
template __global__ void run_kernel<CountDigits>(CountDigits);
template __global__ void run_kernel<PrefixRows>(PrefixRows);
template __global__ void run_kernel<AddToRows>(AddToRows);
template __global__ void run_kernel<ScatterDigits>(ScatterDigits);
template __global__ void run_kernel<GatherCounts>(GatherCounts);
template __global__ void run_kernel<EmitInstances>(EmitInstances);
template __global__ void run_kernel<BoundInstances>(BoundInstances);
template __global__ void run_kernel<FindTiles>(FindTiles);
template __global__ void run_kernel<CountBuckets>(CountBuckets);
template __global__ void run_kernel<BlendKernel>(BlendKernel);
template __global__ void run_kernel<UnblendKernel>(UnblendKernel);
template __global__ void run_kernel<GradientKernel>(GradientKernel);

}  // namespace photoslam::splatting::cuda
