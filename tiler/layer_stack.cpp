#include "tiler/layer_stack.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <unordered_set>

#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/plugin_rows.h"
#include "core/random.h"
#include "tiler/bed_site.h"
#include "tiler/country/country.h"
#include "tiler/dry_paint.h"
#include "tiler/imagery/imagery_pyramid.h"
#include "tiler/instance_ids.h"
#include "tiler/known_rasters.h"
#include "tiler/surveyed_ground.h"
#include "world/climate.h"

namespace terracast::tiler {
namespace {

using world::kHeightStep_m;

/// Water of which nobody knows the bed is that deep.
constexpr double kUnknownDepth_m = 2.0;

/// Tiles of the finest level are this wide.
constexpr double kFinestSide_m = 32.0;
/// Beyond the tile that holds its place an object is shown by that tile's level, which is finer than
/// the tiles over which it reaches by two levels at a corner, and by one more for each doubling of its reach.
constexpr int kLevelsAtCorner = 2;

/// Of an object in the plane and upward, in steps.
struct Extent {
  Eigen::Vector2d lowest_m;
  Eigen::Vector2d highest_m;
  double top_m;

  bool overlaps(const world::TileId& id) const {
    const Eigen::Vector2d corner = id.corner_world();
    return lowest_m.x() <= corner.x() + id.side_m() && highest_m.x() >= corner.x() &&
           lowest_m.y() <= corner.y() + id.side_m() && highest_m.y() >= corner.y();
  }
};

Extent extent_of(const world::Solid& solid) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Extent extent{Eigen::Vector2d::Constant(kInfinity), Eigen::Vector2d::Constant(-kInfinity),
                -kInfinity};
  for (const world::ShapeLevel& level : solid.levels)
    for (const Eigen::Vector3i& vertex : level.shape.vertices_steps) {
      const Eigen::Vector3d place_m = (solid.origin_steps + vertex).cast<double>() * kHeightStep_m;
      extent.lowest_m = extent.lowest_m.cwiseMin(place_m.head<2>());
      extent.highest_m = extent.highest_m.cwiseMax(place_m.head<2>());
      extent.top_m = std::max(extent.top_m, place_m.z());
    }
  return extent;
}

/// How far a prototype of scale 1 reaches from its foot, however it is turned and leant.
double reach_m(const world::Prototype& prototype) {
  double largest = 0.0;
  for (const world::ShapeLevel& level : prototype.levels)
    for (const Eigen::Vector3i& vertex : level.shape.vertices_steps)
      largest = std::max(largest, vertex.cast<double>().norm());
  return largest * kHeightStep_m;
}

Extent extent_of(const world::Instance& instance, double prototype_reach_m) {
  const double reach = prototype_reach_m * instance.scale / 4096.0;
  const Eigen::Vector3d place_m = instance.place_steps.cast<double>() * kHeightStep_m;
  return {place_m.head<2>().array() - reach, place_m.head<2>().array() + reach,
          place_m.z() + reach};
}

bool is_shown(const Extent& extent, const Eigen::Vector2d& place_m, int coarsest_level,
              const world::TileId& id) {
  if (!extent.overlaps(id)) return false;
  if (world::tile_at(id.level, place_m.x(), place_m.y()) == id) return id.level <= coarsest_level;
  const double reach_m = (extent.highest_m - extent.lowest_m).maxCoeff();
  const int doublings =
      static_cast<int>(std::ceil(std::log2(std::max(reach_m / kFinestSide_m, 1.0))));
  return id.level - kLevelsAtCorner - doublings <= coarsest_level;
}

class Site final : public LayerSite, public BedSite {
 public:
  /// bare   the ground without the layers of the stack
  Site(const WorldSurface& bare, const LayerStack& stack,
       const std::vector<std::unique_ptr<Layer>>& layers, const Layer& asking)
      : bare_(bare), stack_(stack), layers_(layers), asking_(asking) {}

  double ground_z_world(const Eigen::Vector2d& place_world) const override {
    return stack_.shaped_z_world(place_world, sample(place_world));
  }
  world::Cover cover(const Eigen::Vector2d& place_world) const override {
    return stack_.shaped_cover(place_world, sample(place_world));
  }
  bool has_walls_near(const Eigen::Vector2d& place_world, double within_m) const override {
    return std::any_of(layers_.begin(), layers_.end(), [&](const auto& layer) {
      return layer->has_walls_near(place_world, within_m);
    });
  }
  bool is_free(const Eigen::Vector2d& place_world, double radius_m) const override {
    if (!is_unheld(place_world, radius_m)) return false;
    const auto is_dry = [&](double dx, double dy) {
      const Eigen::Vector2d at = place_world + Eigen::Vector2d(dx * radius_m, dy * radius_m);
      return !stack_.is_shaped_water(at, sample(at));
    };
    return is_dry(0, 0) &&
           (radius_m == 0.0 || (is_dry(-1, 0) && is_dry(1, 0) && is_dry(0, -1) && is_dry(0, 1)));
  }
  double water_depth_m(const Eigen::Vector2d& place_world) const override {
    return stack_.shaped(place_world, sample(place_world)).water_depth_m;
  }
  bool is_unheld(const Eigen::Vector2d& place_world, double radius_m) const override {
    return std::none_of(layers_.begin(), layers_.end(), [&](const auto& layer) {
      return layer.get() != &asking_ && layer->holds(place_world, radius_m);
    });
  }
  bool is_kept_low(const Eigen::Vector2d& place_world, double radius_m) const override {
    return std::any_of(layers_.begin(), layers_.end(),
                       [&](const auto& layer) { return layer->keeps_low(place_world, radius_m); });
  }

 private:
  SurfaceSample sample(const Eigen::Vector2d& place_world) const {
    return bare_.sample(place_world.x(), place_world.y());
  }

  const WorldSurface& bare_;
  const LayerStack& stack_;
  const std::vector<std::unique_ptr<Layer>>& layers_;
  const Layer& asking_;
};

class LayeredSurface final : public WorldSurface, public KnownRasters {
 public:
  LayeredSurface(std::shared_ptr<const WorldSurface> surface, LayerStack layers)
      : surface_(std::move(surface)), layers_(std::move(layers)) {}

  const geo::WorldFrame& frame() const override { return surface_->frame(); }
  const WorldOptions& options() const override { return surface_->options(); }
  const std::vector<world::SourceInfo>& sources() const override { return surface_->sources(); }
  std::vector<std::optional<world::RasterInfo>> rasters() const override {
    return rasters_of(*surface_);
  }
  int measured_level() const override { return surface_->measured_level(); }
  int base_level() const override { return surface_->base_level(); }
  std::string input_hash() const override {
    return core::content_hash(surface_->input_hash() + " " + layers_.input_hash());
  }
  SurfaceSample sample(double x_world, double y_world) const override {
    return layers_.shaped({x_world, y_world}, surface_->sample(x_world, y_world));
  }
  void sample_tile(const world::TileId& id, std::span<SurfaceSample> samples) const override {
    surface_->sample_tile(id, samples);
    const Eigen::Vector2d corner = id.corner_world();
    for (int j = 0; j < world::kTileSamples; ++j)
      for (int i = 0; i < world::kTileSamples; ++i) {
        SurfaceSample& sample = samples[world::Tile::sample(i, j)];
        sample = layers_.shaped(corner + id.spacing_m() * Eigen::Vector2d(i, j), sample);
      }
  }
  void complete() const override { surface_->complete(); }
  void keep_ground(const std::filesystem::path& store) const override {
    surface_->keep_ground(store);
  }
  const LayerStack& layers() const override { return layers_; }
  double lowest_m() const override { return surface_->lowest_m(); }
  double highest_m() const override { return surface_->highest_m(); }
  std::optional<double> measured_height_m(double lat_deg, double lon_deg) const override {
    return surface_->measured_height_m(lat_deg, lon_deg);
  }

 private:
  std::shared_ptr<const WorldSurface> surface_;
  LayerStack layers_;
};

auto order_of(const world::Provenance& provenance) {
  return std::tuple(provenance.layer, provenance.feature, provenance.instance_id);
}
auto order_of(const world::Coating& coating) { return std::tuple(coating.layer, coating.feature); }

/// From a layer's own count of textures to the world's.
void number_textures(world::ShapeLevels& levels, std::size_t first, std::size_t count,
                     const std::string& layer) {
  for (world::ShapeLevel& level : levels)
    for (world::Finish& finish : level.shape.finishes) {
      if (finish.material != world::Material::Textured) continue;
      TERRACAST_CHECK(finish.pattern < count, "layer {} shows its texture {} of {}", layer,
                      finish.pattern, count);
      finish.pattern = static_cast<std::uint16_t>(first + finish.pattern);
    }
}

void append(const SurveyedGround& from, SurveyedGround& to) {
  to.buildings.insert(to.buildings.end(), from.buildings.begin(), from.buildings.end());
  to.areas.insert(to.areas.end(), from.areas.begin(), from.areas.end());
  to.content_hash += from.content_hash;
}

/// What layers know of the ground: each is asked once, when its own turn comes or when the first
/// layer asks for the country. What they read is there until their layers are made of it.
class Surveys {
 public:
  explicit Surveys(std::size_t num_layers) : asked_(num_layers) {}

  void ask(std::size_t row, const LayerKind& kind, const LayerInputs& inputs) {
    if (asked_[row].is_asked) return;
    if (const auto* surveying = dynamic_cast<const SurveyingKind*>(&kind))
      asked_[row].survey = surveying->survey(inputs);
    if (asked_[row].survey) asked_[row].ground = asked_[row].survey->ground();
    asked_[row].is_asked = true;
  }
  /// Once. Nothing: its sources say nothing.
  std::unique_ptr<GroundSurvey> take(std::size_t row) { return std::move(asked_[row].survey); }
  SurveyedGround all() const {
    SurveyedGround all;
    for (const Asked& asked : asked_) append(asked.ground, all);
    return all;
  }

 private:
  struct Asked {
    bool is_asked = false;
    std::unique_ptr<GroundSurvey> survey;
    SurveyedGround ground;
  };
  std::vector<Asked> asked_;
};

void check_ids(const world::Tile& tile) {
  std::unordered_set<std::uint32_t> seen;
  const auto check = [&](const world::Provenance& provenance) {
    TERRACAST_CHECK(provenance.instance_id != 0 && seen.insert(provenance.instance_id).second,
                    "tile {}: layer {} gives the id {} twice or to nothing", tile.id.name(),
                    provenance.layer, provenance.instance_id);
  };
  for (const world::Solid& solid : tile.objects.solids) check(solid.provenance);
  for (const world::Instance& instance : tile.objects.instances) check(instance.provenance);
}

}  // namespace

double lift_share(const Eigen::Vector2d& place_world, double half_size_m) {
  constexpr double kFade_m = 100.0;
  return std::clamp((half_size_m - place_world.cwiseAbs().maxCoeff()) / kFade_m, 0.0, 1.0);
}

LayerStack::LayerStack(const WorldSurface& surface, const core::Context& context)
    : half_size_m_(surface.options().size_m / 2.0),
      dryness_(Dryness::of(surface.options(), surface.frame(), &context.log)),
      tree_line_m_(world::tree_line_m(surface.frame().origin().lat_deg)) {
  const WorldOptions& options = surface.options();
  InstanceIds ids;
  const auto inputs_of = [&](const LayerOptions& layer,
                             std::function<const Country&()> country) -> LayerInputs {
    return {.frame = surface.frame(),
            .size_m = options.size_m,
            .seed = core::stream_of(static_cast<std::uint64_t>(options.seed),
                                    static_cast<std::uint64_t>(layer.seed)),
            .surface = surface,
            .earlier = layers_,
            .ids = ids,
            .country = std::move(country),
            .licence = layer.licence,
            .accuracy = layer.accuracy,
            .context = context};
  };
  Surveys surveys(options.layers.size());
  std::optional<Country> country;
  const auto whole_country = [&]() -> const Country& {
    if (country) return *country;
    for (std::size_t row = 0; row < options.layers.size(); ++row) {
      const LayerOptions& layer = options.layers[row];
      core::with_context([&] { surveys.ask(row, layer.kind_options(), inputs_of(layer, {})); },
                         fmt::format("asking what layer {} knows of the ground",
                                     layer.name.empty() ? layer.kind : layer.name));
    }
    return country.emplace(surface, static_cast<std::uint64_t>(options.seed), context,
                           surveys.all());
  };
  for (std::size_t row = 0; row < options.layers.size(); ++row) {
    const LayerOptions& layer = options.layers[row];
    LayerOptions named = layer;
    if (named.name.empty()) named.name = named.kind;
    const auto make = [&] {
      surveys.ask(row, layer.kind_options(), inputs_of(layer, {}));
      const LayerInputs inputs = inputs_of(layer, whole_country);
      const std::unique_ptr<GroundSurvey> survey = surveys.take(row);
      add(core::made(survey ? survey->make(inputs) : layer.kind_options().make(inputs), "layer",
                     layer.kind),
          named);
    };
    core::with_context(make, fmt::format("preparing layer {}", named.name));
  }
}

LayerStack::LayerStack(double size_m, std::vector<std::unique_ptr<Layer>> layers)
    : half_size_m_(size_m / 2.0) {
  for (std::unique_ptr<Layer>& layer : layers) {
    LayerOptions options;
    options.name = fmt::format("{}", layers_.size());
    add(std::move(layer), options);
  }
}

void LayerStack::add(std::unique_ptr<Layer> layer, const LayerOptions& options) {
  world::LayerInfo info = layer->info();
  info.name = options.name;
  info.kind = options.kind;
  info.licence = options.licence;
  info.accuracy = options.accuracy;
  infos_.push_back(std::move(info));
  first_prototype_.push_back(prototypes_.size());
  const std::span<const world::Prototype> own = layer->prototypes();
  prototypes_.insert(prototypes_.end(), own.begin(), own.end());
  for (const world::Prototype& prototype : own) reaches_m_.push_back(reach_m(prototype));
  const std::span<const world::Texture> images = layer->textures();
  first_texture_.push_back(textures_.size());
  for (std::size_t row = first_prototype_.back(); row < prototypes_.size(); ++row)
    number_textures(prototypes_[row].levels, textures_.size(), images.size(), options.name);
  for (const world::Texture& texture : images)
    world::check_texture(texture.name, texture.image.width(), texture.image.height(),
                         texture.image.channels());
  textures_.insert(textures_.end(), images.begin(), images.end());
  if (textures_.size() > std::numeric_limits<std::uint16_t>::max())
    core::fail(core::ErrorKind::Input, "{} textures with those of layer {}; a world holds {}",
               textures_.size(), options.name, std::numeric_limits<std::uint16_t>::max());
  const int row = static_cast<int>(layers_.size());
  for (const auto& pyramid : layer->imagery()) imagery_.emplace_back(row, pyramid.get());
  for (world::VolumePlace place : layer->volume_places()) {
    TERRACAST_CHECK(
        place.volume >= 0 && static_cast<std::size_t>(place.volume) < layer->volumes().size(),
        "layer {} places its volume {}", options.name, place.volume);
    place.volume += static_cast<int>(volumes_.size());
    place.layer = row;
    volume_places_.push_back(place);
  }
  for (const world::Volume& volume : layer->volumes()) volumes_.push_back(volume);
  told_.add(*layer);
  layers_.push_back(std::move(layer));
}

world::WayNetwork LayerStack::ways() const {
  world::WayNetwork all;
  for (std::size_t row = 0; row < layers_.size(); ++row) {
    world::WayNetwork own = layers_[row]->ways();
    for (world::WayPart& part : own.parts) {
      part.layer = static_cast<std::uint8_t>(row);
      part.from_node += all.num_nodes;
      part.to_node += all.num_nodes;
      all.parts.push_back(std::move(part));
    }
    all.num_nodes += own.num_nodes;
  }
  return all;
}

std::vector<std::vector<world::CoverRasterInfo>> LayerStack::cover_rasters() const {
  std::vector<std::vector<world::CoverRasterInfo>> all(layers_.size());
  for (std::size_t row = 0; row < layers_.size(); ++row)
    if (const auto* known = dynamic_cast<const KnownCovers*>(layers_[row].get()))
      all[row] = known->cover_rasters();
  return all;
}

world::CoverRows LayerStack::cover_rows() const {
  return [this](std::size_t layer, std::size_t raster, int row, std::span<std::uint8_t> covers) {
    dynamic_cast<const KnownCovers&>(*layers_[layer]).tell_row(raster, row, covers);
  };
}

bool LayerStack::has_cover_raster() const {
  return std::any_of(infos_.begin(), infos_.end(), [](const world::LayerInfo& layer) {
    return layer.kind == "land_cover" && layer.source != "derived";
  });
}

std::string LayerStack::input_hash() const {
  std::string all;
  for (std::size_t i = 0; i < layers_.size(); ++i)
    all += fmt::format("{} {} {} {} {}\n", infos_[i].kind, infos_[i].name, infos_[i].licence,
                       infos_[i].accuracy, layers_[i]->input_hash());
  if (dryness_) all += dryness_->content_hash();
  all += core::plugin_marks(all);
  return core::content_hash(all);
}

bool LayerStack::is_layered(const Eigen::Vector2d& place_world, const SurfaceSample& sample) const {
  return (!layers_.empty() || dryness_) && place_world.cwiseAbs().maxCoeff() < half_size_m_ &&
         sample.cover == world::Cover::Land;
}

SurfaceSample LayerStack::shaped(const Eigen::Vector2d& place_world, SurfaceSample sample) const {
  // Beyond the square no cover is told; what is drawn there follows the moisture.
  if (dryness_ && sample.cover == world::Cover::Outside)
    sample.moisture =
        static_cast<std::uint8_t>(std::lround(sample.moisture * dryness_->growth(place_world)));
  if (!is_layered(place_world, sample)) return sample;
  const std::optional<ToldCovers::Told> told = told_.at(place_world, sample);
  const bool has_water = told && is_water(told->cover);
  const double depth_m =
      has_water ? told->by->water_depth_m(place_world, sample).value_or(kUnknownDepth_m) : 0.0;
  sample.z_world = shaped_z_world(place_world, sample);
  sample.cover = told ? told->cover : untold_cover(place_world, sample);
  sample.water_depth_m = depth_m;
  return sample;
}

double LayerStack::shaped_z_world(const Eigen::Vector2d& place_world,
                                  const SurfaceSample& sample) const {
  if (!is_layered(place_world, sample)) return sample.z_world;
  double lift_m = 0.0;
  for (const auto& layer : layers_) lift_m += layer->lift_m(place_world, sample);
  return sample.z_world + lift_m * lift_share(place_world, half_size_m_);
}

world::Cover LayerStack::shaped_cover(const Eigen::Vector2d& place_world,
                                      const SurfaceSample& sample) const {
  if (!is_layered(place_world, sample)) return sample.cover;
  const std::optional<ToldCovers::Told> told = told_.at(place_world, sample);
  return told ? told->cover : untold_cover(place_world, sample);
}

world::Cover LayerStack::untold_cover(const Eigen::Vector2d& place_world,
                                      const SurfaceSample& sample) const {
  if (!dryness_) return sample.cover;
  const world::Cover cover =
      dryness_->cover(place_world, sample.moisture / 255.0).value_or(sample.cover);
  // Up there nothing knows better than the guesses of rock and snow, which bare ground keeps.
  const double height_m =
      sample.z_world + place_world.squaredNorm() / (2.0 * geo::kWgs84SemiMajorAxis_m);
  return cover == world::Cover::Shrubs && height_m > tree_line_m_ ? world::Cover::Bare : cover;
}

bool LayerStack::is_shaped_water(const Eigen::Vector2d& place_world,
                                 const SurfaceSample& sample) const {
  if (!is_layered(place_world, sample)) return is_water(sample.cover);
  return told_.is_water(place_world, sample);
}

void LayerStack::add_objects(world::Tile& tile) const {
  double top_m = -std::numeric_limits<double>::infinity();
  world::TileObjects& all = tile.objects;
  for (std::size_t row = 0; row < layers_.size(); ++row) {
    world::TileObjects own;
    const std::size_t num_textures = layers_[row]->textures().size();
    layers_[row]->add_objects(tile.id, Site(*bare_, *this, layers_, *layers_[row]), own);
    for (world::Solid& solid : own.solids) {
      solid.provenance.layer = static_cast<std::uint8_t>(row);
      number_textures(solid.levels, first_texture_[row], num_textures, infos_[row].name);
      const Extent extent = extent_of(solid);
      const int coarsest_level = solid.levels.back().coarsest_level;
      if (!is_shown(extent, solid.place_m.cast<double>(), coarsest_level, tile.id)) continue;
      top_m = std::max(top_m, extent.top_m);
      all.solids.push_back(std::move(solid));
    }
    for (world::Instance& instance : own.instances) {
      instance.provenance.layer = static_cast<std::uint8_t>(row);
      const std::size_t prototype = first_prototype_[row] + instance.prototype;
      instance.prototype = static_cast<std::uint16_t>(prototype);
      const Extent extent = extent_of(instance, reaches_m_[prototype]);
      const int coarsest_level = std::min<int>(instance.coarsest_level,
                                               prototypes_[prototype].levels.back().coarsest_level);
      const Eigen::Vector2d place_m = instance.place_steps.head<2>().cast<double>() * kHeightStep_m;
      if (!is_shown(extent, place_m, coarsest_level, tile.id)) continue;
      top_m = std::max(top_m, extent.top_m);
      all.instances.push_back(instance);
    }
    for (world::Strip& strip : own.strips) {
      strip.coating.layer = static_cast<std::uint8_t>(row);
      all.strips.push_back(std::move(strip));
    }
    for (world::Area& area : own.areas) {
      area.coating.layer = static_cast<std::uint8_t>(row);
      all.areas.push_back(std::move(area));
    }
  }
  end_paint_at_water(tile, [&](const Eigen::Vector2d& place_world) {
    return shaped_cover(place_world, bare_->sample(place_world.x(), place_world.y()));
  });
  const auto by_provenance = [](const auto& a, const auto& b) {
    return order_of(a.provenance) < order_of(b.provenance);
  };
  const auto by_coating = [](const auto& a, const auto& b) {
    return order_of(a.coating) < order_of(b.coating);
  };
  std::sort(all.solids.begin(), all.solids.end(), by_provenance);
  std::sort(all.instances.begin(), all.instances.end(), by_provenance);
  // A feature may have several parts; a layer gives them in one order.
  std::stable_sort(all.strips.begin(), all.strips.end(), by_coating);
  std::stable_sort(all.areas.begin(), all.areas.end(), by_coating);
  check_ids(tile);
  if (std::isfinite(top_m))
    tile.objects_top_steps =
        static_cast<std::int32_t>(std::ceil((top_m - tile.center_z_m) / kHeightStep_m));
}

std::shared_ptr<const WorldSurface> layered_surface(std::shared_ptr<const WorldSurface> surface,
                                                    LayerStack layers) {
  layers.bare_ = surface.get();
  return std::make_shared<LayeredSurface>(std::move(surface), std::move(layers));
}

std::shared_ptr<const WorldSurface> layered_surface(std::shared_ptr<const WorldSurface> surface,
                                                    const core::Context& context) {
  const core::ThreadLimit limit(context.num_threads);
  surface->complete();
  const WorldOptions& options = surface->options();
  const bool has_layers = !options.layers.empty() || options.states_aridity();
  LayerStack layers = has_layers ? LayerStack(*surface, context) : LayerStack(options.size_m, {});
  context.log.info("{}: {}", options.name, climate_in_words(options, layers.has_cover_raster()));
  if (!has_layers) return surface;
  return layered_surface(std::move(surface), std::move(layers));
}

}  // namespace terracast::tiler
