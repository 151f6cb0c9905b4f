#include "world/object_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "world/crossing_error.h"
#include "world/shape_surface.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;

/// Meetings lie within the tile's square but for roundings; so much around it is more.
constexpr double kAroundSquare_m = 0x1.0p-10;
/// More than vertices of instances err by.
constexpr double kHeightError_m = 1e-6;

geo::Box3d box_of(const TileId& id) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Eigen::Vector2d corner = id.corner_world();
  const double around = id.side_m() + kAroundSquare_m;
  return {Eigen::Vector3d(corner.x() - kAroundSquare_m, corner.y() - kAroundSquare_m, -kInfinity),
          Eigen::Vector3d(corner.x() + around, corner.y() + around, kInfinity)};
}

[[noreturn]] void fail_height(const std::string& where, const Provenance& provenance,
                              double top_z_world) {
  fail(
      ErrorKind::Input,
      "{}: object {} reaches above z = {} m, where the tile says that nothing does; tile the world "
      "again",
      where, provenance.instance_id, top_z_world);
}

/// Around an upright cylinder that holds an instance.
geo::Box3d box_of_cylinder(const InstanceFrame& frame, const PrototypeLibrary::Shown& shown) {
  constexpr double kRounding = 1.0 + 0x1.0p-40;
  const Eigen::Vector3d up = frame.world_from_prototype * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d reach = frame.scale * shown.radius_m * kRounding *
                                (1.0 - up.array().square()).max(0x1.0p-40).sqrt().matrix();
  geo::Box3d box;
  for (const double z : {shown.mesh.bounds().min().z(), shown.mesh.bounds().max().z()}) {
    const Eigen::Vector3d middle = frame * Eigen::Vector3d(0.0, 0.0, z);
    box.extend(middle - reach);
    box.extend(middle + reach);
  }
  return box;
}

Eigen::Vector3d normal_toward(const WorldRay& ray, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d unit = normal.normalized();
  return unit.dot(ray.direction_world) > 0.0 ? Eigen::Vector3d(-unit) : unit;
}

}  // namespace

ObjectScene::ObjectScene(const TileId& id, TileObjects& objects, double top_z_world,
                         const ObjectRules& rules, const std::string& where) {
  const geo::Box3d clip = box_of(id);
  auto lists = std::make_shared<Lists>();
  solid_mesh_ =
      TriangleMesh(lists->add_solids(objects.solids, clip, top_z_world, rules, where), clip);
  lists->add_instances(objects, clip, top_z_world, rules, where);
  lists->count_bytes();
  take_lists(std::move(lists));
}

ObjectScene::ObjectScene(const Packed& packed) {
  std::vector<std::uint32_t> solid_of;  // by triangle
  const std::vector<ShownSolid>& solids = packed.lists_->solids;
  for (std::uint32_t i = 0; i < solids.size(); ++i)
    solid_of.insert(solid_of.end(), solids[i].shape.triangles.size(), i);
  solid_mesh_ = TriangleMesh(packed.solid_mesh_, [&](std::uint32_t number) {
    const ShownSolid& solid = solids[solid_of[number]];
    return corners_of(solid.shape, number - solid.first_triangle, solid.origin_steps);
  });
  take_lists(packed.lists_);
}

ObjectScene::Packed ObjectScene::packed() const {
  Packed packed;
  packed.lists_ = lists_;
  packed.solid_mesh_ = solid_mesh_.packed();
  return packed;
}

std::size_t ObjectScene::Packed::num_bytes() const {
  return sizeof *this + lists_->num_bytes + solid_mesh_.num_bytes();
}

void ObjectScene::take_lists(std::shared_ptr<const Lists> lists) {
  lists_ = std::move(lists);
  num_solids_ = lists_->num_solids;
  solids_ = lists_->solids;
  placed_ = lists_->placed;
  instances_ = lists_->instances;
  instance_tree_ = &lists_->instance_tree;
  num_bytes_ = sizeof *this + solid_mesh_.num_bytes() + lists_->num_bytes;
}

void ObjectScene::Lists::count_bytes() {
  num_bytes = sizeof *this + instance_tree.num_bytes() + solids.capacity() * sizeof(ShownSolid) +
              placed.capacity() * sizeof(Placed) + instances.capacity() * sizeof(ShownInstance);
  for (const ShownSolid& solid : solids) num_bytes += num_bytes_of(solid.shape);
}

std::vector<TriangleMesh::Triangle> ObjectScene::Lists::add_solids(std::vector<Solid>& tile_solids,
                                                                   const geo::Box3d& clip,
                                                                   double top_z_world,
                                                                   const ObjectRules& rules,
                                                                   const std::string& where) {
  std::vector<TriangleMesh::Triangle> triangles;
  num_solids = static_cast<std::uint32_t>(tile_solids.size());
  for (std::uint32_t object = 0; object < tile_solids.size(); ++object) {
    Solid& solid = tile_solids[object];
    const std::optional<int> level = rules.level_at(solid.place_m.x(), solid.place_m.y());
    const auto shown =
        std::find_if(solid.levels.begin(), solid.levels.end(),
                     [&](const ShapeLevel& one) { return level && *level <= one.coarsest_level; });
    if (shown == solid.levels.end()) continue;
    Shape& shape = shown->shape;
    check_corners(shape, solid.origin_steps,
                  fmt::format("{}: object {}", where, solid.provenance.instance_id));
    geo::Box3d bounds;
    for (const Eigen::Vector3i& vertex : shape.vertices_steps)
      bounds.extend((solid.origin_steps + vertex).cast<double>() * kHeightStep_m);
    if (!bounds.intersects(clip)) continue;
    if (bounds.max().z() > top_z_world) fail_height(where, solid.provenance, top_z_world);
    const std::size_t first = triangles.size();
    if (first + shape.triangles.size() >= BoxTree::kLeaf)
      fail(ErrorKind::Input, "{}: more than {} triangles", where, BoxTree::kLeaf);
    for (std::uint32_t i = 0; i < shape.triangles.size(); ++i)
      triangles.push_back(
          {corners_of(shape, i, solid.origin_steps), static_cast<std::uint32_t>(first) + i});
    solids.push_back({.provenance = solid.provenance,
                      .origin_steps = solid.origin_steps,
                      .object = object,
                      .first_triangle = static_cast<std::uint32_t>(first),
                      .shape = std::move(shape)});
  }
  solids.shrink_to_fit();
  return triangles;
}

void ObjectScene::Lists::add_instances(const TileObjects& objects, const geo::Box3d& clip,
                                       double top_z_world, const ObjectRules& rules,
                                       const std::string& where) {
  std::vector<geo::Box3d> boxes;
  std::vector<Placed> listed;
  std::vector<ShownInstance> shown;
  for (std::uint32_t i = 0; i < objects.instances.size(); ++i) {
    const Instance& instance = objects.instances[i];
    if (instance.prototype >= rules.prototypes.size())
      fail(ErrorKind::Input,
           "{}: object {} is an instance of prototype {}; the world has {}; tile "
           "the world again",
           where, instance.provenance.instance_id, instance.prototype, rules.prototypes.size());
    const Eigen::Vector2d place = instance.place_steps.head<2>().cast<double>() * kHeightStep_m;
    const std::optional<int> level = rules.level_at(place.x(), place.y());
    if (!level || *level > instance.coarsest_level) continue;
    const PrototypeLibrary::Shown* prototype =
        rules.prototypes.shown_at(instance.prototype, *level);
    if (prototype == nullptr || prototype->mesh.bounds().isEmpty()) continue;
    const InstanceFrame frame = instance_frame(instance, rules.frame);
    const geo::Box3d& bounds = prototype->mesh.bounds();
    geo::Box3d box;
    for (int corner = 0; corner < 8; ++corner)
      box.extend(frame * bounds.corner(static_cast<geo::Box3d::CornerType>(corner)));
    box = box.intersection(box_of_cylinder(frame, *prototype));
    if (!box.intersects(clip)) continue;
    if (box.max().z() > top_z_world) {
      for (const Eigen::Vector3i& vertex : prototype->shape.vertices_steps)
        if ((frame * (vertex.cast<double>() * kHeightStep_m)).z() > top_z_world + kHeightError_m)
          fail_height(where, instance.provenance, top_z_world);
    }
    boxes.push_back(box.intersection(clip));
    Placed& one = listed.emplace_back();
    const Eigen::Matrix3d turn =
        (1.0 / frame.scale) * frame.world_from_prototype.conjugate().toRotationMatrix();
    for (int k = 0; k < 9; ++k) one.shape_from_world[k] = static_cast<float>(turn(k / 3, k % 3));
    one.scale = static_cast<float>(frame.scale);
    one.place_steps = instance.place_steps;
    one.object = num_solids + i;
    one.shown = prototype;
    shown.push_back({.world_from_prototype = frame.world_from_prototype,
                     .provenance = instance.provenance,
                     .scale = instance.scale,
                     .variety = instance.variety});
  }
  BoxTree::Leaves leaves;
  instance_tree = BoxTree(boxes, 1, leaves);
  placed.reserve(shown.size());
  instances.reserve(shown.size());
  for (const BoxTree::Leaf& leaf : leaves.leaves) {
    placed.push_back(listed[leaves.order[leaf.begin]]);
    instances.push_back(shown[leaves.order[leaf.begin]]);
  }
}

MeshRay ObjectScene::ray_to_instance(const WorldRay& ray, double length_m,
                                     std::uint32_t shown) const {
  const ShownInstance& instance = instances_[shown];
  const double inverse_scale = 4096.0 / instance.scale;
  const Eigen::Quaterniond prototype_from_world = instance.world_from_prototype.conjugate();
  const Eigen::Vector3d place_world = placed_[shown].place_steps.cast<double>() * kHeightStep_m;
  return {inverse_scale * (prototype_from_world * (ray.origin_world - place_world)),
          inverse_scale * (prototype_from_world * ray.direction_world), length_m, ray.t_min};
}

Eigen::Vector3d ObjectScene::normal_world(const WorldRay& ray, const ObjectMeeting& meeting) const {
  if (meeting.object < num_solids_) {
    const ShownSolid& solid = solids_[meeting.shown];
    return normal_toward(ray,
                         normal_of(corners_of(solid.shape, meeting.triangle, solid.origin_steps)));
  }
  const Eigen::Vector3d normal =
      normal_of(corners_of(placed_[meeting.shown].shown->shape, meeting.triangle));
  return normal_toward(ray, instances_[meeting.shown].world_from_prototype * normal);
}

ObjectSurface ObjectScene::surface(const WorldRay& ray, const ObjectMeeting& meeting,
                                   bool has_error) const {
  const std::uint32_t triangle = meeting.triangle;
  const auto from_place = [&](const Eigen::Vector3i& place_steps) -> Eigen::Vector3f {
    const Eigen::Vector3d place = place_steps.cast<double>() * kHeightStep_m;
    return (ray.origin_world - place + meeting.t * ray.direction_world).cast<float>();
  };
  if (meeting.object < num_solids_) {
    const ShownSolid& solid = solids_[meeting.shown];
    const TriangleCorners corners = corners_of(solid.shape, triangle, solid.origin_steps);
    const Eigen::Vector3d normal = normal_of(corners);
    return {
        .provenance = &solid.provenance,
        .finish = &solid.shape.finishes[solid.shape.triangles[triangle].finish],
        .uv = uv_at(solid.shape, triangle, {ray.origin_world, ray.direction_world}, corners),
        .uv_per_m = uv_per_m(solid.shape, triangle, normal),
        .variety = 0,
        .from_place_m = from_place(solid.origin_steps),
        .reach_m = 0.0f,
        .height_m = 0.0f,
        .crossing_error =
            has_error ? crossing_error(ray.origin_world, ray.direction_world, {}, corners) : 0.0};
  }
  const ShownInstance& instance = instances_[meeting.shown];
  const Placed& placed = placed_[meeting.shown];
  const Shape& shape = placed.shown->shape;
  const TriangleCorners corners = corners_of(shape, triangle);
  const geo::Box3d& bounds = placed.shown->mesh.bounds();
  const double reach_m = std::max(bounds.min().head<2>().cwiseAbs().maxCoeff(),
                                  bounds.max().head<2>().cwiseAbs().maxCoeff());
  const double scale = instance.scale / 4096.0;
  const Eigen::Vector3d normal = normal_of(corners);
  double error = 0.0;
  Eigen::Vector2f uv = Eigen::Vector2f::Zero();
  if (has_error || !shape.uv.empty()) {
    const MeshRay own_ray = ray_to_instance(ray, ray.direction_world.norm(), meeting.shown);
    uv = uv_at(shape, triangle, own_ray.sheared, corners);
    if (has_error)
      error = crossing_error(
          own_ray.origin, own_ray.direction,
          error_of_moved_ray(own_ray.origin, own_ray.direction, instance.world_from_prototype),
          corners);
  }
  return {.provenance = &instance.provenance,
          .finish = &shape.finishes[shape.triangles[triangle].finish],
          .uv = uv,
          .uv_per_m = uv_per_m(shape, triangle, normal) / static_cast<float>(scale),
          .variety = instance.variety,
          .from_place_m = from_place(placed.place_steps),
          .reach_m = static_cast<float>(scale * reach_m),
          .height_m = static_cast<float>(scale * bounds.max().z()),
          .crossing_error = error};
}

}  // namespace terracast::world
