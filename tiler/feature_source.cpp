#include "tiler/feature_source.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <unordered_set>

#include "core/error.h"
#include "core/hash.h"
#include "tiler/country/country.h"
#include "tiler/surface.h"
#include "tiler/tag_ledger.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

bool is_wanted(const VectorFeature& feature, const VectorOptions& wanted) {
  const bool is_kind = feature.kind == FeatureKind::Point  ? wanted.points
                       : feature.kind == FeatureKind::Line ? wanted.lines
                                                           : wanted.areas;
  return is_kind && (!wanted.wanted || wanted.wanted(feature.tags));
}

void add_counts(const std::vector<std::pair<std::string, std::int64_t>>& from, FeatureSet& to) {
  for (const auto& one : from) {
    const auto known = std::find_if(to.counts.begin(), to.counts.end(),
                                    [&](const auto& entry) { return entry.first == one.first; });
    if (known == to.counts.end())
      to.counts.push_back(one);
    else
      known->second += one.second;
  }
}

}  // namespace

VectorFrame vector_frame(const LayerInputs& inputs) {
  const WorldSurface& surface = inputs.surface;
  const geo::WorldFrame& frame = inputs.frame;
  return {.frame = frame,
          .size_m = inputs.size_m,
          .ground_height_m = [&surface, &frame](const geo::Geodetic& place) {
            if (const auto height_m = surface.measured_height_m(place.lat_deg, place.lon_deg))
              return *height_m;
            // Beyond the square the surface is asked at the place found so far: each round shrinks
            // what is wrong by the Earth's bend (0.01 at 60 km) times the ground's slope.
            geo::Geodetic found = place;
            found.height_m = 0.5 * (surface.lowest_m() + surface.highest_m());
            for (int i = 0; i < 4; ++i) {
              const Eigen::Vector3d at = frame.world_from_geodetic(found);
              const double z_m = surface.sample(at.x(), at.y()).z_world;
              found.height_m = frame.geodetic_from_world({at.x(), at.y(), z_m}).height_m;
            }
            return found.height_m;
          }};
}

void FeatureSourceOptions::describe(core::SchemaVisitor& visit, std::span<const OwnSource> own) {
  std::vector<std::string> names = {"files", "country"};
  std::string summary =
      "files: features of any file that OGR reads. country: those of the country that is made "
      "from the world's seed.";
  for (const OwnSource& one : own) {
    names.push_back(one.name);
    summary += " " + one.name + ": " + one.summary;
  }
  visit.key("source", source, summary, core::one_of(std::move(names)));
  visit.key("files", files,
            "files: .osm.pbf, GeoJSON, GeoPackage, Shapefile, …, in order of priority where they "
            "hold features of one number.");
  visit.key("layers", layers, "files: which of their layers are read; none: all.");
  visit.key(
      "number_field", number_field,
      "files: field of the features' numbers; left out: OpenStreetMap's ids, the format's own "
      "numbers, or hashes of what the features hold.");
}

void FeatureSourceOptions::validate() const {
  if (source == "files" && files.empty())
    fail(ErrorKind::Config,
         "source = \"files\" needs files = [\"…\"]; or set source = \"country\"");
  if (source != "files" && !files.empty())
    fail(ErrorKind::Config, "source = \"{}\" reads no files, and {} are given", source,
         files.size());
}

FeatureSet read_features(const FeatureSourceOptions& options, VectorOptions wanted,
                         const LayerInputs& inputs, const TagTable& tags) {
  FeatureSet set;
  if (options.source == "country") {
    const Country& country = inputs.country();
    for (const VectorFeature& feature : country.features())
      if (is_wanted(feature, wanted)) set.features.push_back(feature);
    set.name = "country";
    set.content_hash = country.content_hash();
    set.ledger = ledger_of_tags(set.features, tags);
    return set;
  }
  wanted.layers = options.layers;
  wanted.number_field = options.number_field;
  std::string hashes;
  std::unordered_set<std::uint64_t> known;  // of the files before
  for (const core::Path& file : options.files) {
    VectorData data = read_vectors(file, wanted, vector_frame(inputs));
    for (const std::string& warning : data.warnings)
      inputs.context.log.warn("{}: {}", data.file_name, warning);
    set.name += (set.name.empty() ? "" : ", ") + data.file_name;
    hashes += data.content_hash + " ";
    add_counts(data.counts, set);
    // One file may hold several of one number, such as the point and the area of a thing.
    std::unordered_set<std::uint64_t> of_file;
    std::int64_t num_known = 0;
    for (VectorFeature& feature : data.features) {
      of_file.insert(feature.number);
      if (known.contains(feature.number))
        ++num_known;
      else
        set.features.push_back(std::move(feature));
    }
    known.merge(of_file);
    if (num_known > 0) add_counts({{"in an earlier file too", num_known}}, set);
  }
  set.content_hash =
      options.files.size() == 1 ? hashes.substr(0, hashes.size() - 1) : core::content_hash(hashes);
  std::stable_sort(set.features.begin(), set.features.end(),
                   [](const auto& a, const auto& b) { return a.number < b.number; });
  set.ledger = ledger_of_tags(set.features, tags, options.number_field);
  return set;
}

}  // namespace terracast::tiler
