// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

/// In front of functions of headers that are free of the host's libraries: nvcc compiles them for the GPU too.
#ifdef __CUDACC__
#define PHOTOSLAM_FORMULA __host__ __device__ inline
#else
#define PHOTOSLAM_FORMULA inline
#endif
