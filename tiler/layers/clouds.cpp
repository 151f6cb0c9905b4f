#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/error.h"
#include "core/hash.h"
#include "core/random.h"
#include "geo/units.h"
#include "tiler/clouds/cumulus.h"
#include "tiler/geodesy_cells.h"
#include "tiler/layer.h"
#include "tiler/surface.h"
#include "world/vdb/vdb_file.h"

// Clouds, fog and smoke: volumes that are seen and cast shadows, and that rays of ground truth pass.
namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

constexpr int kVersion = 4;
constexpr int kNumCumuli = 6;
/// A cumulus in each such cell, where there is one.
constexpr double kCellOfCumulus_m = 2100.0;
constexpr double kUnknown = -1e9;

struct CloudOptions {
  std::string source = "cumulus";
  core::Path file;
  world::VdbOptions vdb;
  double cover = 0.3;
  double base_m = kUnknown;
  double lat_deg = kUnknown;
  double lon_deg = kUnknown;
  double height_m = kUnknown;
  double heading_deg = 0.0;
  double scale = 1.0;
  double extinction_per_m = 0.05;
  double albedo = 0.995;
  double anisotropy = 0.8;
};

class Clouds final : public Layer {
 public:
  Clouds(const CloudOptions& options, const LayerInputs& inputs) : options_(options) {
    std::string content = fmt::format(
        "clouds {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {} {}", kVersion, options.source,
        options.cover, options.base_m, options.lat_deg, options.lon_deg, options.height_m,
        options.heading_deg, options.scale, options.extinction_per_m, options.albedo,
        options.anisotropy, options.vdb.grid, options.vdb.unit_m, options.vdb.voxel_m,
        options.vdb.full, options.vdb.is_upward_y, inputs.seed, inputs.surface.input_hash());
    if (options.source == "cumulus") {
      add_cumuli(inputs);
    } else if (options.source == "fog") {
      volumes_.push_back(make_fog(inputs.seed));
      add_one(inputs);
    } else {
      volumes_.push_back(core::with_context(
          [&] {
            return world::read_vdb(options.file.resolved.empty()
                                       ? std::filesystem::path(options.file.written)
                                       : options.file.resolved,
                                   options.vdb);
          },
          fmt::format("reading a volume from {}", options.file.written)));
      content += core::content_hash_of_file(options.file.resolved.empty()
                                                ? std::filesystem::path(options.file.written)
                                                : options.file.resolved);
      add_one(inputs);
    }
    hash_ = core::content_hash(content);
  }

  world::LayerInfo info() const override {
    world::LayerInfo info;
    info.source = options_.source == "vdb"
                      ? std::filesystem::path(options_.file.written).filename().string()
                      : "procedural";
    info.content_hash = hash_;
    info.counts = {{"volumes", static_cast<std::int64_t>(volumes_.size())},
                   {"places", static_cast<std::int64_t>(places_.size())}};
    return info;
  }
  std::string input_hash() const override { return hash_; }
  std::span<const world::Volume> volumes() const override { return volumes_; }
  std::span<const world::VolumePlace> volume_places() const override { return places_; }

 private:
  world::VolumePlace place_of(int volume, const Eigen::Vector3d& place_world) const {
    return {.volume = volume,
            .layer = 0,
            .place_world = place_world,
            .heading_rad = geo::radians_from_degrees(options_.heading_deg),
            .scale = options_.scale,
            .extinction_per_m = options_.extinction_per_m,
            .albedo = options_.albedo,
            .anisotropy = options_.anisotropy};
  }

  /// -1 … 1, about 0 in the mean, over cells of 8 km, linear between their corners.
  static double flock_at(std::uint64_t seed, int cx, int cy) {
    constexpr int kCells = 4;
    const auto corner = [&](int x, int y) {
      return core::random_between(-1.0, 1.0, core::stream_of(seed, 0x666c6f636b), 0,
                                  static_cast<std::uint64_t>(x + (1 << 20)) << 32 |
                                      static_cast<std::uint64_t>(y + (1 << 20)));
    };
    const auto floor_of = [](int cell, int cells) {
      return (cell - (cell < 0 ? cells - 1 : 0)) / cells;
    };
    const int x = floor_of(cx, kCells);
    const int y = floor_of(cy, kCells);
    const double tx = static_cast<double>(cx - x * kCells) / kCells;
    const double ty = static_cast<double>(cy - y * kCells) / kCells;
    const double south = corner(x, y) + tx * (corner(x + 1, y) - corner(x, y));
    const double north = corner(x, y + 1) + tx * (corner(x + 1, y + 1) - corner(x, y + 1));
    return south + ty * (north - south);
  }

  void add_cumuli(const LayerInputs& inputs) {
    for (int i = 0; i < kNumCumuli; ++i) volumes_.push_back(make_cumulus(inputs.seed, i));
    // As high above the land as air cools by 10 degrees, and not in its mountains.
    const double base_m =
        options_.base_m != kUnknown
            ? options_.base_m
            : std::max(inputs.surface.lowest_m() + 1100.0, inputs.surface.highest_m() + 250.0);
    const double half_m = 0.5 * inputs.size_m;
    const int reach = static_cast<int>(std::ceil(half_m / kCellOfCumulus_m));
    for (int cx = -reach; cx < reach; ++cx)
      for (int cy = -reach; cy < reach; ++cy) {
        const std::uint64_t index = static_cast<std::uint64_t>(cx + (1 << 20)) << 32 |
                                    static_cast<std::uint64_t>(cy + (1 << 20));
        const auto drawn = [&](std::uint64_t question, double lowest, double highest) {
          return core::random_between(lowest, highest, core::stream_of(inputs.seed, 0x736b79),
                                      question, index);
        };
        // Many small ones, few large ones; the larger, the higher they tower (make_cumulus).
        const double size = drawn(0, 0.0, 1.0);
        const double scale = options_.scale * (0.38 + 1.15 * std::pow(size, 1.8));
        const double flatness = std::clamp(1.0 - size + drawn(5, -0.3, 0.3), 0.0, 1.0);
        // A cumulus of scale 1 hides 0.18 of its cell if it towers, 0.08 if it is torn; all in all:
        constexpr double kMeanHidden = 0.11;
        // They stand in flocks with clear sky between, twice as many here, none there.
        const double flock = 1.0 + flock_at(inputs.seed, cx, cy);
        if (drawn(1, 0.0, 1.0) * kMeanHidden > flock * options_.cover) continue;
        const Eigen::Vector2d at = kCellOfCumulus_m * Eigen::Vector2d(cx + drawn(2, 0.15, 0.85),
                                                                      cy + drawn(3, 0.15, 0.85));
        if (at.cwiseAbs().maxCoeff() > half_m) continue;
        const double z =
            place_at_height(inputs.frame, at.x(), at.y(), base_m + drawn(4, -40.0, 40.0), 1.0)
                .z_world;
        world::VolumePlace place =
            place_of(static_cast<int>(flatness * (kNumCumuli - 0.001)), {at.x(), at.y(), z});
        place.heading_rad = drawn(6, 0.0, 2.0 * std::numbers::pi);
        place.scale = scale;
        places_.push_back(place);
      }
  }

  void add_one(const LayerInputs& inputs) {
    const geo::Geodetic& origin = inputs.frame.origin();
    const double lat_deg = options_.lat_deg == kUnknown ? origin.lat_deg : options_.lat_deg;
    const double lon_deg = options_.lon_deg == kUnknown ? origin.lon_deg : options_.lon_deg;
    double height_m = options_.height_m;
    if (height_m == kUnknown) {
      const auto ground_m = inputs.surface.measured_height_m(lat_deg, lon_deg);
      if (!ground_m)
        fail(ErrorKind::Config,
             "latitude {}, longitude {} lies outside the world's square, whose ground would give "
             "the height; state height_m",
             lat_deg, lon_deg);
      height_m = *ground_m;
    }
    places_.push_back(
        place_of(0, inputs.frame.world_from_geodetic(
                        {.lat_deg = lat_deg, .lon_deg = lon_deg, .height_m = height_m})));
  }

  CloudOptions options_;
  std::vector<world::Volume> volumes_;
  std::vector<world::VolumePlace> places_;
  std::string hash_;
};

class CloudsKind final : public LayerKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key(
        "source", o_.source,
        "cumulus: fair-weather clouds over the whole square, by the seed. fog: a bank 3 km wide, "
        "by the seed. vdb: a volume from an OpenVDB file.",
        core::one_of({"cumulus", "fog", "vdb"}));
    visit.key("file", o_.file, "vdb: the file.");
    visit.key("grid", o_.vdb.grid, "vdb: name of its grid; left out: density, or its only one.");
    visit.key("unit_m", o_.vdb.unit_m, "vdb: length of the file's unit.", core::between(1e-6, 1e6));
    visit.key("voxel_m", o_.vdb.voxel_m,
              "vdb: sides of the voxels that are kept; 0: as the file has them.",
              core::between(0.0, 1e5));
    visit.key("full", o_.vdb.full, "vdb: value of the grid that is a density of 1; 0: its largest.",
              core::between(0.0, 1e9));
    visit.key("y_up", o_.vdb.is_upward_y, "vdb: the file's y axis is up, not z.");
    visit.key("cover", o_.cover, "cumulus: share of the land below clouds, about.",
              core::between(0.0, 1.0));
    visit.key("base_m", o_.base_m,
              "cumulus: height of their base above the ellipsoid; left out: above all land.",
              core::between(kUnknown, 2e4));
    visit.key("lat_deg", o_.lat_deg, "fog, vdb: latitude of its origin; left out: the world's.",
              core::between(kUnknown, 90.0));
    visit.key("lon_deg", o_.lon_deg, "fog, vdb: longitude of its origin; left out: the world's.",
              core::between(kUnknown, 360.0));
    visit.key("height_m", o_.height_m,
              "fog, vdb: height of its origin above the ellipsoid; left out: on the ground.",
              core::between(kUnknown, 1e5));
    visit.key("heading_deg", o_.heading_deg, "fog, vdb: by which it is turned anticlockwise.",
              core::between(-360.0, 360.0));
    visit.key("scale", o_.scale, "On its size.", core::between(0.01, 100.0));
    visit.key("extinction_per_m", o_.extinction_per_m,
              "Where the density is 1: cumulus 0.03 to 0.1, fog 0.005 to 0.05.",
              core::between(0.0, 100.0));
    visit.key("albedo", o_.albedo, "Share of light that is scattered on: clouds 1, smoke less.",
              core::between(0.0, 1.0));
    visit.key("anisotropy", o_.anisotropy, "Mean cosine of scattering: clouds 0.8, smoke 0.5.",
              core::between(-0.95, 0.95));
  }

  void validate() const override {
    if (o_.source == "vdb" && o_.file.written.empty())
      fail(ErrorKind::Config, "source = \"vdb\" needs file = \"…\"");
    if (o_.source != "vdb" && !o_.file.written.empty())
      fail(ErrorKind::Config, "source = \"{}\" reads no file, and {} is given", o_.source,
           o_.file.written);
  }
  std::unique_ptr<LayerKind> clone() const override { return std::make_unique<CloudsKind>(*this); }
  std::unique_ptr<Layer> make(const LayerInputs& inputs) const override {
    return std::make_unique<Clouds>(o_, inputs);
  }

 private:
  CloudOptions o_;
};

}  // namespace

LayerKindInfo clouds_layer() {
  return {"clouds", "Clouds, fog and smoke: volumes from a seed or from OpenVDB files.",
          [] { return std::unique_ptr<LayerKind>(std::make_unique<CloudsKind>()); }};
}

}  // namespace terracast::tiler
