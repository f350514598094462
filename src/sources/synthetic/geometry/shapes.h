// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "base/random.h"
#include "math/se3.h"
#include "sources/synthetic/geometry/mesh.h"

namespace photoslam::synthetic {

/// Object frames: x to the right as seen from the front, y backwards, z up.
SE3 place(double x, double y, double z, double yaw_deg = 0);

/// How a material covers a surface.
struct Cover {
  int material = 0;
  enum class Fit {
    random,   ///< True to scale, at a random place of the texture, its x axis along the longer side.
    aligned,  ///< The same with the texture's x axis along u.
    stretch,  ///< The whole texture fills the surface.
  } fit = Fit::random;
  double light_spacing = 0.04;  ///< Between nodes of the light map [m].

  Cover() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): a material alone is a cover
  Cover(int m, Fit f = Fit::random, double spacing = 0.04) : material(m), fit(f), light_spacing(spacing) {}
};

/// Covers of the six sides of a box; sides without a cover do not exist.
struct BoxCovers {
  Cover front, back, left, right, top, bottom;
  // NOLINTBEGIN(google-explicit-constructor): one cover, or one material, for all sides
  BoxCovers(const Cover& all) : front(all), back(all), left(all), right(all), top(all), bottom(all) {}
  BoxCovers(int material) : BoxCovers(Cover(material)) {}
  // NOLINTEND(google-explicit-constructor)
};

/// Collects surfaces into a mesh. Sizes in metres.
class MeshBuilder {
 public:
  /// Light map nodes are `light_coarseness` times as far apart as the covers want.
  explicit MeshBuilder(uint64_t seed, double light_coarseness = 1)
      : light_coarseness_(light_coarseness), random_(seed) {}

  /// `texture_size` is the extent [m] of the material's texture. Returns the material's index.
  int add_material(const Material& material, const Vec2f& texture_size);

  using Surface = std::function<Vec3(double u, double v)>;
  /// A curved surface sampled at columns x rows points; seen from outside, u runs to the right and v down.
  void patch(const SE3& world_from_object, int columns, int rows, const Surface& surface, const Cover& cover);

  /// The rectangle with a corner and two edges, seen from outside: right and down.
  void rectangle(const SE3& frame, const Vec3& corner, const Vec3& right, const Vec3& down, const Cover& cover);
  /// A box from its lower left front corner.
  void box(const SE3& frame, const Vec3& corner, const Vec3& size, const BoxCovers& covers);
  /// A surface of revolution about z through the points (radius, z), listed from top to bottom.
  void lathe(const SE3& frame, std::span<const Vec2> profile, const Cover& cover, int segments = 24);
  void cylinder(const SE3& frame, double radius, double height, const Cover& cover, int segments = 20);
  void sphere(const SE3& frame, double radius, const Cover& cover, int segments = 24);
  /// A box with rounded edges, centred on the origin; its faces bulge outwards by `bulge`.
  void rounded_box(const SE3& frame, const Vec3& size, double radius, double bulge, const Cover& cover);
  /// A sewn pillow, upright and centred on the origin; `size` is (width, thickness, height).
  void pillow(const SE3& frame, const Vec3& size, const Cover& cover);
  /// A round bar along a polyline.
  void tube(const SE3& frame, std::span<const Vec3> path, double radius, const Cover& cover, int segments = 8);
  /// A pointed, bent strip from the origin along `along`, drooping by `droop` metres at its tip.
  void leaf(const SE3& frame, const Vec3& along, double width, double droop, const Cover& cover);

  Random& random() { return random_; }
  Mesh finish() && { return std::move(mesh_); }

 private:
  void map_texture(Patch& patch, const Vec2f& size, const Cover& cover);

  Mesh mesh_;
  std::vector<Vec2f> texture_sizes_;  // per material
  double light_coarseness_;
  Random random_;
};

}  // namespace photoslam::synthetic
