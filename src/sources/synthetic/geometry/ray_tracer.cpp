// Copyright the photoslam authors.
// SPDX-License-Identifier: Apache-2.0
#include "sources/synthetic/geometry/ray_tracer.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <type_traits>

#include "base/check.h"

namespace photoslam::synthetic {
namespace {

template <class Handle, void (*Release)(Handle)>
struct Releaser {
  void operator()(Handle handle) const { Release(handle); }
};
template <class Handle, void (*Release)(Handle)>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Releaser<Handle, Release>>;

static_assert(sizeof(Vertex) == 32 && offsetof(Vertex, position) == 0 && offsetof(Triangle, vertices) == 0);

void copy_rays(const RayTracer::Rays& rays, RTCRay16& out, int* valid) {
  for (int i = 0; i < RayTracer::kRays; ++i) {
    const size_t k = static_cast<size_t>(i);
    valid[i] = rays.far[k] >= 0 ? -1 : 0;
    out.org_x[i] = rays.origin.x();
    out.org_y[i] = rays.origin.y();
    out.org_z[i] = rays.origin.z();
    out.dir_x[i] = rays.x[k];
    out.dir_y[i] = rays.y[k];
    out.dir_z[i] = rays.z[k];
    out.tnear[i] = rays.near;
    out.tfar[i] = rays.far[k];
    out.time[i] = 0;
    out.mask[i] = ~0u;
    out.id[i] = static_cast<unsigned>(i);
    out.flags[i] = 0;
  }
}

// Embree 4 renamed the per-call context and put it last.
#if RTC_VERSION_MAJOR >= 4
struct Query {
  RTCIntersectArguments intersect_arguments;
  RTCOccludedArguments occluded_arguments;
  Query() {
    rtcInitIntersectArguments(&intersect_arguments);
    rtcInitOccludedArguments(&occluded_arguments);
    intersect_arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
    occluded_arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  }
  void intersect(const int* valid, RTCScene scene, RTCRayHit16& rays) {
    rtcIntersect16(valid, scene, &rays, &intersect_arguments);
  }
  void occluded(const int* valid, RTCScene scene, RTCRay16& rays) {
    rtcOccluded16(valid, scene, &rays, &occluded_arguments);
  }
};
#else
struct Query {
  RTCIntersectContext context;
  Query() {
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  }
  void intersect(const int* valid, RTCScene scene, RTCRayHit16& rays) { rtcIntersect16(valid, scene, &context, &rays); }
  void occluded(const int* valid, RTCScene scene, RTCRay16& rays) { rtcOccluded16(valid, scene, &context, &rays); }
};
#endif

}  // namespace

struct RayTracer::Scene {
  Owned<RTCDevice, rtcReleaseDevice> device;
  Owned<RTCScene, rtcReleaseScene> scene;
};

void RayTracer::Rays::set(int i, const Vec3f& direction, float far_end) {
  const size_t k = static_cast<size_t>(i);
  x[k] = direction.x();
  y[k] = direction.y();
  z[k] = direction.z();
  far[k] = far_end;
}

Vec3f RayTracer::Rays::direction(int i) const {
  const size_t k = static_cast<size_t>(i);
  return {x[k], y[k], z[k]};
}

RayTracer::RayTracer(const Mesh& mesh) {
  PHOTOSLAM_CHECK(!mesh.triangles.empty());
  auto scene = std::make_unique<Scene>();
  // One thread: the hierarchy, and with it every ray, is the same on every machine.
  scene->device.reset(rtcNewDevice("threads=1,set_affinity=0"));
  PHOTOSLAM_CHECK(scene->device, "Embree: error {}", static_cast<int>(rtcGetDeviceError(nullptr)));
  scene->scene.reset(rtcNewScene(scene->device.get()));
  rtcSetSceneFlags(scene->scene.get(), RTC_SCENE_FLAG_ROBUST);
  Owned<RTCGeometry, rtcReleaseGeometry> geometry(rtcNewGeometry(scene->device.get(), RTC_GEOMETRY_TYPE_TRIANGLE));
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.vertices.data(), 0,
                             sizeof(Vertex), mesh.vertices.size());
  rtcSetSharedGeometryBuffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                             sizeof(Triangle), mesh.triangles.size());
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometry(scene->scene.get(), geometry.get());
  rtcCommitScene(scene->scene.get());
  const RTCError failure = rtcGetDeviceError(scene->device.get());
  PHOTOSLAM_CHECK(failure == RTC_ERROR_NONE, "Embree: error {}", static_cast<int>(failure));
  scene_ = std::move(scene);
}

RayTracer::~RayTracer() = default;
RayTracer::RayTracer(RayTracer&&) noexcept = default;
RayTracer& RayTracer::operator=(RayTracer&&) noexcept = default;

void RayTracer::intersect(const Rays& rays, Hits& hits) const {
  alignas(64) int valid[kRays];
  alignas(64) RTCRayHit16 query;
  copy_rays(rays, query.ray, valid);
  std::fill(std::begin(query.hit.geomID), std::end(query.hit.geomID), RTC_INVALID_GEOMETRY_ID);
  std::fill(std::begin(query.hit.instID[0]), std::end(query.hit.instID[0]), RTC_INVALID_GEOMETRY_ID);
  Query().intersect(valid, scene_->scene.get(), query);
  for (int i = 0; i < kRays; ++i) {
    const size_t k = static_cast<size_t>(i);
    const bool hit = valid[i] != 0 && query.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
    hits.triangle[k] = hit ? static_cast<int32_t>(query.hit.primID[i]) : -1;
    hits.distance[k] = query.ray.tfar[i];
    hits.u[k] = query.hit.u[i];
    hits.v[k] = query.hit.v[i];
  }
}

uint32_t RayTracer::blocked(const Rays& rays) const {
  alignas(64) int valid[kRays];
  alignas(64) RTCRay16 query;
  copy_rays(rays, query, valid);
  Query().occluded(valid, scene_->scene.get(), query);
  uint32_t mask = 0;
  for (int i = 0; i < kRays; ++i) {
    if (valid[i] != 0 && query.tfar[i] < 0) mask |= 1u << i;
  }
  return mask;
}

}  // namespace photoslam::synthetic
