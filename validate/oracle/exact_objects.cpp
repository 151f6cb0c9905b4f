#include "validate/oracle/exact_objects.h"

#include <cmath>
#include <numbers>

#include "core/error.h"

namespace terracast::oracle {
namespace {

constexpr double kStep_m = 0x1.0p-10;
/// A thousand times what the rounding of a parameter, and of the way into a shape's frame, moves a point by at
/// 1000 km.
constexpr double kMargin_m = 1e-6;

/// Anticlockwise from east, in 2^-16 turns.
Eigen::Matrix3d turn_by(std::uint16_t heading) {
  const double angle = heading * 0x1.0p-15 * std::numbers::pi;
  Eigen::Matrix3d turn;
  turn << std::cos(angle), -std::sin(angle), 0.0, std::sin(angle), std::cos(angle), 0.0, 0.0, 0.0,
      1.0;
  return turn;
}

}  // namespace

TreedShape::TreedShape(const world::Shape& shape) : triangles(shape.triangles) {
  for (const Eigen::Vector3i& vertex : shape.vertices_steps)
    vertices_m.emplace_back(vertex.cast<double>() * kStep_m);
  for (const world::Finish& finish : shape.finishes)
    classes.push_back(static_cast<std::uint8_t>(finish.semantic_class));
  std::vector<Box> boxes(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (const std::uint32_t corner : triangles[i].corners) boxes[i].grow(vertices_m[corner]);
  tree = BoxTree(boxes);
}

PrototypeShapes::PrototypeShapes(const world::TileStore& store) {
  for (std::size_t row = 0; row < store.manifest().prototypes.size(); ++row) {
    std::vector<Level>& levels = levels_.emplace_back();
    for (const world::ShapeLevel& level : store.load_prototype(row).levels)
      levels.push_back({level.coarsest_level, std::make_unique<TreedShape>(level.shape)});
  }
}

const TreedShape* PrototypeShapes::at(std::size_t prototype, int level) const {
  for (const Level& candidate : levels_[prototype])
    if (level <= candidate.coarsest_level) return candidate.shape.get();
  return nullptr;
}

ExactObjects::ExactObjects(const world::Tile& tile, const PrototypeShapes& prototypes,
                           const LevelAt& level_at, const WorldFromEnu& world_from_enu) {
  std::vector<Box> boxes;
  const auto add = [&](const Object& object) {
    if (object.shape->tree.is_empty()) return;
    // Of the corners of the shape's own box.
    Box box;
    const Box& own = object.shape->tree.box();
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3d corner((k & 1) != 0 ? own.highest.x() : own.lowest.x(),
                                   (k & 2) != 0 ? own.highest.y() : own.lowest.y(),
                                   (k & 4) != 0 ? own.highest.z() : own.lowest.z());
      box.grow(object.place_world + object.world_from_shape * corner);
    }
    objects_.push_back(object);
    boxes.push_back(box);
  };
  for (const world::Solid& solid : tile.objects.solids) {
    const std::optional<int> level = level_at(solid.place_m.x(), solid.place_m.y());
    const world::Shape* shape = nullptr;
    for (const world::ShapeLevel& candidate : solid.levels)
      if (level && shape == nullptr && *level <= candidate.coarsest_level) shape = &candidate.shape;
    if (shape == nullptr) continue;
    solids_.push_back(std::make_unique<TreedShape>(*shape));
    add({.instance_id = solid.provenance.instance_id,
         .shape = solids_.back().get(),
         .place_world = solid.origin_steps.cast<double>() * kStep_m,
         .world_from_shape = Eigen::Matrix3d::Identity(),
         .scale = 1.0});
  }
  for (const world::Instance& instance : tile.objects.instances) {
    if (instance.prototype >= prototypes.size())
      core::fail(core::ErrorKind::Input,
                 "tile {}: an instance of prototype {}, where the world has {}", tile.id.name(),
                 instance.prototype, prototypes.size());
    const Eigen::Vector3d place_world = instance.place_steps.cast<double>() * kStep_m;
    const std::optional<int> level = level_at(place_world.x(), place_world.y());
    if (!level || *level > instance.coarsest_level) continue;
    const TreedShape* shape = prototypes.at(instance.prototype, *level);
    if (shape == nullptr) continue;
    const double scale = instance.scale / 4096.0;
    add({.instance_id = instance.provenance.instance_id,
         .shape = shape,
         .place_world = place_world,
         .world_from_shape = scale * world_from_enu(place_world) * turn_by(instance.heading),
         .scale = scale});
  }
  tree_ = BoxTree(boxes);
}

std::size_t ExactObjects::num_bytes() const {
  std::size_t sum = objects_.size() * sizeof(Object) + tree_.num_bytes();
  for (const auto& solid : solids_)
    sum += sizeof(TreedShape) + solid->vertices_m.size() * sizeof(Eigen::Vector3d) +
           solid->triangles.size() * sizeof(world::Shape::Triangle) + solid->tree.num_bytes();
  return sum;
}

void ExactObjects::visit(const Eigen::Vector3d& origin_world,
                         const Eigen::Vector3d& direction_world, double t_max,
                         const std::function<void(const ObjectFacet&)>& meet) const {
  tree_.visit(BoxRay(origin_world, direction_world, kMargin_m), t_max, [&](std::uint32_t index) {
    const Object& object = objects_[index];
    const TreedShape& shape = *object.shape;
    // A rotation's inverse is its transpose; of a scaled one it is that by the square of the scale.
    const Eigen::Matrix3d shape_from_world =
        object.world_from_shape.transpose() / (object.scale * object.scale);
    const BoxRay ray(shape_from_world * (origin_world - object.place_world),
                     shape_from_world * direction_world, kMargin_m / object.scale);
    shape.tree.visit(ray, t_max, [&](std::uint32_t triangle) {
      ObjectFacet facet{.instance_id = object.instance_id,
                        .triangle = triangle,
                        .semantic_class = shape.classes[shape.triangles[triangle].finish],
                        .corners_world = {}};
      for (std::size_t k = 0; k < 3; ++k)
        facet.corners_world[k] =
            object.place_world +
            object.world_from_shape * shape.vertices_m[shape.triangles[triangle].corners[k]];
      meet(facet);
    });
  });
}

}  // namespace terracast::oracle
