#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "core/error.h"
#include "core/hash.h"
#include "tiler/layer.h"
#include "tiler/no_data.h"
#include "tiler/vegetation/forest_pieces.h"
#include "tiler/vegetation/sea_bed_plants.h"
#include "tiler/vegetation/single_plants.h"
#include "tiler/vegetation/vegetation_plan.h"
#include "tiler/world_options.h"

// Plants and stones. All is a pure function of place: places are strewn by BlueNoise, each decides by
// itself what stands on it, and is known by the number of its cell.
//
// Tiles of the levels up to 2 hold each tree (SinglePlants). On coarser ones a forest of 4 km would be 600 000
// trees of two pixels: there pieces of forest stand for their trees (ForestPieces). A tree whose cell of 8 m is
// one is not shown beyond level 2, others are, so that no hole opens where levels meet.
namespace terracast::tiler {
namespace {

/// Bumped when what stands where changes.
constexpr int kVegetationVersion = 10;

class VegetationLayer final : public Layer {
 public:
  VegetationLayer(const LayerInputs& inputs, const core::Path& canopy, const std::string& nodata)
      : plan_(inputs) {
    for (const auto& earlier : inputs.earlier)
      if (dynamic_cast<const VegetationLayer*>(earlier.get()) != nullptr)
        core::fail(
            core::ErrorKind::Config,
            "a world has one layer of kind vegetation, and this is its second; put both into "
            "one: it follows all layers' land cover, and one canopy");
    check_reach_of_pieces(*plan_.library);
    check_reach_of_trees(*plan_.library);
    check_reach_on_bed(*plan_.library);
    if (canopy.empty()) return;
    plan_.canopy = Canopy::open(canopy, nodata, plan_.surface, inputs.size_m);
    canopy_name_ = std::filesystem::path(canopy.written).filename().string();
  }

  world::LayerInfo info() const override {
    world::LayerInfo info;
    const Canopy* canopy = plan_.canopy.get();
    info.source = canopy ? canopy_name_ : "procedural";
    info.content_hash = canopy ? canopy->content_hash() : plan_.library->content_hash();
    if (canopy) {
      info.ledger = canopy->ledger();
      info.counts = {{"canopy samples", canopy->num_samples()},
                     {"canopy samples without a height", canopy->num_voids()},
                     {"canopy samples with trees", canopy->num_wooded()}};
    }
    return info;
  }

  std::string input_hash() const override {
    return core::content_hash(fmt::format("vegetation {} {} {} {}", kVegetationVersion, plan_.seed,
                                          plan_.library->content_hash(),
                                          plan_.canopy ? plan_.canopy->content_hash() : "") +
                              (plan_.dryness ? plan_.dryness->content_hash() : ""));
  }

  std::span<const world::Prototype> prototypes() const override {
    return plan_.library->prototypes();
  }

  void add_objects(const world::TileId& id, const LayerSite& site,
                   world::TileObjects& objects) const override {
    if (id.level > kCoarsestClumpLevel + kLevelsAtCorner) return;
    const PlanBox reached = box_of(id).grown(kStrata[kTallTrees].reach_m);
    if (reached.lowest.maxCoeff() >= plan_.half_size_m ||
        reached.highest.minCoeff() <= -plan_.half_size_m)
      return;
    TileGround ground(plan_, id, site);
    TilePlaces places(plan_, id);
    PlantSink sink(plan_, site, objects);
    ForestPieces pieces(plan_, id, site, ground, places, sink);
    SinglePlants plants(plan_, id, site, ground, places, pieces, sink);
    plants.add_trees(kTallTrees);
    plants.add_trees(kLowTrees);
    plants.add_bushes();
    plants.add_plants();
    plants.add_stones();
    SeaBedPlants(plan_, id, site, places, sink).add_all();
    plants.add_crops();
    pieces.add_all();
  }

 private:
  VegetationPlan plan_;
  std::string canopy_name_;
};

class VegetationKind final : public LayerKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key(
        "canopy", canopy_,
        "vegetation: a raster of canopy heights above the ground in metres, which decides where "
        "trees stand and how tall they are; left out: land cover, height and slope alone do.");
    visit.key(
        "canopy_nodata", canopy_nodata_,
        "vegetation: values of the canopy's samples without a height: declared (by the file), "
        "none, or numbers in quotes.");
  }
  void validate() const override {
    if (!NoData::from_text(canopy_nodata_))
      core::fail(core::ErrorKind::Config, "canopy_nodata = \"{}\" is none of {}", canopy_nodata_,
                 kNoDataWords);
  }
  std::unique_ptr<LayerKind> clone() const override {
    return std::make_unique<VegetationKind>(*this);
  }
  std::unique_ptr<Layer> make(const LayerInputs& inputs) const override {
    return std::make_unique<VegetationLayer>(inputs, canopy_, canopy_nodata_);
  }

 private:
  core::Path canopy_;
  std::string canopy_nodata_ = "declared";
};

}  // namespace

LayerKindInfo vegetation_layer() {
  return {
      "vegetation",
      "Trees, bushes, grass, reeds, crops and boulders where land cover, climate and ground let "
      "them stand, or where a canopy raster has trees; seagrass and boulders on the bed of the "
      "sea.",
      [] { return std::unique_ptr<LayerKind>(std::make_unique<VegetationKind>()); }};
}

}  // namespace terracast::tiler
