#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "core/error.h"
#include "core/hash.h"
#include "tiler/dry_cover.h"
#include "tiler/known_rasters.h"
#include "tiler/land_cover/cover_raster.h"
#include "tiler/land_cover/derived_cover.h"
#include "tiler/land_cover/legend.h"
#include "tiler/layer.h"
#include "tiler/no_data.h"
#include "tiler/surface.h"
#include "tiler/world_options.h"

// What covers the ground: from rasters of class codes, or derived from the land's own form.
namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

class RasterLayer final : public Layer, public KnownCovers {
 public:
  RasterLayer(const std::vector<core::Path>& files, const Legend& legend,
              const CoverRasterOptions& options, const LayerInputs& inputs)
      : frame_(inputs.frame), legend_name_(legend.name) {
    for (const core::Path& file : files) {
      core::with_context(
          [&] { rasters_.push_back(std::make_unique<CoverRaster>(file, legend, options, inputs)); },
          fmt::format("reading land cover from {}", file.written));
      names_.push_back(std::filesystem::path(file.written).filename().string());
    }
    const auto touches = [](const auto& raster) { return raster->touches_square(); };
    if (std::none_of(rasters_.begin(), rasters_.end(), touches)) fail_outside(inputs);
    for (const auto& raster : rasters_) {
      has_lakes_ = has_lakes_ || raster->counts().num_lakes > 0;
      if (!raster->touches_square())
        inputs.context.log.warn("{}: lies outside the world's square", raster->grid().written());
    }
  }

  world::LayerInfo info() const override {
    CoverRasterCounts all;
    std::int64_t num_outside = 0;
    for (const auto& raster : rasters_) {
      const CoverRasterCounts& counts = raster->counts();
      all.num_samples += counts.num_samples;
      all.num_nodata += counts.num_nodata;
      all.num_unknown += counts.num_unknown;
      all.num_lakes += counts.num_lakes;
      all.num_lake_samples += counts.num_lake_samples;
      all.num_water_samples_left += counts.num_water_samples_left;
      num_outside += raster->touches_square() ? 0 : 1;
    }
    world::LayerInfo info;
    for (const auto& raster : rasters_) info.ledger.merge(raster->ledger());
    info.source = fmt::format("{}", fmt::join(names_, ", "));
    info.content_hash = input_hash();
    info.counts = {{"samples", all.num_samples},
                   {"samples without data", all.num_nodata},
                   {"samples of unknown class", all.num_unknown},
                   {"lakes", all.num_lakes},
                   {"samples of lakes", all.num_lake_samples},
                   {"samples of water left to other layers", all.num_water_samples_left},
                   {"files outside the square", num_outside}};
    return info;
  }

  std::string input_hash() const override {
    std::string all = "land cover " + legend_name_;
    for (const auto& raster : rasters_) all += " " + raster->content_hash();
    return core::content_hash(all);
  }

  std::vector<world::CoverRasterInfo> cover_rasters() const override {
    std::vector<world::CoverRasterInfo> infos;
    for (std::size_t i = 0; i < rasters_.size(); ++i) infos.push_back(rasters_[i]->info(names_[i]));
    return infos;
  }

  void tell_row(std::size_t raster, int row, std::span<std::uint8_t> covers) const override {
    rasters_[raster]->tell_row(row, covers);
  }

  std::optional<world::Cover> cover(const Eigen::Vector2d& place_world,
                                    const SurfaceSample& ground) const override {
    const auto found = find(place_world, ground);
    return found ? std::optional(found->cover) : std::nullopt;
  }

  /// Lakes are level.
  double lift_m(const Eigen::Vector2d& place_world, const SurfaceSample& ground) const override {
    if (!has_lakes_) return 0.0;
    const auto found = find(place_world, ground);
    if (!found || !found->level_m) return 0.0;
    return *found->level_m -
           frame_.geodetic_from_world({place_world.x(), place_world.y(), ground.z_world}).height_m;
  }

 private:
  std::optional<CoverRaster::Found> find(const Eigen::Vector2d& place_world,
                                         const SurfaceSample& ground) const {
    for (const auto& raster : rasters_)
      if (const auto found = raster->find(place_world, ground.z_world)) return found;
    return std::nullopt;
  }

  [[noreturn]] void fail_outside(const LayerInputs& inputs) const {
    const RasterGrid& grid = rasters_.front()->grid();
    const Eigen::Vector2d middle(0.5 * grid.width(), 0.5 * grid.height());
    geo::Geodetic place;
    grid.geodetic_from_samples({&middle, 1}, {&place, 1});
    const geo::Geodetic& origin = inputs.frame.origin();
    fail(ErrorKind::Input,
         "{}{}: nothing of it lies in the world's square of {} m about latitude {}, longitude {}: "
         "its middle is at latitude {:.4f}, longitude {:.4f}; is its CRS ({}) the right one?",
         grid.written(), rasters_.size() > 1 ? " and the other rasters" : "", inputs.size_m,
         origin.lat_deg, origin.lon_deg, place.lat_deg, place.lon_deg, grid.crs_name());
  }

  const geo::WorldFrame& frame_;
  std::string legend_name_;
  bool has_lakes_ = false;
  std::vector<std::unique_ptr<CoverRaster>> rasters_;  ///< the first has priority
  std::vector<std::string> names_;
};

class DerivedLayer final : public Layer, public DryCover {
 public:
  DerivedLayer(const DerivedCoverOptions& options, const LayerInputs& inputs)
      : cover_(options, inputs) {}

  world::LayerInfo info() const override {
    world::LayerInfo info;
    info.source = "derived";
    info.content_hash = input_hash();
    return info;
  }
  std::string input_hash() const override { return cover_.content_hash(); }
  std::optional<world::Cover> cover(const Eigen::Vector2d& place_world,
                                    const SurfaceSample& ground) const override {
    return cover_.cover(place_world, ground);
  }

 private:
  DerivedCover cover_;
};

class LandCover final : public LayerKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("source", source_,
              "raster: from rasters of class codes. derived: from height, slope, moisture, water, "
              "latitude and the seed.",
              core::one_of({"raster", "derived"}));
    visit.key(
        "files", files_,
        "raster: files in order of priority, of any format of docs/tiler.md; where one has no "
        "data the next is asked, and then the next layer.");
    visit.key("legend", legend_,
              "raster: what codes stand for: worldcover (ESA), corine (codes 111 to 523, or 1 to "
              "44), nlcd, nlcd_8 (its broad classes), none.",
              core::one_of(legend_names()));
    visit.key("classes", classes_,
              "raster: codes that the legend lacks, or that mean something else, as [\"10 = "
              "forest\", \"20 = unknown\"]: unknown, forest, shrubs, grass, crops, built_up, bare, "
              "snow, wetland, lake, other_water.");
    visit.key("nodata", raster_.nodata,
              "raster: codes of samples without data: declared (by the file), none, or numbers in "
              "quotes.");
    visit.key("border_px", raster_.border_px,
              "raster: how far the borders between classes stray from the pixels' sides, in sides "
              "of a pixel; 0: not at all.",
              core::between(0.0, 2.0));
    visit.key("lake_flat_m", raster_.lake_flat_m,
              "raster: water is a lake where the heights of its ground lie within this of each "
              "other; other water is left to other layers.",
              core::between(0.0, 100.0));
    visit.key("forest_share", derived_.forest_share,
              "derived: share of forest where it can grow; more on slopes, less on plains.",
              core::between(0.0, 1.0));
    visit.key("field_share", derived_.field_share,
              "derived: share of fields on level land that is warm enough.",
              core::between(0.0, 1.0));
    visit.key("snow_line_m", derived_.snow_line_m,
              "derived: height above which snow lies in summer; below 0: as the latitude has it.",
              core::between(-1.0, 9000.0));
    visit.key("tree_line_m", derived_.tree_line_m,
              "derived: height up to which forests grow; below 0: as the latitude has it.",
              core::between(-1.0, 9000.0));
  }

  void validate() const override {
    if (source_ == "derived") {
      if (!files_.empty())
        fail(ErrorKind::Config,
             "source = \"derived\" reads no files, and {} are given; rasters need source = "
             "\"raster\"",
             files_.size());
      return;
    }
    if (files_.empty())
      fail(ErrorKind::Config,
           "source = \"raster\" needs files = [\"…\"], the rasters in order of priority");
    if (!NoData::from_text(raster_.nodata))
      fail(ErrorKind::Config, "nodata = \"{}\" is none of {}", raster_.nodata, kNoDataWords);
    make_legend(legend_, classes_);
  }

  std::unique_ptr<LayerKind> clone() const override { return std::make_unique<LandCover>(*this); }

  std::unique_ptr<Layer> make(const LayerInputs& inputs) const override {
    if (source_ == "derived") return std::make_unique<DerivedLayer>(derived_, inputs);
    return std::make_unique<RasterLayer>(files_, make_legend(legend_, classes_), raster_, inputs);
  }

 private:
  std::string source_ = "raster";
  std::vector<core::Path> files_;
  std::string legend_ = "none";
  std::vector<std::string> classes_;
  CoverRasterOptions raster_;
  DerivedCoverOptions derived_;
};

}  // namespace

LayerKindInfo land_cover_layer() {
  return {"land_cover", "What covers the ground: class rasters with a legend, or derived.",
          [] { return std::unique_ptr<LayerKind>(std::make_unique<LandCover>()); }};
}

}  // namespace terracast::tiler
