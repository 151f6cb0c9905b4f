#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/hash.h"
#include "core/random.h"
#include "tiler/feature_source.h"
#include "tiler/layer.h"
#include "tiler/objects/clear_strips.h"
#include "tiler/objects/model_file.h"
#include "tiler/objects/object_tags.h"
#include "tiler/objects/placed_things.h"
#include "tiler/objects/placement_list.h"
#include "tiler/objects/rules.h"
#include "tiler/objects/things.h"

// Things: built in, or of files; where lists put them, and where features let rules put them. All places
// are decided when the layer is made, since things keep off each other; heights when a tile is.
namespace terracast::tiler {
namespace {

/// Bumped when what stands where, or what things look like, changes.
constexpr int kObjectsVersion = 7;

class ObjectsLayer final : public Layer {
 public:
  ObjectsLayer(const LayerInputs& inputs, const FeatureSourceOptions& source,
               const RuleOptions& rules, const std::vector<core::Path>& lists,
               const std::vector<ModelOptions>& model_options)
      : frame_(inputs.frame) {
    const std::uint64_t seed = core::stream_of(inputs.seed, 0x6f626a65637473ULL);
    hashes_ = fmt::format("objects {} {} {}", kObjectsVersion, seed, things_hash());
    // Kinds: the built-in things, then the models.
    std::vector<ThingKind> kinds;
    for (const ThingInfo& thing : all_things())
      kinds.push_back({.footprint_m = thing.size_m.head<2>()});
    const std::size_t num_things = kinds.size();
    std::vector<Model> models;
    std::uint64_t texture_bytes_left = world::kMaxTexturesBytes;
    for (const ModelOptions& options : model_options) {
      models.push_back(read_model(options, texture_bytes_left));
      kinds.push_back({.footprint_m = models.back().footprint_m});
      hashes_ += " " + models.back().content_hash;
      ledger_.merge(models.back().ledger);
      for (const auto& [name, count] : models.back().counts)
        counts_.emplace_back(fmt::format("{} {}", options.name, name), count);
    }
    Proposals proposals;
    if (source.source == "country" || !source.files.empty()) {
      FeatureSet features = read_features(source, {.wanted = is_feature_wanted, .margin_m = 0.0},
                                          inputs, object_tag_table());
      HiddenCounts hidden;
      std::erase_if(features.features, [&](const VectorFeature& feature) {
        return hidden.is_hidden(feature.tags,
                                feature.kind == FeatureKind::Line ? SightOf::Way : SightOf::Thing);
      });
      hidden.append_to(features.counts);
      ledger_.merge(features.ledger);
      name_ = features.name;
      hashes_ += " " + features.content_hash + " " + rules_text(rules);
      counts_.insert(counts_.end(), features.counts.begin(), features.counts.end());
      strips_.emplace(features.features);
      const GroundBelow ground(inputs);
      proposals = propose(
          {.features = features.features,
           .options = rules,
           .seed = seed,
           .half_size_m = 0.5 * inputs.size_m,
           .is_water = [&](const Eigen::Vector2d& place) { return ground.is_water(place); }});
    }
    const auto thing_by_name = [&](std::string_view name) -> std::optional<std::uint32_t> {
      for (std::size_t i = 0; i < model_options.size(); ++i)
        if (model_options[i].name == name) return static_cast<std::uint32_t>(num_things + i);
      const ThingInfo* thing = find_thing(name);
      if (thing == nullptr) return std::nullopt;
      return static_cast<std::uint32_t>(thing - all_things().data());
    };
    for (const core::Path& list : lists) {
      PlacementList read = read_placements(list, thing_by_name, inputs);
      name_ += (name_.empty() ? "" : ", ") + read.name;
      hashes_ += " " + read.content_hash;
      if (read.num_repeated > 0)
        counts_.emplace_back(fmt::format("{}: rows given twice", read.name), read.num_repeated);
      for (const auto& [what, num] : read.counts)
        counts_.emplace_back(fmt::format("{}: {}", read.name, what), num);
      proposals.candidates.insert(proposals.candidates.end(), read.candidates.begin(),
                                  read.candidates.end());
    }
    placed_ = std::make_unique<PlacedThings>(proposals, kinds, inputs);
    for (const auto& [thing, variant] : placed_->prototypes()) {
      if (thing < num_things) {
        prototypes_.push_back(thing_prototype(all_things()[thing], variant));
        continue;
      }
      Model& model = models[thing - num_things];
      // Its textures follow those of the models before.
      for (world::ShapeLevel& level : model.prototype.levels)
        for (world::Finish& finish : level.shape.finishes)
          if (finish.material == world::Material::Textured)
            finish.pattern = static_cast<std::uint16_t>(finish.pattern + textures_.size());
      textures_.insert(textures_.end(), model.textures.begin(), model.textures.end());
      prototypes_.push_back(model.prototype);
    }
    placed_->index(prototypes_);
    counts_.insert(counts_.end(), placed_->counts().begin(), placed_->counts().end());
    content_hash_ = core::content_hash(hashes_);
  }

  world::LayerInfo info() const override {
    world::LayerInfo info;
    info.source = name_;
    info.content_hash = content_hash_;
    info.counts = counts_;
    info.ledger = ledger_;
    return info;
  }
  std::string input_hash() const override { return content_hash_; }
  std::span<const world::Prototype> prototypes() const override { return prototypes_; }
  std::span<const world::Texture> textures() const override { return textures_; }
  bool holds(const Eigen::Vector2d& place_world, double radius_m) const override {
    return placed_->holds(place_world, radius_m);
  }
  bool keeps_low(const Eigen::Vector2d& place_world, double radius_m) const override {
    return strips_ && strips_->holds(place_world, radius_m);
  }
  void add_objects(const world::TileId& id, const LayerSite& site,
                   world::TileObjects& objects) const override {
    placed_->add_to(id, site, prototypes_, frame_, objects);
  }

 private:
  /// Of the shapes of all built-in things: what they look like belongs to a world's inputs.
  static const std::string& things_hash() {
    static const std::string hash = [] {
      std::string all;
      for (const ThingInfo& thing : all_things()) {
        const world::Prototype prototype = thing_prototype(thing, 0);
        for (const world::ShapeLevel& level : prototype.levels)
          all += core::content_hash(std::as_bytes(std::span(level.shape.vertices_steps)));
      }
      return core::content_hash(all);
    }();
    return hash;
  }
  static std::string rules_text(const RuleOptions& rules) {
    return fmt::format("{} {} {} {} {} {} {} {} {} {} {}", rules.parked_cars, rules.traffic,
                       rules.lamp_spacing_m, rules.aircraft, rules.containers, rules.boats,
                       rules.ships, rules.power_lines, rules.landmarks, rules.barriers,
                       rules.drives_on_left);
  }

  const geo::WorldFrame& frame_;
  std::unique_ptr<PlacedThings> placed_;
  std::optional<ClearStrips> strips_;  ///< where features are read
  std::vector<world::Prototype> prototypes_;
  std::vector<world::Texture> textures_;
  std::vector<std::pair<std::string, std::int64_t>> counts_;
  core::Ledger ledger_;
  std::string name_;
  std::string hashes_;
  std::string content_hash_;
};

class ObjectsKind final : public LayerKind {
 public:
  void describe(core::SchemaVisitor& visit) override {
    source_.describe(visit);
    visit.key("placements", placements_,
              "objects: lists of things at places, .csv or points of any file that OGR reads, with "
              "the columns thing, lat and lon (or x "
              "and y), heading_deg, scale, height_m (of its foot above the ground or water, m), "
              "variant.");
    visit.list("models", models_,
               "objects: things of glTF 2, OBJ and PLY files, which lists name.");
    rules_.describe(visit);
  }
  void validate() const override {
    if (source_.source == "country" || !source_.files.empty()) source_.validate();
    if (source_.source == "files" && source_.files.empty() && placements_.empty())
      core::fail(core::ErrorKind::Config,
                 "objects needs files = [\"…\"] or source = \"country\", from which rules place "
                 "things, or placements = [\"…\"], or both");
    for (std::size_t i = 0; i < models_.size(); ++i) {
      if (find_thing(models_[i].name) != nullptr)
        core::fail(core::ErrorKind::Config,
                   "models: the name {} is a built-in thing's; give the model another",
                   models_[i].name);
      for (std::size_t j = 0; j < i; ++j)
        if (models_[i].name == models_[j].name)
          core::fail(core::ErrorKind::Config, "models: two have the name {}", models_[i].name);
    }
  }
  std::unique_ptr<LayerKind> clone() const override { return std::make_unique<ObjectsKind>(*this); }
  std::unique_ptr<Layer> make(const LayerInputs& inputs) const override {
    return std::make_unique<ObjectsLayer>(inputs, source_, rules_, placements_, models_);
  }

 private:
  FeatureSourceOptions source_;
  RuleOptions rules_;
  std::vector<core::Path> placements_;
  std::vector<ModelOptions> models_;
};

}  // namespace

LayerKindInfo objects_layer() {
  return {"objects",
          "Vehicles, aircraft, ships, cranes, pylons with their wires, lamps, masts and models of "
          "files, where lists and features put "
          "them.",
          [] { return std::unique_ptr<LayerKind>(std::make_unique<ObjectsKind>()); }};
}

}  // namespace terracast::tiler
