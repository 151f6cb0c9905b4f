#include "scene/scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "world/sea_bed.h"

namespace terracast::scene {
namespace {

/// Whether any tile may hold water.
bool may_have_water(const world::WorldManifest& manifest) {
  const auto is_sea = [](const world::SourceInfo& source) { return source.kind == "sea"; };
  const auto brings_water = [](const world::LayerInfo& layer) {
    // Those of plug-ins, which have a dot in their names, may.
    return layer.kind == "water" || layer.kind == "land_cover" ||
           layer.kind.find('.') != std::string::npos;
  };
  return std::any_of(manifest.sources.begin(), manifest.sources.end(), is_sea) ||
         std::any_of(manifest.layers.begin(), manifest.layers.end(), brings_water);
}

bool has_bed(const world::TileStore& store, const ConditionOptions& conditions) {
  return conditions.bottom_range || may_have_water(store.manifest());
}

bool is_under_surface(const world::RayQuery& whole, const Eigen::Vector3d& viewer_world) {
  const std::optional<double> surface_z = whole.surface_z_world(viewer_world.x(), viewer_world.y());
  return surface_z && viewer_world.z() < *surface_z;
}

/// The time among ascending ones that is nearest.
std::size_t nearest_index(const std::vector<double>& times_s, double time_s) {
  const auto next = std::lower_bound(times_s.begin(), times_s.end(), time_s);
  if (next == times_s.begin()) return 0;
  const auto index = static_cast<std::size_t>(next - times_s.begin());
  if (next == times_s.end()) return index - 1;
  return *next - time_s < time_s - times_s[index - 1] ? index : index - 1;
}

}  // namespace

/// What light falls on and through.
struct Scene::Looks {
  GroundImagery imagery;
  TextureLibrary textures;
  std::vector<std::unique_ptr<Medium>> media;
};

Scene::Scene(const world::TileStore& store, std::vector<world::CutTile> cut,
             std::span<const MovingThing> moving, const SceneOptions& options)
    : store_(store),
      frame_(store.manifest().origin),
      options_(options),
      whole_(store, std::move(cut), options.tracing),
      own_moving_(std::in_place, moving, whole_, frame_),
      moving_(*own_moving_) {
  open_bed();
}

Scene::Scene(const world::TileStore& store, std::vector<world::CutTile> cut,
             const MovingBodies& moving, const SceneOptions& options)
    : store_(store),
      frame_(store.manifest().origin),
      options_(options),
      whole_(store, std::move(cut), options.tracing),
      moving_(moving) {
  open_bed();
}

void Scene::open_bed() {
  if (!has_bed(store_, conditions())) return;
  is_in_water_ = is_under_surface(whole_, options_.viewer_world);
  bed_.emplace(whole_, world::RayQuery::WithoutWater{.viewers_in_water = is_in_water_});
}

Scene::~Scene() = default;

const Ground& Scene::ground() const {
  std::call_once(ground_once_, [&] {
    ground_.emplace(climate_of(store_, world::sea_bed::noise_seed(store_.manifest().seed)));
  });
  return *ground_;
}

const Daylight& Scene::daylight() const {
  std::call_once(daylight_once_, [&] {
    daylight_ = daylight_at(options_.position_world, options_.utc_start, conditions(), frame_);
  });
  return *daylight_;
}

const Sky& Scene::sky() const {
  std::call_once(sky_once_, [&] { sky_.emplace(daylight()); });
  return *sky_;
}

const Scene::Looks& Scene::looks() const {
  std::call_once(looks_once_, [&] {
    looks_ = std::unique_ptr<Looks>(new Looks{
        .imagery = GroundImagery(store_, whole_.imagery_budget_bytes()),
        .textures = TextureLibrary(store_),
        .media = make_media(
            conditions().media,
            {.store = store_, .sky = sky(), .sea_level_m = ground().climate().sea_level_m})});
  });
  return *looks_;
}

const GroundImagery& Scene::imagery() const { return looks().imagery; }
const TextureLibrary& Scene::textures() const { return looks().textures; }
std::span<const std::unique_ptr<Medium>> Scene::media() const { return looks().media; }

SceneAt Scene::at(double time_s, double reach_s) const { return {*this, time_s, reach_s}; }

SceneAt::SceneAt(const Scene& scene, double time_s, double reach_s)
    : scene_(scene),
      shift_s_(scene.options_.times_s.empty()
                   ? 0.0
                   : time_s -
                         scene.options_.times_s[nearest_index(scene.options_.times_s, time_s)]),
      moving_(scene.moving_.is_empty() ? world::MovingScene()
                                       : scene.moving_.scene(static_cast<int>(nearest_index(
                                                                 scene.options_.times_s, time_s)),
                                                             reach_s + std::abs(shift_s_))),
      whole_(scene.whole_, moving_),
      bed_(scene.bed_ ? *scene.bed_ : scene.whole_, moving_),
      viewed_(scene.viewed(), moving_) {
  if (moving_.is_empty()) shift_s_ = 0.0;
}

void SceneAt::trace(std::span<const world::WorldRay> rays, std::span<const double> offsets_s,
                    std::span<world::SurfaceHit> hits, world::Coherence coherence,
                    std::span<world::SurfaceSample> surfaces, world::RayTrail* trail,
                    world::SurfaceNeed need) const {
  if (shift_s_ == 0.0) {
    viewed_.intersect(rays, offsets_s, hits, coherence, surfaces, trail, need);
    return;
  }
  std::vector<double> times_s(rays.size(), shift_s_);
  for (std::size_t i = 0; i < offsets_s.size(); ++i) times_s[i] += offsets_s[i];
  viewed_.intersect(rays, times_s, hits, coherence, surfaces, trail, need);
}

}  // namespace terracast::scene
