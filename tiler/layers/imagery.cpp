#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/error.h"
#include "core/hash.h"
#include "tiler/imagery/imagery_pyramid.h"
#include "tiler/layer.h"
#include "tiler/no_data.h"
#include "tiler/surface.h"
#include "tiler/world_options.h"

// Pictures of the ground from above: orthophotos and satellite images.
namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

class Imagery final : public Layer {
 public:
  Imagery(const std::vector<core::Path>& files, const ColorOptions& options,
          const LayerInputs& inputs) {
    for (const core::Path& file : files)
      core::with_context(
          [&] { rasters_.push_back(std::make_shared<ColorRaster>(file, options, inputs)); },
          fmt::format("reading imagery from {}", file.written));
    std::map<int, std::vector<std::shared_ptr<const ColorRaster>>> by_level;
    for (const auto& raster : rasters_) {
      if (raster->touches_square())
        by_level[raster->level()].push_back(raster);
      else
        inputs.context.log.warn("{}: lies outside the world's square", raster->grid().written());
    }
    if (by_level.empty()) fail_outside(inputs);
    for (auto& [level, rasters] : by_level)
      pyramids_.push_back(std::make_unique<ImageryPyramid>(level, inputs.size_m, inputs.surface,
                                                           std::move(rasters)));
  }

  world::LayerInfo info() const override {
    world::LayerInfo info;
    std::vector<std::string> names;
    std::int64_t num_outside = 0;
    for (const auto& raster : rasters_) {
      names.push_back(raster->name());
      num_outside += raster->touches_square() ? 0 : 1;
      info.ledger.merge(raster->ledger());
    }
    info.source = fmt::format("{}", fmt::join(names, ", "));
    info.content_hash = input_hash();
    info.counts = {{"files", static_cast<std::int64_t>(rasters_.size())},
                   {"files outside the square", num_outside}};
    return info;
  }
  std::string input_hash() const override {
    std::string all = "imagery";
    for (const auto& raster : rasters_) all += " " + raster->content_hash();
    return core::content_hash(all);
  }
  std::span<const std::unique_ptr<ImageryPyramid>> imagery() const override { return pyramids_; }

 private:
  [[noreturn]] void fail_outside(const LayerInputs& inputs) const {
    const RasterGrid& grid = rasters_.front()->grid();
    const Eigen::Vector2d middle(0.5 * grid.width(), 0.5 * grid.height());
    geo::Geodetic place;
    grid.geodetic_from_samples({&middle, 1}, {&place, 1});
    const geo::Geodetic& origin = inputs.frame.origin();
    fail(ErrorKind::Input,
         "{}{}: nothing of it lies in the world's square of {} m about latitude {}, longitude {}: "
         "its middle is at latitude {:.4f}, longitude {:.4f}; is its CRS ({}) the right one?",
         grid.written(), rasters_.size() > 1 ? " and the other files" : "", inputs.size_m,
         origin.lat_deg, origin.lon_deg, place.lat_deg, place.lon_deg, grid.crs_name());
  }

  std::vector<std::shared_ptr<const ColorRaster>> rasters_;
  std::vector<std::unique_ptr<ImageryPyramid>> pyramids_;  ///< finest first
};

class ImageryKind final : public LayerKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("files", files_,
              "Georeferenced pictures of any format of docs/tiler.md. Where several lie over each "
              "other the finest is shown, among equals the first; where none has data the ground "
              "is drawn as without.");
    visit.key("bands", options_.bands,
              "Bands that are red, green and blue, or one that is grey, counted from 1; left out: "
              "as the file says, else the first three.");
    visit.key("nodata", options_.nodata,
              "Value of samples without data, in all bands: declared (by the file, its mask or "
              "alpha), none, or numbers in quotes.");
    visit.key("black", options_.black,
              "Sample that is shown as black; equal to white: 0 and 255 of bytes, of other "
              "types by percentile.");
    visit.key("white", options_.white, "Sample that is shown as white.");
    visit.key("percentile", options_.percentile,
              "So many percent of the samples are darker than black and lighter than white.",
              core::between(0.0, 49.0));
    visit.key("transfer", options_.transfer,
              "How samples follow light: srgb (as pictures do), linear (as reflectances do), auto: "
              "srgb of bytes, linear of others.",
              core::one_of({"auto", "srgb", "linear"}));
    visit.key("gain", options_.gain,
              "On the light, which then is the ground's albedo; 0: 1 where the mean is plausible "
              "for land (0.08 to 0.22), else what makes it so.",
              core::between(0.0, 100.0));
    visit.key("saturation", options_.saturation, "Of colours; 0: grey, 1: as they are.",
              core::between(0.0, 4.0));
  }

  void validate() const override {
    if (files_.empty()) fail(ErrorKind::Config, "imagery needs files = [\"…\"]");
    if (!options_.bands.empty() && options_.bands.size() != 1 && options_.bands.size() != 3)
      fail(ErrorKind::Config, "bands names {} bands; three (red, green, blue) or one are right",
           options_.bands.size());
    if (!NoData::from_text(options_.nodata))
      fail(ErrorKind::Config, "nodata = \"{}\" is none of {}", options_.nodata, kNoDataWords);
    if (options_.white < options_.black)
      fail(ErrorKind::Config, "white = {} lies below black = {}", options_.white, options_.black);
  }

  std::unique_ptr<LayerKind> clone() const override { return std::make_unique<ImageryKind>(*this); }

  std::unique_ptr<Layer> make(const LayerInputs& inputs) const override {
    return std::make_unique<Imagery>(files_, options_, inputs);
  }

 private:
  std::vector<core::Path> files_;
  ColorOptions options_;
};

}  // namespace

LayerKindInfo imagery_layer() {
  return {"imagery", "Pictures from above, draped on the ground: orthophotos, satellite images.",
          [] { return std::unique_ptr<LayerKind>(std::make_unique<ImageryKind>()); }};
}

}  // namespace terracast::tiler
