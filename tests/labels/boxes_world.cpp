#include "tests/labels/boxes_world.h"

#include <cmath>
#include <numbers>

#include "core/log.h"
#include "core/parallel.h"
#include "core/toml_reader.h"
#include "geo/frames.h"
#include "labels/label.h"
#include "tests/support/tiny_world.h"
#include "world/objects_file.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;
using world::kHeightStep_m;

Eigen::Vector3i steps_of(const Vector3d& place_m) {
  return (place_m / kHeightStep_m).array().round().matrix().cast<int>();
}

world::Shape box_shape(const Vector3d& low, const Vector3d& high,
                       core::SemanticClass semantic_class,
                       const std::array<std::uint8_t, 3>& color_srgb = world::Finish().color_srgb) {
  world::Shape shape;
  for (int k = 0; k < 8; ++k)
    shape.vertices_steps.push_back(
        steps_of({(k & 1) != 0 ? high.x() : low.x(), (k & 2) != 0 ? high.y() : low.y(),
                  (k & 4) != 0 ? high.z() : low.z()}));
  constexpr std::uint32_t kFaces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                           {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                           {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& face : kFaces)
    shape.triangles.push_back({.corners = {face[0], face[1], face[2]}, .finish = 0});
  shape.finishes.push_back({.material = world::Material::Plain,
                            .semantic_class = semantic_class,
                            .color_srgb = color_srgb});
  return shape;
}

world::Solid solid_of(const WorldBox& box) {
  world::Solid solid;
  solid.provenance = {
      .instance_id = box.instance_id, .layer = 0, .feature = 1000 + box.instance_id};
  const Vector3d middle = 0.5 * (box.low + box.high);
  solid.place_m = middle.head<2>().cast<int>();
  solid.origin_steps = steps_of(Vector3d(middle.x(), middle.y(), box.low.z()));
  const Vector3d origin = solid.origin_steps.cast<double>() * kHeightStep_m;
  solid.levels = {
      {127, box_shape(box.low - origin, box.high - origin, box.semantic_class, box.color_srgb)}};
  return solid;
}

world::Instance instance_of(const WorldThing& thing) {
  world::Instance instance;
  instance.provenance = {.instance_id = thing.instance_id, .layer = 0, .feature = 5};
  instance.prototype = 0;
  instance.place_steps = steps_of(thing.place);
  instance.heading = static_cast<std::uint16_t>(
      std::lround(thing.heading_rad / (2.0 * std::numbers::pi) * 65536.0));
  instance.scale = static_cast<std::uint16_t>(std::lround(thing.scale * 4096.0));
  return instance;
}

}  // namespace

bool WorldBox::is_met(const Vector3d& origin, const Vector3d& direction) const {
  double t_in = 0.0, t_out = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (low[axis] - origin[axis]) / direction[axis];
    const double b = (high[axis] - origin[axis]) / direction[axis];
    t_in = std::max(t_in, std::min(a, b));
    t_out = std::min(t_out, std::max(a, b));
  }
  return t_in <= t_out;
}

std::vector<Vector3d> WorldBox::corners() const {
  std::vector<Vector3d> all;
  for (int k = 0; k < 8; ++k)
    all.emplace_back((k & 1) != 0 ? high.x() : low.x(), (k & 2) != 0 ? high.y() : low.y(),
                     (k & 4) != 0 ? high.z() : low.z());
  return all;
}

world::TileStore make_boxes_world(const std::filesystem::path& folder,
                                  const std::vector<WorldBox>& boxes,
                                  const std::vector<WorldThing>& things) {
  const world::TileStore bare = make_tiny_world(folder, [](double, double) { return 0.0; });
  world::WorldManifest manifest = bare.manifest();
  manifest.layers.push_back({.name = "town",
                             .kind = "objects",
                             .source = "town.gpkg",
                             .content_hash = "",
                             .licence = "CC0",
                             .accuracy = "",
                             .counts = {}});
  manifest.prototypes.push_back(world::write_prototype(
      folder, 0,
      {"cart", {{127, box_shape(kPrototypeLow, kPrototypeHigh, core::SemanticClass::Car)}}}));
  world::TileObjects objects;
  for (const WorldBox& box : boxes) objects.solids.push_back(solid_of(box));
  for (const WorldThing& thing : things) objects.instances.push_back(instance_of(thing));
  for (world::TileInfo& info : manifest.tiles) {
    world::Tile tile = bare.load(info.id);
    tile.objects = objects;
    tile.objects_top_steps = static_cast<std::int32_t>(200.0 / kHeightStep_m);
    info = world::write_tile(folder, tile);
  }
  world::write_manifest(folder, manifest);
  return world::TileStore::open(folder);
}

geo::BodyState body_at(const Vector3d& place, int frame) {
  geo::BodyState state;
  state.time_s = 0.1 * frame;
  state.world_from_body.translation = place;
  return state;
}

render::SequencePlan level_plan(int num_frames) {
  render::SequencePlan plan;
  plan.name = "boxes";
  plan.utc_start = "2025-06-21T10:00:00Z";
  for (int i = 0; i < num_frames; ++i)
    plan.states.push_back(body_at({0.0, 0.0, 50.0 + 0.5 * i}, i));
  plan.cameras = {{.rig = "mcs4",
                   .name = "cam0",
                   .intrinsics = {.model = "pinhole",
                                  .width_px = 200,
                                  .height_px = 160,
                                  .parameters = {200.0, 200.0, 100.0, 80.0}},
                   .rig_from_camera = {Eigen::Quaterniond(geo::rig_from_rdf()), Vector3d::Zero()},
                   .body_from_rig = {}}};
  plan.tracks.num_points = 50;
  plan.detail = {.cell_px = 64.0, .finest_spacing_m = 4.0};
  plan.conditions.color_samples = 1;
  plan.config_toml = "name = \"boxes\"\n";
  return plan;
}

capture::SequenceReader render_plan(const world::TileStore& store, const render::SequencePlan& plan,
                                    const std::filesystem::path& folder) {
  const core::Log log("render", core::LogLevel::Off);
  render::run_render_stage(store, plan, {}, {}, folder, {.log = log});
  return capture::SequenceReader::open(folder);
}

scene::MovingShape moving_box(const Vector3d& low, const Vector3d& high,
                              core::SemanticClass semantic_class) {
  return {.thing = "box",
          .shown = std::make_shared<const world::PrototypeLibrary::Shown>(
              box_shape(low, high, semantic_class))};
}

void make_labels(const capture::SequenceReader& sequence, const world::TileStore& store,
                 const std::string& kind, int num_threads,
                 const std::vector<scene::MovingThing>& things) {
  make_labels_with(sequence, store, "kind = \"" + kind + "\"\n", things, num_threads);
}

void make_labels_with(const capture::SequenceReader& sequence, const world::TileStore& store,
                      const std::string& toml, const std::vector<scene::MovingThing>& things,
                      int num_threads) {
  const core::Log log("label", core::LogLevel::Off);
  const core::ThreadLimit limit(num_threads);
  std::vector<labels::LabelOptions> options(1);
  core::TomlDocument::parse(toml, "test.toml").read(options[0]);
  labels::run_label_stage(sequence, store, things, options,
                          {.log = log, .num_threads = num_threads});
}

}  // namespace terracast::test
