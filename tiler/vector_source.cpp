#include "tiler/vector_source.h"

#include <fmt/format.h>
#include <ogrsf_frmts.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <tuple>

#include "core/error.h"
#include "tiler/crs_operation.h"
#include "tiler/gdal_support.h"
#include "tiler/geojson_crs.h"
#include "tiler/osm_census.h"
#include "tiler/osm_element.h"
#include "tiler/osm_order.h"
#include "tiler/vector_fields.h"
#include "tiler/vector_parts.h"
#include "tiler/vector_reader.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;

/// Of VectorData::counts.
constexpr std::string_view kReadCount = "features read";
/// Formats that keep the numbers of their features whatever the order of the rows.
constexpr std::array<std::string_view, 3> kNumberedFormats = {"GPKG", "SQLite", "OpenFileGDB"};
constexpr int kDeepestCollection = 8;

/// Has GDAL keep nodes by a table that takes any number, in place of its quicker one, which takes none below 0.
class AnyOsmNumbers {
 public:
  AnyOsmNumbers() { CPLSetThreadLocalConfigOption(kOption, "NO"); }
  ~AnyOsmNumbers() { CPLSetThreadLocalConfigOption(kOption, nullptr); }
  AnyOsmNumbers(const AnyOsmNumbers&) = delete;
  AnyOsmNumbers& operator=(const AnyOsmNumbers&) = delete;

 private:
  static constexpr const char* kOption = "OSM_USE_CUSTOM_INDEXING";
};

/// Points of a line or ring as the source has them; of a ring without the closing one.
PointsWorld points_of(const OGRSimpleCurve& curve, bool is_ring) {
  PointsWorld points;
  points.reserve(static_cast<std::size_t>(curve.getNumPoints()));
  for (int i = 0; i < curve.getNumPoints(); ++i) {
    const Vector2d at(curve.getX(i), curve.getY(i));
    if (points.empty() || !(points.back() == at)) points.push_back(at);
  }
  while (is_ring && points.size() > 1 && points.front() == points.back()) points.pop_back();
  return points;
}

}  // namespace

VectorReader::LayerRules VectorReader::make_rules(GDALDataset& dataset, OGRLayer* layer) {
  LayerRules rules;
  rules.layer = layer;
  const std::string_view driver = dataset.GetDriver()->GetDescription();
  rules.is_osm = driver == "OSM";
  rules.keeps_numbers =
      std::find(kNumberedFormats.begin(), kNumberedFormats.end(), driver) != kNumberedFormats.end();
  const std::string what = fmt::format("{} (layer {})", file_.written, layer->GetName());
  const HorizontalCrs crs = horizontal_crs(
      layer->GetSpatialRef(), what, {.setter = "ogr2ogr -a_srs", .changer = "ogr2ogr"}, errors_);
  rules.is_geographic = crs.is_geographic;
  rules.crs_name = crs.name;
  const CrsOperation operation = best_operation(crs.wkt, origin_);
  if (operation.pipeline.empty())
    fail(ErrorKind::Input, "{}: PROJ knows no transformation from {} to WGS84; ogr2ogr -t_srs may",
         what, crs.name);
  if (operation.is_ballpark)
    data_.warnings.push_back(fmt::format(
        "{}: only a ballpark transformation leads from {} to WGS84 (its datum is taken for WGS84)",
        what, crs.name));
  if (operation.pipeline != "+proj=noop") {
    rules.geodetic_from_crs = std::make_shared<SharedTransformation>(operation.pipeline, true);
    if (!rules.geodetic_from_crs->is_good())
      fail(ErrorKind::Input, "{}: the transformation {} cannot be used", what, operation.pipeline);
  }
  const OGRFeatureDefn* fields = layer->GetLayerDefn();
  rules.osm_field = fields->GetFieldIndex("osm_id");
  rules.osm_way_field = fields->GetFieldIndex("osm_way_id");
  if (!options_.number_field.empty() && options_.number_field != "fid") {
    rules.number_field = fields->GetFieldIndex(options_.number_field.c_str());
    if (rules.number_field < 0)
      fail(ErrorKind::Input, "{}: has no field \"{}\" for the features' numbers; its fields are {}",
           what, options_.number_field, [&] {
             std::string names;
             for (int i = 0; i < fields->GetFieldCount(); ++i)
               names += (i == 0 ? "" : ", ") + std::string(fields->GetFieldDefn(i)->GetNameRef());
             return names.empty() ? std::string("none") : names;
           }());
  }
  if (dataset.GetLayerCount() > 1) {
    FeatureHash hash;
    hash.add(std::string_view(layer->GetName()));
    rules.number_salt = hash.value() >> 24 << 40;  // rows below 2^40 stay to be read
  }
  return rules;
}

const VectorReader::LayerRules& VectorReader::rules_of(GDALDataset& dataset, OGRLayer* layer) {
  for (const auto& rules : rules_)
    if (rules->layer == layer) return *rules;
  rules_.push_back(std::make_unique<LayerRules>(make_rules(dataset, layer)));
  return *rules_.back();
}

VectorReader::Number VectorReader::number_of(const OGRFeature& feature, const LayerRules& rules,
                                             const FeatureTags& tags) const {
  const auto osm = [](OsmKind kind, std::uint64_t id) {
    return Number{.value = osm_number(kind, id), .is_osm = true};
  };
  const auto text_of = [&](int field) -> std::string {
    if (field < 0 || feature.IsFieldSetAndNotNull(field) == 0) return "";
    return const_cast<OGRFeature&>(feature).GetFieldAsString(field);
  };
  if (rules.number_field >= 0) {
    const std::string text = text_of(rules.number_field);
    if (options_.number_field != "osm_id" && options_.number_field != "osm_way_id") {
      const auto number = feature_number(text);
      if (!number)
        fail(ErrorKind::Input,
             "{}: feature {} of layer {} has \"{}\" in {}, which is no whole number from 0 and no "
             "element of OpenStreetMap (way/123)",
             file_.written, feature.GetFID(), rules.layer->GetName(), text, options_.number_field);
      return {.value = *number, .is_osm = !whole_number(text)};
    }
  }
  const std::string_view layer = rules.layer->GetName();
  if (options_.number_field != "fid") {
    const std::string way_element = text_of(rules.osm_way_field);
    if (const auto way = whole_number(way_element)) return osm(OsmKind::Way, *way);
    std::string element = text_of(rules.osm_field);
    if (rules.is_osm && (way_element + element).starts_with('-'))
      return unuploaded_number(feature, way_element.empty() ? element : way_element);
    // As osm2pgsql writes relations.
    const bool is_negative = element.starts_with('-');
    if (is_negative) element.erase(0, 1);
    if (const auto id = whole_number(element)) {
      if (is_negative) return osm(OsmKind::Relation, *id);
      const OGRwkbGeometryType type = wkbFlatten(feature.GetGeometryRef()->getGeometryType());
      if (type == wkbPoint) return osm(OsmKind::Node, *id);
      if (type == wkbLineString) return osm(OsmKind::Way, *id);
      // Areas of a source that tells ways from relations are relations where it names no way.
      return osm(
          rules.osm_way_field >= 0 || layer == "multilinestrings" || layer == "other_relations"
              ? OsmKind::Relation
              : OsmKind::Way,
          *id);
    }
  }
  if (rules.keeps_numbers || options_.number_field == "fid")
    return {.value = static_cast<std::uint64_t>(feature.GetFID()) ^ rules.number_salt,
            .is_osm = false};
  FeatureHash hash;
  hash.add(rules.number_salt);
  for (const auto& [key, value] : tags.all()) {
    hash.add(std::string_view(key));
    hash.add(std::string_view(value));
  }
  // The places' bytes, as any of the formats would hold them.
  const OGRGeometry* geometry = feature.GetGeometryRef();
  std::vector<unsigned char> wkb(static_cast<std::size_t>(geometry->WkbSize()));
  geometry->exportToWkb(wkbNDR, wkb.data(), wkbVariantIso);
  hash.add(core::content_hash64(std::as_bytes(std::span(wkb))));
  return {.value = hash.value(), .is_osm = false};
}

/// The number of an element of OpenStreetMap that was never uploaded, below 0: of no element that there is.
VectorReader::Number VectorReader::unuploaded_number(const OGRFeature& feature,
                                                     const std::string& text) const {
  const std::uint64_t id = std::uint64_t{0} - whole_number(text.substr(1)).value_or(1);
  const OGRwkbGeometryType type = wkbFlatten(feature.GetGeometryRef()->getGeometryType());
  const bool is_relation = feature.GetFieldIndex("osm_way_id") >= 0 &&
                           feature.IsFieldSetAndNotNull(feature.GetFieldIndex("osm_way_id")) == 0;
  const OsmKind kind = type == wkbPoint ? OsmKind::Node
                       : is_relation    ? OsmKind::Relation
                                        : OsmKind::Way;
  return {.value = osm_number(kind, id), .is_osm = false};
}

void VectorReader::collect(const OGRGeometry* geometry, int depth,
                           std::array<std::vector<std::vector<PointsWorld>>, 3>& parts_by_kind) {
  if (geometry == nullptr || geometry->IsEmpty() != FALSE || depth > kDeepestCollection) return;
  std::unique_ptr<OGRGeometry> straight;
  if (geometry->hasCurveGeometry() != FALSE) {
    straight.reset(geometry->getLinearGeometry());
    geometry = straight.get();
    if (geometry == nullptr) return;
  }
  auto& points = parts_by_kind[static_cast<std::size_t>(FeatureKind::Point)];
  auto& lines = parts_by_kind[static_cast<std::size_t>(FeatureKind::Line)];
  auto& areas = parts_by_kind[static_cast<std::size_t>(FeatureKind::Area)];
  const OGRwkbGeometryType type = wkbFlatten(geometry->getGeometryType());
  if (type == wkbPoint && options_.points) {
    points.push_back({{{geometry->toPoint()->getX(), geometry->toPoint()->getY()}}});
  } else if (type == wkbLineString && options_.lines) {
    PointsWorld line = points_of(*geometry->toLineString(), false);
    if (line.size() >= 2)
      lines.push_back({std::move(line)});
    else
      ++num_collapsed_;
  } else if ((type == wkbPolygon || type == wkbTriangle) && options_.areas) {
    std::vector<PointsWorld> rings;
    const OGRPolygon* polygon = geometry->toPolygon();
    for (const OGRLinearRing* ring : *polygon) {
      PointsWorld points_crs = points_of(*ring, true);
      if (points_crs.size() >= 3) {
        rings.push_back(std::move(points_crs));
        continue;
      }
      ++num_collapsed_;
      if (rings.empty()) break;  // no outer ring: its holes are in nothing
    }
    if (!rings.empty()) areas.push_back(std::move(rings));
  } else if (OGR_GT_IsSubClassOf(type, wkbGeometryCollection) != FALSE) {
    for (const OGRGeometry* member : *geometry->toGeometryCollection())
      collect(member, depth + 1, parts_by_kind);
  }
}

void VectorReader::take(const OGRFeature& feature, const LayerRules& rules) {
  ++num_read_;
  const OGRGeometry* geometry = feature.GetGeometryRef();
  if (geometry == nullptr || geometry->IsEmpty() != FALSE) {
    ++num_without_geometry_;
    return;
  }
  const FeatureTags tags(tags_of_fields(feature, rules.is_osm, num_too_deep_));
  const bool is_wanted = !options_.wanted || options_.wanted(tags);
  if (!is_wanted) {
    ++num_unwanted_;
    if (has_near_) return;
  }
  std::array<std::vector<std::vector<PointsWorld>>, 3> parts_by_kind;
  const std::int64_t num_collapsed = num_collapsed_;
  collect(geometry, 0, parts_by_kind);
  // A point or a line where areas are read, …
  if (is_wanted && num_collapsed_ == num_collapsed &&
      std::all_of(parts_by_kind.begin(), parts_by_kind.end(),
                  [](const auto& parts) { return parts.empty(); }))
    ++num_unwanted_;
  bool is_outside = false;
  for (std::size_t kind = 0; kind < parts_by_kind.size(); ++kind) {
    auto& parts = parts_by_kind[kind];
    if (parts.empty()) continue;
    VectorFeature made;
    made.kind = static_cast<FeatureKind>(kind);
    const Vector2d first = parts.front().front().front();
    if (!turn_into_degrees(parts, made.kind, rules)) {
      num_broken_ += is_wanted ? 1 : 0;
      if (broken_place_.empty()) broken_place_ = fmt::format("({}, {})", first.x(), first.y());
      return;
    }
    Box box = box_of(parts);
    found_deg_.add(box);
    if (!box.overlaps(square_deg_)) {
      is_outside = true;
      continue;
    }
    has_near_ = true;
    if (!is_wanted) return;
    const Vector2d reach_deg =
        (box.highest - Vector2d(origin_.lon_deg, origin_.lat_deg))
            .cwiseMax(Vector2d(origin_.lon_deg, origin_.lat_deg) - box.lowest);
    if (reach_deg.maxCoeff() > kFarthest_deg) {
      cut_far(parts, made.kind);
      ++num_cut_;
      if (parts.empty()) continue;
    }
    const Number number = number_of(feature, rules, tags);
    made.number = number.value;
    num_osm_ += number.is_osm ? 1 : 0;
    made.tags = tags;
    made.parts_world = std::move(parts);
    data_.features.push_back(std::move(made));
    is_outside = false;
  }
  if (is_outside && is_wanted) ++num_outside_;
}

bool VectorReader::is_read(OGRLayer& layer, bool is_osm) const {
  const std::string name = layer.GetName();
  if (is_osm && options_.layers.empty())
    return name == "points"            ? options_.points
           : name == "multipolygons"   ? options_.areas
           : name == "other_relations" ? false
                                       : options_.lines;
  return options_.layers.empty() ||
         std::find(options_.layers.begin(), options_.layers.end(), name) != options_.layers.end();
}

void VectorReader::read_osm(GDALDataset& dataset) {
  // The other layers are then not put together at all.
  std::string names;
  for (int i = 0; i < dataset.GetLayerCount(); ++i)
    if (is_read(*dataset.GetLayer(i), true))
      names += (names.empty() ? "" : ",") + std::string(dataset.GetLayer(i)->GetName());
  dataset.ExecuteSQL(("SET interest_layers = " + names).c_str(), nullptr, nullptr);
  while (true) {
    OGRLayer* layer = nullptr;
    const std::unique_ptr<OGRFeature> feature(
        dataset.GetNextFeature(&layer, nullptr, nullptr, nullptr));
    if (!feature) break;
    if (!is_read(*layer, true)) continue;
    const LayerRules& rules = rules_of(dataset, layer);
    if (!was_deleted(*feature, rules)) take(*feature, rules);
  }
}

void VectorReader::read_layers(GDALDataset& dataset) {
  for (int i = 0; i < dataset.GetLayerCount(); ++i) {
    OGRLayer* layer = dataset.GetLayer(i);
    if (!is_read(*layer, false)) continue;
    layer->ResetReading();
    const bool states_count = layer->TestCapability(OLCFastFeatureCount) != FALSE;
    if (layer->GetGeomType() == wkbNone && states_count) {
      num_without_geometry_ += std::max<GIntBig>(layer->GetFeatureCount(), 0);
      continue;
    }
    if (layer->GetGeomType() == wkbNone) {
      while (const auto feature = std::unique_ptr<OGRFeature>(layer->GetNextFeature()))
        ++num_without_geometry_;
      continue;
    }
    const LayerRules& rules = rules_of(dataset, layer);
    const std::int64_t num_before = num_read_;
    while (const auto feature = std::unique_ptr<OGRFeature>(layer->GetNextFeature()))
      take(*feature, rules);
    // What the file counts, and its reader does not give. Where the file states no number, counting would read it again.
    if (states_count)
      num_passed_over_ += std::max<GIntBig>(layer->GetFeatureCount() - (num_read_ - num_before), 0);
  }
}

/// Whether an editor has deleted it, and not yet told the server.
bool VectorReader::was_deleted(const OGRFeature& feature, const LayerRules& rules) const {
  if (census_.deleted.empty()) return false;
  const auto number_in = [&](int field) -> std::optional<std::int64_t> {
    if (field < 0 || feature.IsFieldSetAndNotNull(field) == 0) return std::nullopt;
    return feature.GetFieldAsInteger64(field);
  };
  if (const auto way = number_in(rules.osm_way_field)) return census_.is_deleted('w', *way);
  const auto number = number_in(rules.osm_field);
  if (!number) return false;
  const std::string_view layer = rules.layer->GetName();
  return census_.is_deleted(layer == "points" ? 'n' : layer == "lines" ? 'w' : 'r', *number);
}

void VectorReader::check_that_some_are_left() const {
  if (num_read_ == 0 && census_.num_ways > 0 && census_.num_ways_without_nodes == census_.num_ways)
    fail(ErrorKind::Input,
         "{}: none of its {} ways has a place: they refer to nodes that the file does not hold (it "
         "holds {}); extract them with their nodes (osmium extract --strategy=complete_ways, or in "
         "Overpass \"(._;>;); out body;\")",
         file_.written, census_.num_ways, census_.num_nodes);
  if (num_read_ > 0 && num_without_geometry_ == num_read_)
    fail(ErrorKind::Input,
         "{}: none of its {} features has a geometry; write it with geometries (ogr2ogr makes them "
         "of columns with -oo X_POSSIBLE_NAMES=… and -oo Y_POSSIBLE_NAMES=…)",
         file_.written, num_read_);
}

VectorData VectorReader::read() {
  GdalDatasetPtr dataset = open_gdal_vectors(file_, errors_);
  const std::string_view format = dataset->GetDriver()->GetDescription();
  const bool is_osm = format == "OSM";
  std::optional<AnyOsmNumbers> any_numbers;
  std::unique_ptr<OrderedOsm> ordered;
  GdalDatasetPtr source;  // in place of the file itself
  if (is_osm) {
    census_ = count_osm(gdal_path(file_));
    if (!census_.is_whole)
      data_.warnings.push_back(
          "its elements could not be counted to their end: what is left out of it is told in part");
    if (census_.has_places_in_ways && census_.num_ways_without_nodes + census_.num_ways_cut > 0)
      fail(ErrorKind::Input,
           "{}: {} of its {} ways hold their places themselves, and the file lacks their nodes "
           "(osmium add-locations-to-ways leaves them out); give the file that it was made of, or "
           "turn it into GeoJSON with osmium export --index-type=none",
           file_.written, census_.num_ways_without_nodes + census_.num_ways_cut, census_.num_ways);
    if (census_.num_before_members > 0 && !census_.is_text)
      fail(ErrorKind::Input,
           "{}: {} of its ways and areas stand before their nodes or ways, as no program writes a "
           "file of this format; osmium sort FILE -o SORTED.osm.pbf puts it in order",
           file_.written, census_.num_before_members);
    if (census_.num_repeated > 0 && !census_.is_text)
      fail(
          ErrorKind::Input,
          "{}: {} of its nodes and ways stand there once more; give it as text (osmium cat FILE -o "
          "FILE.osm), of which one of each is read",
          file_.written, census_.num_repeated);
    if (census_.num_before_members + census_.num_repeated > 0)
      ordered = std::make_unique<OrderedOsm>(file_, gdal_path(file_));
    if (census_.num_negative > 0 || !census_.has_nodes_in_order) any_numbers.emplace();
    if (ordered || any_numbers) {
      source = open_gdal_vectors(ordered ? ordered->file() : file_, errors_);
    }
  }
  if (format == "GeoJSON") check_geojson_crs(file_);
  for (const std::string& name : options_.layers)
    if (dataset->GetLayerByName(name.c_str()) == nullptr) {
      std::string known;
      for (int i = 0; i < dataset->GetLayerCount(); ++i)
        known += (i == 0 ? "" : ", ") + std::string(dataset->GetLayer(i)->GetName());
      fail(ErrorKind::Input, "{}: has no layer \"{}\"; its layers are {}", file_.written, name,
           known);
    }
  if (is_osm)
    read_osm(source ? *source : *dataset);
  else
    read_layers(*dataset);
  if (errors_.has_failure())
    fail(ErrorKind::Input, "{}: its features cannot be read; is it damaged or truncated? ({})",
         file_.written, errors_.text());
  check_that_some_are_left();
  if (!has_near_ && found_deg_.is_empty() && !broken_place_.empty())
    fail(ErrorKind::Input,
         "{}: none of its {} features has a place on the Earth: {} is none in its coordinate "
         "reference system ({}); state the right one with ogr2ogr -a_srs",
         file_.written, num_read_, broken_place_, rules_.front()->crs_name);
  if (!has_near_ && !found_deg_.is_empty())
    fail(ErrorKind::Input,
         "{}: none of its {} features lies in the world's square: they lie at latitudes {:.4f} to "
         "{:.4f}, longitudes {:.4f} to {:.4f}, and the square at {:.4f} to {:.4f}, {:.4f} to "
         "{:.4f}; is its coordinate reference system ({}) the right one?",
         file_.written, num_read_, found_deg_.lowest.y(), found_deg_.highest.y(),
         found_deg_.lowest.x(), found_deg_.highest.x(), square_deg_.lowest.y(),
         square_deg_.highest.y(), square_deg_.lowest.x(), square_deg_.highest.x(),
         rules_.front()->crs_name);
  put_on_ground();
  std::stable_sort(data_.features.begin(), data_.features.end(),
                   [](const VectorFeature& a, const VectorFeature& b) {
                     return a.number != b.number ? a.number < b.number : a.kind < b.kind;
                   });
  // Those of one number, in an order that is not the file's.
  const auto order = [](const VectorFeature& a, const VectorFeature& b) {
    const auto rank = [](const VectorFeature& f) {
      const Vector2d& first = f.parts_world.front().front().front();
      return std::tuple(f.number, f.kind, first.x(), first.y(),
                        f.parts_world.front().front().size(), f.tags.all());
    };
    return rank(a) < rank(b);
  };
  for (std::size_t begin = 0; begin < data_.features.size();) {
    std::size_t end = begin + 1;
    while (end < data_.features.size() &&
           data_.features[end].number == data_.features[begin].number)
      ++end;
    if (end - begin > 1)
      std::sort(data_.features.begin() + static_cast<std::ptrdiff_t>(begin),
                data_.features.begin() + static_cast<std::ptrdiff_t>(end), order);
    begin = end;
  }
  data_.file_name = std::filesystem::path(file_.written).filename().string();
  data_.content_hash = content_hash_of(*dataset, file_);
  data_.counts = {{std::string(kReadCount), num_read_},
                  {std::string(kOsmCount), num_osm_},
                  {"features of no use here", num_unwanted_},
                  {"features outside the world", num_outside_},
                  {"features without a geometry", num_without_geometry_},
                  {"features with places that are none", num_broken_},
                  {"lines and rings of too few points", num_collapsed_},
                  {"features cut far from the world", num_cut_}};
  if (num_passed_over_ > 0)
    data_.counts.emplace_back("features that the format's reader passed over", num_passed_over_);
  if (num_too_deep_ > 0)
    data_.counts.emplace_back("values nested too deeply, not understood", num_too_deep_);
  for (auto& count : census_.counts()) data_.counts.push_back(std::move(count));
  return std::move(data_);
}

std::vector<std::pair<std::string, std::int64_t>> VectorData::left_out() const {
  std::vector<std::pair<std::string, std::int64_t>> left_out;
  for (const auto& [what, num] : counts)
    if (num > 0 && what != kReadCount && what != kOsmCount) left_out.emplace_back(what, num);
  return left_out;
}

VectorData read_vectors(const core::Path& file, const VectorOptions& options,
                        const VectorFrame& frame) {
  return VectorReader(file, options, frame).read();
}

}  // namespace terracast::tiler
