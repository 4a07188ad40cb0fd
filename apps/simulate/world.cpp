#include "simulate/world.hpp"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include "simulate/changes.hpp"

namespace vantage::simulation {
namespace {

struct ReleaseDevice {
  void operator()(RTCDevice device) const noexcept { rtcReleaseDevice(device); }
};
struct ReleaseScene {
  void operator()(RTCScene scene) const noexcept { rtcReleaseScene(scene); }
};
struct ReleaseGeometry {
  void operator()(RTCGeometry geometry) const noexcept { rtcReleaseGeometry(geometry); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, ReleaseDevice>;
using Scene = std::unique_ptr<std::remove_pointer_t<RTCScene>, ReleaseScene>;
using Geometry = std::unique_ptr<std::remove_pointer_t<RTCGeometry>, ReleaseGeometry>;

tl::unexpected<Error> embree_error(RTCError code, const std::string& activity) {
  return fail(ErrorCode::internal, code == RTC_ERROR_OUT_OF_MEMORY
                                       ? "out of memory while " + activity
                                       : "Embree error " + std::to_string(static_cast<int>(code)) +
                                             " while " + activity);
}
tl::unexpected<Error> cannot_store_triangles() {
  return embree_error(RTC_ERROR_OUT_OF_MEMORY, "storing the triangles of the world");
}

/// Writes triangles into buffers that Embree owns.
class MeshWriter {
 public:
  MeshWriter(RTCGeometry geometry, std::size_t vertices, std::size_t triangles)
      : vertices_(static_cast<float*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertices))),
        triangles_(static_cast<std::uint32_t*>(
            rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                    3 * sizeof(std::uint32_t), triangles))) {}

  [[nodiscard]] bool is_ready() const { return vertices_ != nullptr && triangles_ != nullptr; }

  std::uint32_t add_vertex(const Point& p) {
    for (int axis = 0; axis < 3; ++axis) *vertices_++ = static_cast<float>(p[axis]);
    return vertex_count_++;
  }
  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    for (const std::uint32_t index : {a, b, c}) *triangles_++ = index;
  }

 private:
  float* vertices_;
  std::uint32_t* triangles_;
  std::uint32_t vertex_count_ = 0;
};

constexpr unsigned kGroundGeometry = 0, kObjectGeometry = 1;

Result<void> write_ground(RTCGeometry geometry, const Terrain& terrain) {
  const auto columns = static_cast<std::uint32_t>(terrain.columns());
  const auto rows = static_cast<std::uint32_t>(terrain.rows());
  MeshWriter mesh(geometry, std::size_t{columns} * rows, 2 * std::size_t{columns - 1} * (rows - 1));
  if (!mesh.is_ready()) return cannot_store_triangles();
  for (int j = 0; j < terrain.rows(); ++j) {
    for (int i = 0; i < terrain.columns(); ++i) mesh.add_vertex(terrain.vertex(i, j));
  }
  for (std::uint32_t j = 0; j + 1 < rows; ++j) {
    for (std::uint32_t i = 0; i + 1 < columns; ++i) {
      const std::uint32_t v = j * columns + i;
      mesh.add_triangle(v, v + 1, v + columns + 1);
      mesh.add_triangle(v, v + columns + 1, v + columns);
    }
  }
  return {};
}

/// Attaches a mesh of all objects to the scene. A campus without objects gets none, because Embree
/// takes no empty buffers.
/// @return  what each triangle belongs to
Result<std::vector<Surface>> add_objects(RTCDevice device, RTCScene scene, const Campus& campus) {
  std::size_t vertices = 3 * campus.leaves.size(), triangles = campus.leaves.size();
  for (const Solid& solid : campus.solids) {
    for (const Face& face : solid.faces) {
      vertices += face.corners.size();
      triangles += face.corners.size() - 2;
    }
  }
  std::vector<Surface> surfaces;
  if (triangles == 0) return surfaces;
  const Geometry geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
  MeshWriter mesh(geometry.get(), vertices, triangles);
  if (!mesh.is_ready()) return cannot_store_triangles();
  surfaces.reserve(triangles);
  for (const Solid& solid : campus.solids) {
    for (const Face& face : solid.faces) {
      std::vector<std::uint32_t> fan;
      for (const Point& corner : face.corners) fan.push_back(mesh.add_vertex(corner));
      for (std::size_t k = 2; k < fan.size(); ++k) {
        mesh.add_triangle(fan[0], fan[k - 1], fan[k]);
        surfaces.push_back(solid.surface);
      }
    }
  }
  for (const Leaf& leaf : campus.leaves) {
    const std::uint32_t a = mesh.add_vertex(leaf[0]);
    const std::uint32_t b = mesh.add_vertex(leaf[1]);
    mesh.add_triangle(a, b, mesh.add_vertex(leaf[2]));
    surfaces.push_back(Surface::vegetation);
  }
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometryByID(scene, geometry.get(), kObjectGeometry);
  return surfaces;
}

}  // namespace

struct World::Parts {
  Parts(const WorldParams& params, StreetGrid grid, Terrain ground, Campus things)
      : streets(std::move(grid)),
        terrain(std::move(ground)),
        campus(std::move(things)),
        index(campus.solids, terrain.half_size()),
        origin(params.campus.origin_x, params.campus.origin_y, params.campus.origin_z) {}

  StreetGrid streets;
  Terrain terrain;
  Campus campus;
  SolidIndex index;
  Point origin;
  std::vector<Surface> surfaces;  // of the triangles of kObjectGeometry
  Device device;
  Scene scene;
};

Result<World> World::create(const WorldParams& params, Day day, Rays rays) {
  StreetGrid streets(params.campus, params.seed);
  Terrain terrain(params.campus, params.seed);
  Campus campus = make_campus(params.campus, params.seed, streets, terrain);
  if (day == Day::drive && params.changes.any()) {
    VANTAGE_TRY(campus, changed(campus, params, streets, terrain));
  }
  auto parts =
      std::make_unique<Parts>(params, std::move(streets), std::move(terrain), std::move(campus));
  if (rays == Rays::no) return World(std::move(parts));
  parts->device.reset(rtcNewDevice(nullptr));
  RTCDevice device = parts->device.get();
  if (device == nullptr) return embree_error(rtcGetDeviceError(nullptr), "starting");
  parts->scene.reset(rtcNewScene(device));
  RTCScene scene = parts->scene.get();
  if (scene == nullptr) return embree_error(rtcGetDeviceError(device), "making a scene");
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);  // no ray slips between two triangles

  const Geometry ground(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
  VANTAGE_CHECK(write_ground(ground.get(), parts->terrain));
  rtcCommitGeometry(ground.get());
  rtcAttachGeometryByID(scene, ground.get(), kGroundGeometry);
  VANTAGE_TRY(parts->surfaces, add_objects(device, scene, parts->campus));
  {
    // The order of triangles in the tree decides which of two equally near ones is hit. It must not
    // depend on the number of threads.
    const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
    rtcCommitScene(scene);
  }
  if (const RTCError code = rtcGetDeviceError(device); code != RTC_ERROR_NONE) {
    return embree_error(code, "building the scene");
  }
  return World(std::move(parts));
}

World::World(std::unique_ptr<Parts> parts) noexcept : parts_(std::move(parts)) {}
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;
World::~World() = default;

const StreetGrid& World::streets() const noexcept { return parts_->streets; }
const Terrain& World::terrain() const noexcept { return parts_->terrain; }
const Campus& World::campus() const noexcept { return parts_->campus; }
const SolidIndex& World::solids() const noexcept { return parts_->index; }
const Point& World::map_origin() const noexcept { return parts_->origin; }

std::optional<Hit> World::cast(const Point& origin, const Eigen::Vector3d& direction,
                               double max_range) const noexcept {
  if (!parts_->scene) return std::nullopt;
  RTCRayHit query{};
  query.ray.org_x = static_cast<float>(origin.x());
  query.ray.org_y = static_cast<float>(origin.y());
  query.ray.org_z = static_cast<float>(origin.z());
  query.ray.dir_x = static_cast<float>(direction.x());
  query.ray.dir_y = static_cast<float>(direction.y());
  query.ray.dir_z = static_cast<float>(direction.z());
  query.ray.tnear = 0.0F;
  query.ray.tfar = static_cast<float>(max_range);
  query.ray.mask = 0xffffffffU;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect1(parts_->scene.get(), &query);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(parts_->scene.get(), &context, &query);
#endif
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;

  const Eigen::Vector3d normal(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z);
  return Hit{.range = query.ray.tfar,
             .cos_incidence = std::min(1.0, std::abs(normal.normalized().dot(direction))),
             .surface = query.hit.geomID == kGroundGeometry ? Surface::ground
                                                            : parts_->surfaces[query.hit.primID]};
}

}  // namespace vantage::simulation
