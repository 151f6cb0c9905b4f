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
#include "core/parallel.h"
#include "geo/units.h"
#include "tiler/crs_operation.h"
#include "tiler/gdal_support.h"
#include "tiler/geojson_crs.h"
#include "tiler/osm_element.h"
#include "tiler/vector_parts.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;

/// Of VectorData::counts.
constexpr std::string_view kReadCount = "features read";
/// Points of a long edge stand no farther apart: what is straight in latitude and longitude bends from
/// a straight line by s^2 / 8R tan(latitude), 2 cm for 1 km at 45 degrees.
constexpr double kLongestEdge_m = 1000.0;
/// Features are cut so far from the world's middle: the tangent frame folds back beyond the horizon.
constexpr double kFarthest_deg = 10.0;
constexpr double kMetresPerDegree = 111320.0;
/// Formats that keep the numbers of their features whatever the order of the rows.
constexpr std::array<std::string_view, 3> kNumberedFormats = {"GPKG", "SQLite", "OpenFileGDB"};
constexpr int kDeepestCollection = 8;

class Reader {
 public:
  Reader(const core::Path& file, const VectorOptions& options, const VectorFrame& frame)
      : file_(file), options_(options), frame_(frame), origin_(frame.frame.origin()) {
    const double reach_m = 0.5 * frame.size_m + options.margin_m;
    square_m_.add(Vector2d::Constant(-reach_m));
    square_m_.add(Vector2d::Constant(reach_m));
    // The square in longitude and latitude, at the ground's heights.
    for (int i = 0; i <= 32; ++i)
      for (const Vector2d& edge : {Vector2d(-1, i / 16.0 - 1), Vector2d(1, i / 16.0 - 1),
                                   Vector2d(i / 16.0 - 1, -1), Vector2d(i / 16.0 - 1, 1)})
        for (const double z_m : {-12000.0, 10000.0}) {
          const geo::Geodetic at = frame.frame.geodetic_from_world(
              {reach_m * edge.x(), reach_m * edge.y(), z_m - 0.5 * reach_m * reach_m / 6.4e6});
          square_deg_.add(Vector2d(near_origin(at.lon_deg), at.lat_deg));
        }
  }

  VectorData read();

 private:
  struct LayerRules {
    OGRLayer* layer = nullptr;
    bool is_osm = false;
    bool is_geographic = true;
    std::shared_ptr<const SharedTransformation> geodetic_from_crs;  ///< null: nothing to do
    std::string crs_name;
    int number_field = -1;
    int osm_field = -1;      ///< osm_id
    int osm_way_field = -1;  ///< osm_way_id
    bool keeps_numbers = false;
    std::uint64_t number_salt = 0;  ///< tells the numbers of one layer from another's
  };

  double near_origin(double lon_deg) const {
    return lon_deg - 360.0 * std::round((lon_deg - origin_.lon_deg) / 360.0);
  }
  const LayerRules& rules_of(GDALDataset& dataset, OGRLayer* layer);
  LayerRules make_rules(GDALDataset& dataset, OGRLayer* layer);
  FeatureTags tags_of(const OGRFeature& feature, const LayerRules& rules) const;
  struct Number {
    std::uint64_t value;
    bool is_osm;  ///< osm_number()
  };
  Number number_of(const OGRFeature& feature, const LayerRules& rules,
                   const FeatureTags& tags) const;
  void take(const OGRFeature& feature, const LayerRules& rules);
  void collect(const OGRGeometry* geometry, int depth,
               std::array<std::vector<std::vector<PointsWorld>>, 3>& parts_by_kind);
  bool turn_into_degrees(std::vector<std::vector<PointsWorld>>& parts, FeatureKind kind,
                         const LayerRules& rules);
  bool transform(PointsWorld& line, const LayerRules& rules) const;
  void split_long_edges(PointsWorld& line_crs, PointsWorld& line_deg, bool is_ring,
                        const LayerRules& rules) const;
  void unwrap(std::vector<std::vector<PointsWorld>>& parts) const;
  void cut_far(std::vector<std::vector<PointsWorld>>& parts, FeatureKind kind) const;
  void put_on_ground();

  const core::Path& file_;
  const VectorOptions& options_;
  const VectorFrame& frame_;
  const GdalErrors errors_;
  geo::Geodetic origin_;
  Box square_m_;
  Box square_deg_;  ///< longitude, latitude
  Box found_deg_;   ///< of all that was read
  bool has_near_ = false;
  std::string broken_place_;  ///< begins the first feature whose places are none
  std::vector<std::unique_ptr<LayerRules>> rules_;
  VectorData data_;
  std::int64_t num_read_ = 0;
  std::int64_t num_osm_ = 0;
  std::int64_t num_unwanted_ = 0;
  std::int64_t num_outside_ = 0;
  std::int64_t num_without_geometry_ = 0;
  std::int64_t num_broken_ = 0;
  std::int64_t num_collapsed_ = 0;
  std::int64_t num_cut_ = 0;
};

Reader::LayerRules Reader::make_rules(GDALDataset& dataset, OGRLayer* layer) {
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

const Reader::LayerRules& Reader::rules_of(GDALDataset& dataset, OGRLayer* layer) {
  for (const auto& rules : rules_)
    if (rules->layer == layer) return *rules;
  rules_.push_back(std::make_unique<LayerRules>(make_rules(dataset, layer)));
  return *rules_.back();
}

FeatureTags Reader::tags_of(const OGRFeature& feature, const LayerRules& rules) const {
  std::vector<std::pair<std::string, std::string>> tags;
  for (int i = 0; i < feature.GetFieldCount(); ++i) {
    if (feature.IsFieldSetAndNotNull(i) == 0) continue;
    const std::string name = feature.GetFieldDefnRef(i)->GetNameRef();
    const char* text = const_cast<OGRFeature&>(feature).GetFieldAsString(i);
    if (name == "other_tags" || name == "all_tags")
      unpack_tags(text, tags);
    else if (!rules.is_osm)
      tags.emplace_back(name, text);
  }
  return FeatureTags(std::move(tags));
}

Reader::Number Reader::number_of(const OGRFeature& feature, const LayerRules& rules,
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
    if (const auto way = whole_number(text_of(rules.osm_way_field))) return osm(OsmKind::Way, *way);
    std::string element = text_of(rules.osm_field);
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

void Reader::collect(const OGRGeometry* geometry, int depth,
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

/// False: a place that is none. In place, from the source's coordinates to longitude and latitude.
bool Reader::transform(PointsWorld& line, const LayerRules& rules) const {
  for (const Vector2d& at : line)
    if (!at.allFinite()) return false;
  if (rules.geodetic_from_crs) {
    std::vector<double> x(line.size());
    std::vector<double> y(line.size());
    for (std::size_t i = 0; i < line.size(); ++i) {
      x[i] = line[i].x();
      y[i] = line[i].y();
    }
    if (!rules.geodetic_from_crs->transform(x, y)) return false;
    for (std::size_t i = 0; i < line.size(); ++i) line[i] = {x[i], y[i]};
  }
  for (const Vector2d& at : line)
    if (!(std::abs(at.y()) <= 90.0 && std::abs(at.x()) <= 720.0)) return false;
  return true;
}

/// Adds points on the long edges that come near the square.
void Reader::split_long_edges(PointsWorld& line_crs, PointsWorld& line_deg, bool is_ring,
                              const LayerRules& rules) const {
  const std::size_t num_edges = line_deg.size() - (is_ring ? 0 : 1);
  const double lon_scale = std::cos(geo::radians_from_degrees(origin_.lat_deg));
  PointsWorld fine_crs;
  bool is_split = false;
  for (std::size_t i = 0; i < line_deg.size(); ++i) {
    fine_crs.push_back(line_crs[i]);
    if (i >= num_edges) break;
    const std::size_t next = (i + 1) % line_deg.size();
    Box edge;
    edge.add(line_deg[i]);
    edge.add(line_deg[next]);
    const Vector2d extent = edge.highest - edge.lowest;
    const double length_m = kMetresPerDegree * std::hypot(extent.x() * lon_scale, extent.y());
    if (length_m <= kLongestEdge_m || extent.x() > 180.0) continue;
    const double middle_deg = 0.5 * (edge.lowest.x() + edge.highest.x());
    edge.lowest.x() += near_origin(middle_deg) - middle_deg;
    edge.highest.x() += near_origin(middle_deg) - middle_deg;
    // What an edge bends by is far less than a hundredth of its length.
    edge.lowest -= Vector2d::Constant(0.01 * extent.norm());
    edge.highest += Vector2d::Constant(0.01 * extent.norm());
    if (!edge.overlaps(square_deg_)) continue;
    const int num_pieces = static_cast<int>(std::ceil(length_m / kLongestEdge_m));
    for (int k = 1; k < num_pieces; ++k)
      fine_crs.push_back(line_crs[i] + (line_crs[next] - line_crs[i]) * (double(k) / num_pieces));
    is_split = true;
  }
  if (!is_split) return;
  line_deg = fine_crs;
  if (!transform(line_deg, rules)) line_deg.clear();
}

/// Turns longitudes by whole turns, so that they run on round the origin.
void Reader::unwrap(std::vector<std::vector<PointsWorld>>& parts) const {
  for (auto& part : parts) {
    Box box;
    for (const PointsWorld& line : part)
      for (const Vector2d& at : line) box.add(at);
    // A part over more than half the Earth crosses the date line, or reaches round the Earth.
    bool crosses = box.highest.x() - box.lowest.x() > 180.0;
    for (const PointsWorld& line : part)
      for (const Vector2d& at : line)
        crosses = crosses && std::abs(at.x()) > 90.0 && std::abs(at.x()) < 180.0;
    const double middle_deg = 0.5 * (box.highest.x() + box.lowest.x());
    const double turn_deg = near_origin(middle_deg) - middle_deg;
    for (PointsWorld& line : part)
      for (Vector2d& at : line) at.x() = crosses ? near_origin(at.x()) : at.x() + turn_deg;
  }
}

void Reader::cut_far(std::vector<std::vector<PointsWorld>>& parts, FeatureKind kind) const {
  if (kind == FeatureKind::Point) return;
  const bool is_ring = kind == FeatureKind::Area;
  const std::array<double, 2> middle = {origin_.lon_deg, origin_.lat_deg};
  for (auto& part : parts) {
    for (PointsWorld& line : part)
      for (int axis = 0; axis < 2; ++axis)
        for (const double side : {-1.0, 1.0})
          line = cut(line, axis, middle[static_cast<std::size_t>(axis)] + side * kFarthest_deg,
                     side, is_ring);
    std::erase_if(part, [&](const PointsWorld& line) { return line.size() < (is_ring ? 3U : 2U); });
  }
  std::erase_if(parts, [](const auto& part) { return part.empty(); });
}

/// False: places that are none.
bool Reader::turn_into_degrees(std::vector<std::vector<PointsWorld>>& parts, FeatureKind kind,
                               const LayerRules& rules) {
  const bool is_ring = kind == FeatureKind::Area;
  for (auto& part : parts)
    for (PointsWorld& line : part) {
      PointsWorld line_crs = line;
      if (!transform(line, rules)) return false;
      if (kind == FeatureKind::Point) continue;
      split_long_edges(line_crs, line, is_ring, rules);
      if (line.empty()) return false;
    }
  unwrap(parts);
  return true;
}

void Reader::take(const OGRFeature& feature, const LayerRules& rules) {
  ++num_read_;
  const OGRGeometry* geometry = feature.GetGeometryRef();
  if (geometry == nullptr || geometry->IsEmpty() != FALSE) {
    ++num_without_geometry_;
    return;
  }
  const FeatureTags tags = tags_of(feature, rules);
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

/// From longitude and latitude to the world's x and y.
void Reader::put_on_ground() {
  std::vector<char> is_near(data_.features.size(), 0);
  core::parallel_for_blocks(
      static_cast<std::int64_t>(data_.features.size()), 16,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t i = begin; i < end; ++i) {
          VectorFeature& feature = data_.features[static_cast<std::size_t>(i)];
          for (auto& part : feature.parts_world)
            for (PointsWorld& line : part)
              for (Vector2d& at : line) {
                geo::Geodetic place{.lat_deg = at.y(), .lon_deg = at.x(), .height_m = 0.0};
                place.height_m = frame_.ground_height_m(place);
                at = frame_.frame.world_from_geodetic(place).head<2>();
              }
          is_near[static_cast<std::size_t>(i)] =
              box_of(feature.parts_world).overlaps(square_m_) ? 1 : 0;
        }
      });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < data_.features.size(); ++i) {
    if (is_near[i] == 0) {
      ++num_outside_;
      continue;
    }
    if (kept != i) data_.features[kept] = std::move(data_.features[i]);
    ++kept;
  }
  data_.features.resize(kept);
}

VectorData Reader::read() {
  const GdalDatasetPtr dataset = open_gdal_vectors(file_, errors_);
  const std::string_view format = dataset->GetDriver()->GetDescription();
  const bool is_osm = format == "OSM";
  if (format == "GeoJSON") check_geojson_crs(file_);
  for (const std::string& name : options_.layers)
    if (dataset->GetLayerByName(name.c_str()) == nullptr) {
      std::string known;
      for (int i = 0; i < dataset->GetLayerCount(); ++i)
        known += (i == 0 ? "" : ", ") + std::string(dataset->GetLayer(i)->GetName());
      fail(ErrorKind::Input, "{}: has no layer \"{}\"; its layers are {}", file_.written, name,
           known);
    }
  const auto is_read = [&](OGRLayer& layer) {
    const std::string name = layer.GetName();
    if (is_osm && options_.layers.empty())
      return name == "points"            ? options_.points
             : name == "multipolygons"   ? options_.areas
             : name == "other_relations" ? false
                                         : options_.lines;
    return options_.layers.empty() ||
           std::find(options_.layers.begin(), options_.layers.end(), name) != options_.layers.end();
  };
  if (is_osm) {  // the others are then not put together at all
    std::string names;
    for (int i = 0; i < dataset->GetLayerCount(); ++i)
      if (is_read(*dataset->GetLayer(i)))
        names += (names.empty() ? "" : ",") + std::string(dataset->GetLayer(i)->GetName());
    dataset->ExecuteSQL(("SET interest_layers = " + names).c_str(), nullptr, nullptr);
    while (true) {
      OGRLayer* layer = nullptr;
      const std::unique_ptr<OGRFeature> feature(
          dataset->GetNextFeature(&layer, nullptr, nullptr, nullptr));
      if (!feature) break;
      if (is_read(*layer)) take(*feature, rules_of(*dataset, layer));
    }
  } else {
    for (int i = 0; i < dataset->GetLayerCount(); ++i) {
      OGRLayer* layer = dataset->GetLayer(i);
      if (!is_read(*layer) || layer->GetGeomType() == wkbNone) continue;
      const LayerRules& rules = rules_of(*dataset, layer);
      layer->ResetReading();
      while (const auto feature = std::unique_ptr<OGRFeature>(layer->GetNextFeature()))
        take(*feature, rules);
    }
  }
  if (errors_.has_failure())
    fail(ErrorKind::Input, "{}: its features cannot be read; is it damaged or truncated? ({})",
         file_.written, errors_.text());
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
  return std::move(data_);
}

}  // namespace

std::vector<std::pair<std::string, std::int64_t>> VectorData::left_out() const {
  std::vector<std::pair<std::string, std::int64_t>> left_out;
  for (const auto& [what, num] : counts)
    if (num > 0 && what != kReadCount && what != kOsmCount) left_out.emplace_back(what, num);
  return left_out;
}

VectorData read_vectors(const core::Path& file, const VectorOptions& options,
                        const VectorFrame& frame) {
  return Reader(file, options, frame).read();
}

}  // namespace terracast::tiler
