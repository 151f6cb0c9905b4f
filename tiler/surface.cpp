#include "tiler/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "core/environment.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/parallel.h"
#include "core/registry.h"
#include "tiler/apron.h"
#include "tiler/detail.h"
#include "tiler/elevation_registry.h"
#include "tiler/geodesy_cells.h"
#include "tiler/height_field.h"
#include "tiler/kept_ground.h"
#include "tiler/known_rasters.h"
#include "tiler/layer_stack.h"
#include "tiler/relief.h"

namespace terracast::tiler {
namespace {

using world::Cover;
using world::kTileSamples;

/// Raised when the same inputs give another surface.
constexpr int kSurfaceVersion = 6;

/// The finest level that tiles may have (DetailOptions::finest_spacing_m goes down to 2^-3 m).
constexpr int kFinestLevel = -3;

/// The square is covered by at most this many tiles of the base level.
constexpr double kMostBaseTiles = 1024.0;

/// So that the apron's tiles, a level coarser, are small enough for the Earth's curve
/// (kLowestCoarsestLevel of the tile stage).
constexpr int kCoarsestBaseLevel = 7;

/// Detail fades out where land comes down to the sea, over this height.
constexpr double kShoreHeight_m = 3.0;

/// Detail fades out beyond the square, over this distance.
constexpr double kDetailFade_m = 1000.0;

class TerrainSurface : public WorldSurface, public KnownRasters {
 public:
  TerrainSurface(const WorldOptions& options, const core::Context& context,
                 const std::filesystem::path& store);

  const geo::WorldFrame& frame() const override { return frame_; }
  const WorldOptions& options() const override { return options_; }
  const std::vector<world::SourceInfo>& sources() const override { return sources_; }
  std::vector<std::optional<world::RasterInfo>> rasters() const override {
    return rasters_of(*field_);
  }
  int measured_level() const override { return measured_level_; }
  int base_level() const override { return base_level_; }
  std::string input_hash() const override { return input_hash_; }
  double lowest_m() const override { return lowest_m_; }
  double highest_m() const override { return highest_m_; }

  void complete() const override {
    std::call_once(completed_, [this] { analyse(); });
  }
  void keep_ground(const std::filesystem::path& store) const override;

  SurfaceSample sample(double x_world, double y_world) const override {
    complete();
    if (!is_inside(x_world, y_world)) return beyond(x_world, y_world, Detail::kFinestOctave);
    return inside(cells_->column(x_world, y_world), x_world, y_world, Detail::kFinestOctave);
  }

  void sample_tile(const world::TileId& id, std::span<SurfaceSample> samples) const override;

  std::optional<double> measured_height_m(double lat_deg, double lon_deg) const override;

  const LayerStack& layers() const override { return no_layers_; }

 private:
  struct Ground {
    double height_m = 0.0;  ///< above the ellipsoid
    ColumnPoint point;
    bool is_sea = false;
    double sea_depth_m = 0.0;
    std::uint8_t source = 0;
  };

  bool is_inside(double x_world, double y_world) const {
    return std::abs(x_world) <= half_size_m_ && std::abs(y_world) <= half_size_m_;
  }

  /// The surface at a map place, of the field's datum, with `detail_m` on it.
  double height_with_detail_m(const Eigen::Vector2d& map, double detail_m, Ground& ground) const;

  /// Solves h = surface(place of (x, y) at h) + undulation.
  Ground solve(const GeodesyColumn& column, double detail_m) const;

  /// Synthetic detail at a place of the square: less where a finer source knows the ground.
  double detail_m(const GeodesyColumn& column, const Eigen::Vector2d& place_world,
                  double ruggedness, int finest_octave) const;
  SurfaceSample inside(const GeodesyColumn& column, double x_world, double y_world,
                       int finest_octave) const;
  SurfaceSample beyond(double x_world, double y_world, int finest_octave) const;
  /// The square's surface above the geoid (the ellipsoid where no geoid is used).
  BorderSample border_sample(const Eigen::Vector2d& at, double detail_m) const;
  /// Of heights along paths: a few columns need not all nodes.
  GeodesyColumn column_on_demand(const Eigen::Vector2d& place_world) const {
    const GeodesyCells& cells = few_cells_ == nullptr ? *cells_ : *few_cells_;
    return cells.column(place_world.x(), place_world.y());
  }
  Eigen::Vector2d nearest_inside(double x_world, double y_world) const {
    return {std::clamp(x_world, -half_size_m_, half_size_m_),
            std::clamp(y_world, -half_size_m_, half_size_m_)};
  }

  Eigen::Vector2d relief_place(double x_world, double y_world) const {
    return {(x_world + half_size_m_) / relief_.spacing_m,
            (y_world + half_size_m_) / relief_.spacing_m};
  }

  void refuse_uncovered(const geo::VerticalDatum& datum) const;
  void hash_inputs();
  void choose_levels();
  void describe_sources();

  /// Makes the cells and what follows from them.
  void analyse() const;
  void analyse_heights() const;
  void make_apron() const;

  WorldOptions options_;
  geo::WorldFrame frame_;
  double half_size_m_;
  std::shared_ptr<const geo::Geoid> geoid_;
  const geo::Geoid* datum_geoid_ = nullptr;  ///< of the field's datum; null on the ellipsoid
  std::unique_ptr<HeightField> field_;
  std::unique_ptr<GeodesyCells> few_cells_;  ///< on demand; null: cells_ are there from the start
  std::unique_ptr<Detail> detail_;
  std::vector<world::SourceInfo> sources_;
  std::uint8_t apron_source_ = 0;
  std::uint8_t sea_source_ = 0;
  int measured_level_ = 0;
  int base_level_ = 0;
  // Of the field, with what undulations and detail may add.
  double field_lowest_m_ = 0.0;
  double field_highest_m_ = 0.0;
  std::string input_hash_;
  LayerStack no_layers_;
  // Of complete().
  mutable std::once_flag completed_;
  mutable std::unique_ptr<GeodesyCells> cells_;
  mutable std::unique_ptr<Apron> apron_;
  mutable Relief relief_;
  // Of the surface; known before where the world's folder keeps them.
  mutable double lowest_m_ = 0.0;
  mutable double highest_m_ = 0.0;
};

/// What heights are above where the sea's surface is 0: the field's datum, or EGM96 where only the
/// sea needs a geoid.
std::shared_ptr<const geo::Geoid> geoid_of(const WorldOptions& options,
                                           const geo::VerticalDatum& datum) {
  if (!datum.is_ellipsoid()) return datum.geoid;
  const bool needs_one =
      options.outside == "sea" ||
      std::any_of(options.elevation.begin(), options.elevation.end(), [](const auto& entry) {
        return entry.sea == "nodata" ||
               (!entry.vertical_datum.empty() && entry.vertical_datum != "ellipsoid");
      });
  return needs_one ? geo::Geoid::egm96() : nullptr;
}

/// The datum of the ground: that of the first source that is no inset.
geo::VerticalDatum datum_of_ground(const WorldOptions& options) {
  const auto is_ground = [](const ElevationOptions& entry) { return entry.blend_m == 0.0; };
  return datum_of(*std::find_if(options.elevation.begin(), options.elevation.end(), is_ground));
}

TerrainSurface::TerrainSurface(const WorldOptions& options, const core::Context& context,
                               const std::filesystem::path& store)
    : options_(options),
      frame_({.lat_deg = options.origin_lat_deg, .lon_deg = options.origin_lon_deg}),
      half_size_m_(options.size_m / 2.0) {
  options_.validate();
  const geo::VerticalDatum datum = datum_of_ground(options_);
  geoid_ = geoid_of(options_, datum);
  std::optional<KeptGround> kept = read_kept_ground(store, context.log);
  const ElevationOptions& entry = options_.elevation.front();
  field_ = core::find_registered(elevation_kinds(), "kind of elevation", entry.kind)
               .make({options_, entry, frame_, datum, geoid_, context,
                      kept ? std::span<const KeptLand>(kept->lands) : std::span<const KeptLand>()});
  datum_geoid_ = datum.geoid.get();
  refuse_uncovered(datum);

  // Undulations lie within 110 m, detail within 150 m.
  const double pad_m = datum_geoid_ != nullptr ? 260.0 : 150.0;
  field_lowest_m_ = field_->lowest_m() - pad_m;
  field_highest_m_ = field_->highest_m() + pad_m;
  hash_inputs();
  choose_levels();
  const double roughness = field_->takes_detail() ? options_.detail_roughness : 0.0;
  detail_ = std::make_unique<Detail>(static_cast<std::uint64_t>(options_.seed), measured_level_,
                                     roughness);
  describe_sources();
  double node_spacing_m = 0.0;
  double probe_error_m = 0.0;
  if (kept && kept->input_hash == input_hash_) {
    lowest_m_ = kept->lowest_m;
    highest_m_ = kept->highest_m;
    node_spacing_m = kept->node_spacing_m;
    probe_error_m = kept->largest_probe_error_m;
    few_cells_ = GeodesyCells::on_demand(frame_, *field_, datum_geoid_, half_size_m_,
                                         field_lowest_m_, field_highest_m_, node_spacing_m);
  } else {
    complete();
    node_spacing_m = cells_->node_spacing_m();
    probe_error_m = cells_->largest_probe_error_m();
  }
  context.log.debug("geodesy: nodes every {} m, probes within {:.1e} m", node_spacing_m,
                    probe_error_m);
  if (probe_error_m > GeodesyCells::kTolerance_m)
    context.log.warn("{}: the heights' projection bends so much that places are good to {:.1e} m",
                     options_.name, probe_error_m);
  context.log.info(
      "{}: heights from {:.0f} to {:.0f} m above the ellipsoid, measured every {:.3g} m",
      options_.name, lowest_m_, highest_m_, field_->spacing_m());
}

void TerrainSurface::hash_inputs() {
  // The field's own hash has a grid's name.
  std::string grids;
  for (const ElevationOptions& source : options_.elevation)
    if (source.vertical_datum == "grid")
      grids += " grid " + core::content_hash_of_file(source.datum_grid.resolved);
  input_hash_ = core::content_hash(fmt::format(
      "surface {} {} {} {} {} {} {} {} {} {}{}", kSurfaceVersion, options_.name,
      options_.origin_lat_deg, options_.origin_lon_deg, options_.size_m, options_.seed,
      options_.outside, options_.detail_roughness, field_->input_hash(),
      geoid_ == nullptr ? 0.0
                        : geoid_->undulation_m(options_.origin_lat_deg, options_.origin_lon_deg),
      grids));
}

void TerrainSurface::keep_ground(const std::filesystem::path& store) const {
  const core::Log silent("ground", core::LogLevel::Off);
  const std::optional<KeptGround> kept = read_kept_ground(store, silent);
  if (kept && kept->input_hash == input_hash_) return;
  complete();
  write_kept_ground(store, {.input_hash = input_hash_,
                            .lowest_m = lowest_m_,
                            .highest_m = highest_m_,
                            .node_spacing_m = cells_->node_spacing_m(),
                            .largest_probe_error_m = cells_->largest_probe_error_m(),
                            .lands = field_->lands()});
}

/// A grid of offsets must reach over the square; the apron's are carried on from its border.
void TerrainSurface::refuse_uncovered(const geo::VerticalDatum& datum) const {
  if (datum.is_ellipsoid()) return;
  constexpr int kProbes = 32;
  for (int j = 0; j <= kProbes; ++j)
    for (int i = 0; i <= kProbes; ++i) {
      const geo::Geodetic place =
          frame_.geodetic_from_world({(2.0 * i / kProbes - 1.0) * half_size_m_,
                                      (2.0 * j / kProbes - 1.0) * half_size_m_, 0.0});
      if (!datum.geoid->covers(place.lat_deg, place.lon_deg))
        core::fail(core::ErrorKind::Input,
                   "{}: knows no offset at latitude {:.4f}, longitude {:.4f}, in the world's "
                   "square; give a grid that covers it",
                   datum.name, place.lat_deg, place.lon_deg);
    }
}

void TerrainSurface::choose_levels() {
  // A raster of 30 m in a projection whose scale is 0.9996 still has the level of 32 / 2.
  const auto level_of = [](double spacing_m) {
    return std::max(static_cast<int>(std::floor(std::log2(spacing_m) + 1e-3)), kFinestLevel);
  };
  measured_level_ = level_of(field_->widest_spacing_m());
  const double finest_base_m = options_.size_m / (world::kTileCells * std::sqrt(kMostBaseTiles));
  base_level_ = std::min(std::max(level_of(field_->spacing_m()),
                                  static_cast<int>(std::ceil(std::log2(finest_base_m)))),
                         kCoarsestBaseLevel);
  // A surface that is known at every place holds nothing synthetic at any level.
  if (!field_->takes_detail()) measured_level_ = kFinestLevel;
}

void TerrainSurface::analyse() const {
  cells_ = std::make_unique<GeodesyCells>(frame_, *field_, datum_geoid_, half_size_m_,
                                          field_lowest_m_, field_highest_m_);
  analyse_heights();
  make_apron();
}

void TerrainSurface::analyse_heights() const {
  const int level = std::max(static_cast<int>(std::floor(std::log2(field_->spacing_m()) + 1e-3)),
                             static_cast<int>(std::ceil(std::log2(options_.size_m / 1024.0))));
  const double spacing_m = std::exp2(level);
  const int side = static_cast<int>(std::ceil(options_.size_m / spacing_m)) + 1;
  Grid<float> heights_m(side, side);
  std::vector<std::uint8_t> is_sea(heights_m.values.size(), 0);
  core::parallel_for(side, [&](std::int64_t row) {
    const int j = static_cast<int>(row);
    GeodesyCells::Row columns(*cells_, std::min(j * spacing_m - half_size_m_, half_size_m_));
    for (int i = 0; i < side; ++i) {
      const Ground ground =
          solve(columns.column(std::min(i * spacing_m - half_size_m_, half_size_m_)), 0.0);
      const std::size_t cell = heights_m.index(i, j);
      heights_m.values[cell] = static_cast<float>(ground.height_m - ground.point.undulation_m);
      is_sea[cell] = ground.is_sea ? 1 : 0;
    }
  });
  relief_ = analyse_relief(heights_m, is_sea, spacing_m);
  const auto [lowest, highest] =
      std::minmax_element(heights_m.values.begin(), heights_m.values.end());
  const double undulation_m =
      datum_geoid_ == nullptr
          ? 0.0
          : datum_geoid_->undulation_m(options_.origin_lat_deg, options_.origin_lon_deg);
  if (few_cells_ != nullptr) return;  // they were kept, and others may be reading them
  lowest_m_ = static_cast<double>(*lowest) + undulation_m;
  highest_m_ = static_cast<double>(*highest) + undulation_m;
}

BorderSample TerrainSurface::border_sample(const Eigen::Vector2d& at, double detail_m) const {
  const Ground ground = solve(cells_->column(at.x(), at.y()), detail_m);
  double undulation_m = ground.point.undulation_m;
  if (geoid_ != nullptr && datum_geoid_ == nullptr) {
    const geo::Geodetic place = frame_.geodetic_from_world({at.x(), at.y(), ground.point.z_world});
    undulation_m = geoid_->undulation_m(place.lat_deg, place.lon_deg);
  }
  return {ground.height_m - undulation_m, ground.is_sea, ground.is_sea ? ground.sea_depth_m : 0.0};
}

void TerrainSurface::make_apron() const {
  apron_ = std::make_unique<Apron>(half_size_m_, options_.outside == "sea",
                                   static_cast<std::uint64_t>(options_.seed),
                                   [&](double x_world, double y_world) {
                                     return border_sample({x_world, y_world}, 0.0);
                                   });
}

void TerrainSurface::describe_sources() {
  sources_ = field_->sources();
  const auto row_of_kind = [&](const std::string& kind, const std::string& name) {
    for (std::size_t i = 0; i < sources_.size(); ++i)
      if (sources_[i].kind == kind) return static_cast<std::uint8_t>(i);
    world::SourceInfo source;
    source.name = name;
    source.kind = kind;
    source.vertical_datum = geoid_ == nullptr         ? "ellipsoid"
                            : datum_geoid_ == nullptr ? "egm96"
                                                      : field_->datum().name;
    sources_.push_back(std::move(source));
    return static_cast<std::uint8_t>(sources_.size() - 1);
  };
  TERRACAST_CHECK(sources_.size() < 250, "{} sources", sources_.size());
  apron_source_ = row_of_kind("extend", "extended");
  if (field_->has_sea() || options_.outside == "sea") sea_source_ = row_of_kind("sea", "sea");
}

double TerrainSurface::height_with_detail_m(const Eigen::Vector2d& map, double detail_m,
                                            Ground& ground) const {
  const double measured_m = field_->height_m(map);
  const FieldFacts facts = field_->facts(map);
  ground.source = facts.source;
  ground.is_sea = false;
  if (!facts.sea_height_m) return measured_m + detail_m;
  const double above_sea_m = measured_m - *facts.sea_height_m;
  const double height_m =
      measured_m + detail_m * std::clamp(above_sea_m / kShoreHeight_m, 0.0, 1.0);
  if (height_m > *facts.sea_height_m) return height_m;
  ground.is_sea = true;
  if (facts.is_shelf) ground.source = sea_source_;
  ground.sea_depth_m = *facts.sea_height_m - measured_m + facts.floor_depth_m;
  return *facts.sea_height_m;
}

TerrainSurface::Ground TerrainSurface::solve(const GeodesyColumn& column, double detail_m) const {
  // Up leans against world z by less than a degree in most worlds, so that the place moves little
  // with the height: a fixed point, made faster by the secant through the last two values.
  Ground ground;
  double height_m = column.middle_m();
  double previous_m = 0.0;
  double previous_value_m = 0.0;
  for (int i = 0; i < 100; ++i) {
    ground.point = column.at(height_m);
    const double value_m =
        height_with_detail_m(ground.point.map, detail_m, ground) + ground.point.undulation_m;
    ground.height_m = value_m;
    if (std::abs(value_m - height_m) < 1e-7) break;
    double next_m = value_m;
    if (i > 0 && i < 12 && height_m != previous_m) {
      const double slope = (value_m - previous_value_m) / (height_m - previous_m);
      if (std::abs(slope) < 0.5) next_m = height_m + (value_m - height_m) / (1.0 - slope);
    }
    previous_m = height_m;
    previous_value_m = value_m;
    height_m = next_m;
  }
  return ground;
}

double TerrainSurface::detail_m(const GeodesyColumn& column, const Eigen::Vector2d& place_world,
                                double ruggedness, int finest_octave) const {
  if (!field_->has_insets())
    return detail_->height_m(place_world.x(), place_world.y(), ruggedness, finest_octave);
  // Of the column's middle: detail must not depend on the height that it makes.
  const Eigen::Vector2d map = column.at(column.middle_m()).map;
  return detail_->height_m(place_world.x(), place_world.y(), ruggedness, finest_octave,
                           [&](int octave) { return field_->detail_share(map, octave); });
}

SurfaceSample TerrainSurface::inside(const GeodesyColumn& column, double x_world, double y_world,
                                     int finest_octave) const {
  const Eigen::Vector2d place = relief_place(x_world, y_world);
  const double ruggedness = bilinear(relief_.ruggedness, place);
  const double added_m = detail_m(column, {x_world, y_world}, ruggedness, finest_octave);
  const Ground ground = solve(column, added_m);
  SurfaceSample sample;
  sample.z_world = column.at(ground.height_m).z_world;
  sample.source = ground.source;
  if (ground.is_sea) {
    sample.cover = Cover::Sea;
    sample.moisture = 255;
    sample.water_depth_m = ground.sea_depth_m;
    return sample;
  }
  double moisture = bilinear(relief_.moisture, place);
  // Hollows of the detail hold water, humps shed it.
  const double amplitude_m = detail_->amplitude_m(ruggedness);
  if (amplitude_m > 0.0) moisture -= 40.0 * std::clamp(added_m / amplitude_m, -1.0, 1.0);
  sample.moisture = static_cast<std::uint8_t>(std::lround(std::clamp(moisture, 0.0, 255.0)));
  return sample;
}

SurfaceSample TerrainSurface::beyond(double x_world, double y_world, int finest_octave) const {
  const Eigen::Vector2d nearest = nearest_inside(x_world, y_world);
  const double distance_m = (Eigen::Vector2d(x_world, y_world) - nearest).norm();
  const double mirror_share = apron_->mirror_share(distance_m);
  std::optional<BorderSample> mirrored_ground;
  double moisture = 110.0;
  if (mirror_share > 0.0) {
    const Eigen::Vector2d mirrored = apron_->mirrored_inside(x_world, y_world);
    const Eigen::Vector2d place = relief_place(mirrored.x(), mirrored.y());
    const double fade = std::max(1.0 - distance_m / kDetailFade_m, 0.0);
    double added_m = 0.0;
    if (fade > 0.0)
      added_m = fade * detail_m(cells_->column(mirrored.x(), mirrored.y()), {x_world, y_world},
                                bilinear(relief_.ruggedness, place), finest_octave);
    mirrored_ground = border_sample(mirrored, added_m);
    moisture += mirror_share * (bilinear(relief_.moisture, place) - moisture);
  }
  const BorderSample ground = apron_->beyond(x_world, y_world, distance_m, mirrored_ground);
  // Heights count from the geoid where one is used; its undulation is that of the apron's own
  // place.
  PlaceAtHeight found = place_at_height(frame_, x_world, y_world, ground.height_m, 1.0);
  if (geoid_ != nullptr)
    found.z_world +=
        geoid_->undulation_m(found.place.lat_deg, found.place.lon_deg) / found.height_per_z;
  SurfaceSample sample;
  sample.z_world = found.z_world;
  sample.cover = ground.is_sea ? Cover::Sea : Cover::Outside;
  sample.source = ground.is_sea ? sea_source_ : apron_source_;
  sample.water_depth_m = ground.sea_depth_m;
  sample.moisture = ground.is_sea ? 255 : static_cast<std::uint8_t>(std::lround(moisture));
  return sample;
}

void TerrainSurface::sample_tile(const world::TileId& id, std::span<SurfaceSample> samples) const {
  TERRACAST_CHECK(samples.size() == static_cast<std::size_t>(kTileSamples) * kTileSamples, "{}",
                  samples.size());
  complete();
  // Octaves up to the tile's level vanish at all its places.
  const int finest_octave = std::max(id.level + 1, Detail::kFinestOctave);
  const double spacing_m = id.spacing_m();
  const Eigen::Vector2d corner = id.corner_world();
  for (int j = 0; j < kTileSamples; ++j) {
    const double y_world = corner.y() + j * spacing_m;
    GeodesyCells::Row columns(*cells_, std::clamp(y_world, -half_size_m_, half_size_m_));
    for (int i = 0; i < kTileSamples; ++i) {
      const double x_world = corner.x() + i * spacing_m;
      samples[world::Tile::sample(i, j)] =
          is_inside(x_world, y_world)
              ? inside(columns.column(x_world), x_world, y_world, finest_octave)
              : beyond(x_world, y_world, finest_octave);
    }
  }
}

std::optional<double> TerrainSurface::measured_height_m(double lat_deg, double lon_deg) const {
  double height_m = 0.5 * (lowest_m_ + highest_m_);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d at =
        frame_.world_from_geodetic({.lat_deg = lat_deg, .lon_deg = lon_deg, .height_m = height_m});
    // The far side of the Earth projects into the square, too.
    if (at.z() < -0.5 * geo::kWgs84SemiMajorAxis_m) return std::nullopt;
    const ColumnPoint point = column_on_demand(nearest_inside(at.x(), at.y())).at(height_m);
    Ground ground;
    const double next_m = height_with_detail_m(point.map, 0.0, ground) + point.undulation_m;
    if (std::abs(next_m - height_m) < 1e-7) {
      if (!is_inside(at.x(), at.y())) return std::nullopt;
      return next_m;
    }
    height_m = next_m;
  }
  return std::nullopt;
}

}  // namespace

std::shared_ptr<const WorldSurface> WorldSurface::prepare_ground(
    const WorldOptions& options, const core::Context& context, const std::filesystem::path& store) {
  const core::ThreadLimit limit(context.num_threads);
  if (const auto& names = core::unheeded_variables(); !names.empty())
    context.log.warn(
        "variables of the environment that would change what files mean are not heeded: {}",
        fmt::join(names, ", "));
  return std::make_shared<TerrainSurface>(options, context, store);
}

std::shared_ptr<const WorldSurface> WorldSurface::prepare(const WorldOptions& options,
                                                          const core::Context& context) {
  return layered_surface(prepare_ground(options, context), context);
}

}  // namespace terracast::tiler
