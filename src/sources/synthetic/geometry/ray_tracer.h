// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>

#include "sources/synthetic/geometry/mesh.h"

namespace photoslam::synthetic {

/// Finds what rays hit in a mesh. Immutable and safe to use from several threads.
class RayTracer {
 public:
  static constexpr int kRays = 16;

  /// Rays from one origin; directions need not have unit length: distances are multiples of them.
  struct Rays {
    Vec3f origin{0, 0, 0};
    alignas(64) std::array<float, kRays> x, y, z;
    alignas(64) std::array<float, kRays> far;  ///< Largest distance that counts; negative: no such ray.
    float near = 1e-4f;

    void set(int i, const Vec3f& direction, float far_end = std::numeric_limits<float>::infinity());
    void skip(int i) { set(i, Vec3f::UnitZ(), -1.0f); }
    /// A zero direction is no ray.
    void set_or_skip(int i, const Eigen::Vector3d& direction) {
      if (direction.isZero(0)) {
        skip(i);
      } else {
        set(i, direction.cast<float>());
      }
    }
    bool exists(int i) const { return far[static_cast<size_t>(i)] >= 0; }
    Vec3f direction(int i) const;
  };

  struct Hits {
    std::array<float, kRays> distance;
    std::array<float, kRays> u, v;        ///< Weights of the triangle's second and third vertex.
    std::array<int32_t, kRays> triangle;  ///< -1: nothing.
  };

  /// The mesh must outlive the tracer.
  explicit RayTracer(const Mesh& mesh);
  ~RayTracer();
  RayTracer(RayTracer&&) noexcept;
  RayTracer& operator=(RayTracer&&) noexcept;

  void intersect(const Rays& rays, Hits& hits) const;
  /// Bit i is set when ray i exists and something lies between near and far.
  uint32_t blocked(const Rays& rays) const;

 private:
  struct Scene;
  std::unique_ptr<const Scene> scene_;
};

}  // namespace photoslam::synthetic
