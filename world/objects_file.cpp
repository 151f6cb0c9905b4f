#include "world/objects_file.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "world/byte_stream.h"
#include "world/sealed_file.h"

namespace terracast::world {
namespace {

constexpr SealedKind kSealed = {.magic = {'T', 'C', 'P', 'R', 'O', 'T'},
                                .version = kPrototypeFileVersion,
                                .most_bytes = std::size_t{1} << 30,
                                .what = "a prototype"};
constexpr std::size_t kMaxName = 200;

template <class Integers>
void put_integers(ByteWriter& out, const Integers& integers) {
  for (const auto value : integers) out.put(value);
}

Eigen::Vector2i get_pair(ByteReader& in) {
  const auto x = in.get<std::int32_t>();
  return {x, in.get<std::int32_t>()};
}

Eigen::Vector3i get_triple(ByteReader& in) {
  const auto x = in.get<std::int32_t>();
  const auto y = in.get<std::int32_t>();
  return {x, y, in.get<std::int32_t>()};
}

double get_finite(ByteReader& in) {
  const auto value = in.get<double>();
  if (!std::isfinite(value)) in.refuse("a number is none");
  return value;
}

/// An enumerator, of which there are so many.
template <class Enum>
Enum get_code(ByteReader& in, std::size_t count) {
  const auto code = in.get<std::uint8_t>();
  if (code >= count) in.refuse("a code has no meaning");
  return static_cast<Enum>(code);
}

void put_finish(ByteWriter& out, const Finish& finish) {
  out.put(static_cast<std::uint8_t>(finish.material));
  out.put(static_cast<std::uint8_t>(finish.semantic_class));
  put_integers(out, finish.color_srgb);
  out.put(finish.pattern);
}

Finish get_finish(ByteReader& in) {
  Finish finish;
  finish.material = get_code<Material>(in, kNumMaterials);
  finish.semantic_class = get_code<core::SemanticClass>(in, core::kNumSemanticClasses);
  for (std::uint8_t& value : finish.color_srgb) value = in.get<std::uint8_t>();
  finish.pattern = in.get<std::uint16_t>();
  return finish;
}

/// Field by field, so that like numbers stand together.
void put_shape(ByteWriter& out, const Shape& shape) {
  TERRACAST_CHECK(shape.uv.empty() || shape.uv.size() == shape.vertices_steps.size(),
                  "{} uv for {} vertices", shape.uv.size(), shape.vertices_steps.size());
  out.put_count(shape.vertices_steps.size());
  for (int axis = 0; axis < 3; ++axis)
    for (const Eigen::Vector3i& vertex : shape.vertices_steps) out.put(vertex[axis]);
  out.put(static_cast<std::uint8_t>(shape.uv.empty() ? 0 : 1));
  for (int axis = 0; axis < 2; ++axis)
    for (const Eigen::Vector2f& uv : shape.uv) out.put(uv[axis]);
  out.put_count(shape.triangles.size());
  for (const Shape::Triangle& triangle : shape.triangles) put_integers(out, triangle.corners);
  for (const Shape::Triangle& triangle : shape.triangles) out.put(triangle.finish);
  out.put(static_cast<std::uint16_t>(shape.finishes.size()));
  for (const Finish& finish : shape.finishes) put_finish(out, finish);
}

Shape get_shape(ByteReader& in) {
  Shape shape;
  shape.vertices_steps.resize(in.get_count(3 * sizeof(std::int32_t)));
  for (int axis = 0; axis < 3; ++axis)
    for (Eigen::Vector3i& vertex : shape.vertices_steps) vertex[axis] = in.get<std::int32_t>();
  if (in.get<std::uint8_t>() != 0) shape.uv.resize(shape.vertices_steps.size());
  for (int axis = 0; axis < 2; ++axis)
    for (Eigen::Vector2f& uv : shape.uv) {
      uv[axis] = in.get<float>();
      if (!std::isfinite(uv[axis])) in.refuse("a number is none");
    }
  shape.triangles.resize(in.get_count(3 * sizeof(std::uint32_t) + 1));
  for (Shape::Triangle& triangle : shape.triangles)
    for (std::uint32_t& corner : triangle.corners) {
      corner = in.get<std::uint32_t>();
      if (corner >= shape.vertices_steps.size()) in.refuse("a triangle has no such corner");
    }
  for (Shape::Triangle& triangle : shape.triangles) triangle.finish = in.get<std::uint8_t>();
  shape.finishes.resize(in.get<std::uint16_t>());
  for (Finish& finish : shape.finishes) finish = get_finish(in);
  for (const Shape::Triangle& triangle : shape.triangles)
    if (triangle.finish >= shape.finishes.size()) in.refuse("a triangle has no such finish");
  return shape;
}

void put_levels(ByteWriter& out, const ShapeLevels& levels) {
  out.put(static_cast<std::uint8_t>(levels.size()));
  for (const ShapeLevel& level : levels) {
    out.put(level.coarsest_level);
    put_shape(out, level.shape);
  }
}

ShapeLevels get_levels(ByteReader& in) {
  ShapeLevels levels(in.get<std::uint8_t>());
  for (std::size_t i = 0; i < levels.size(); ++i) {
    levels[i].coarsest_level = in.get<std::int8_t>();
    if (i > 0 && levels[i].coarsest_level <= levels[i - 1].coarsest_level)
      in.refuse("levels of detail are out of order");
    levels[i].shape = get_shape(in);
  }
  return levels;
}

void put_provenance(ByteWriter& out, const Provenance& provenance) {
  out.put(provenance.instance_id);
  out.put(provenance.layer);
  out.put(provenance.feature);
}

Provenance get_provenance(ByteReader& in) {
  Provenance provenance;
  provenance.instance_id = in.get<std::uint32_t>();
  provenance.layer = in.get<std::uint8_t>();
  provenance.feature = in.get<std::uint64_t>();
  if (provenance.instance_id == 0) in.refuse("an object has no id");
  return provenance;
}

void put_solid(ByteWriter& out, const Solid& solid) {
  put_provenance(out, solid.provenance);
  put_integers(out, solid.place_m);
  put_integers(out, solid.origin_steps);
  put_levels(out, solid.levels);
}

Solid get_solid(ByteReader& in) {
  Solid solid;
  solid.provenance = get_provenance(in);
  solid.place_m = get_pair(in);
  solid.origin_steps = get_triple(in);
  solid.levels = get_levels(in);
  return solid;
}

constexpr std::size_t kInstanceBytes = 4 + 1 + 8 + 2 + 12 + 2 + 2 + 1 + 1;

/// Field by field: they are many.
void put_instances(ByteWriter& out, const std::vector<Instance>& instances) {
  out.put_count(instances.size());
  for (const Instance& instance : instances) out.put(instance.provenance.instance_id);
  for (const Instance& instance : instances) out.put(instance.provenance.layer);
  for (const Instance& instance : instances) out.put(instance.provenance.feature);
  for (const Instance& instance : instances) out.put(instance.prototype);
  for (int axis = 0; axis < 3; ++axis)
    for (const Instance& instance : instances) out.put(instance.place_steps[axis]);
  for (const Instance& instance : instances) out.put(instance.heading);
  for (const Instance& instance : instances) out.put(instance.scale);
  for (const Instance& instance : instances) out.put(instance.variety);
  for (const Instance& instance : instances) out.put(instance.coarsest_level);
}

std::vector<Instance> get_instances(ByteReader& in) {
  std::vector<Instance> instances(in.get_count(kInstanceBytes));
  for (Instance& instance : instances) {
    instance.provenance.instance_id = in.get<std::uint32_t>();
    if (instance.provenance.instance_id == 0) in.refuse("an object has no id");
  }
  for (Instance& instance : instances) instance.provenance.layer = in.get<std::uint8_t>();
  for (Instance& instance : instances) instance.provenance.feature = in.get<std::uint64_t>();
  for (Instance& instance : instances) instance.prototype = in.get<std::uint16_t>();
  for (int axis = 0; axis < 3; ++axis)
    for (Instance& instance : instances) instance.place_steps[axis] = in.get<std::int32_t>();
  for (Instance& instance : instances) instance.heading = in.get<std::uint16_t>();
  for (Instance& instance : instances) {
    instance.scale = in.get<std::uint16_t>();
    if (instance.scale == 0) in.refuse("an object has no size");
  }
  for (Instance& instance : instances) instance.variety = in.get<std::uint8_t>();
  for (Instance& instance : instances) instance.coarsest_level = in.get<std::int8_t>();
  return instances;
}

void put_coating(ByteWriter& out, const Coating& coating) {
  out.put(coating.layer);
  out.put(coating.feature);
  out.put(coating.order);
  out.put(static_cast<std::uint8_t>(coating.paving));
  out.put(static_cast<std::uint8_t>(coating.semantic_class));
}

Coating get_coating(ByteReader& in) {
  Coating coating;
  coating.layer = in.get<std::uint8_t>();
  coating.feature = in.get<std::uint64_t>();
  coating.order = in.get<std::int16_t>();
  coating.paving = get_code<Paving>(in, kNumPavings);
  coating.semantic_class = get_code<core::SemanticClass>(in, core::kNumSemanticClasses);
  return coating;
}

void put_points(ByteWriter& out, const std::vector<Eigen::Vector2i>& points) {
  out.put_count(points.size());
  for (int axis = 0; axis < 2; ++axis)
    for (const Eigen::Vector2i& point : points) out.put(point[axis]);
}

std::vector<Eigen::Vector2i> get_points(ByteReader& in, std::size_t least) {
  std::vector<Eigen::Vector2i> points(in.get_count(2 * sizeof(std::int32_t)));
  for (int axis = 0; axis < 2; ++axis)
    for (Eigen::Vector2i& point : points) point[axis] = in.get<std::int32_t>();
  if (points.size() < least) in.refuse("a line has too few points");
  return points;
}

constexpr std::size_t kStripBytes = 13 + 2 + 4 + 4 * 8 + 4;
constexpr std::size_t kAreaBytes = 13 + 4;

void put_strip(ByteWriter& out, const Strip& strip) {
  put_coating(out, strip.coating);
  out.put(static_cast<std::uint8_t>(strip.marking));
  out.put(strip.num_lanes);
  out.put(strip.half_width_steps);
  out.put(strip.start_m);
  out.put(strip.whole_m);
  out.put(strip.unmarked_start_m);
  out.put(strip.unmarked_end_m);
  put_points(out, strip.points_steps);
}

Strip get_strip(ByteReader& in) {
  Strip strip;
  strip.coating = get_coating(in);
  strip.marking = get_code<Marking>(in, kNumMarkings);
  strip.num_lanes = in.get<std::uint8_t>();
  strip.half_width_steps = in.get<std::int32_t>();
  if (strip.half_width_steps <= 0) in.refuse("a strip has no width");
  strip.start_m = get_finite(in);
  strip.whole_m = get_finite(in);
  strip.unmarked_start_m = get_finite(in);
  strip.unmarked_end_m = get_finite(in);
  strip.points_steps = get_points(in, 2);
  if (std::adjacent_find(strip.points_steps.begin(), strip.points_steps.end()) !=
      strip.points_steps.end())
    in.refuse("a line stands still");
  return strip;
}

void put_area(ByteWriter& out, const Area& area) {
  put_coating(out, area.coating);
  out.put_count(area.rings_steps.size());
  for (const auto& ring : area.rings_steps) put_points(out, ring);
}

Area get_area(ByteReader& in) {
  Area area;
  area.coating = get_coating(in);
  area.rings_steps.resize(in.get_count(sizeof(std::uint32_t)));
  for (auto& ring : area.rings_steps) ring = get_points(in, 3);
  return area;
}

constexpr std::size_t kSolidBytes = 13 + 8 + 12 + 1;

}  // namespace

std::vector<std::uint8_t> bytes_of_objects(const TileObjects& objects) {
  ByteWriter out;
  out.put_count(objects.solids.size());
  for (const Solid& solid : objects.solids) put_solid(out, solid);
  put_instances(out, objects.instances);
  out.put_count(objects.strips.size());
  for (const Strip& strip : objects.strips) put_strip(out, strip);
  out.put_count(objects.areas.size());
  for (const Area& area : objects.areas) put_area(out, area);
  return out.bytes();
}

TileObjects objects_from_bytes(std::span<const std::uint8_t> bytes, const std::string& file) {
  ByteReader in(bytes, file);
  TileObjects objects;
  objects.solids.resize(in.get_count(kSolidBytes));
  for (Solid& solid : objects.solids) solid = get_solid(in);
  objects.instances = get_instances(in);
  objects.strips.resize(in.get_count(kStripBytes));
  for (Strip& strip : objects.strips) strip = get_strip(in);
  objects.areas.resize(in.get_count(kAreaBytes));
  for (Area& area : objects.areas) area = get_area(in);
  if (!in.is_at_end()) in.refuse("it goes on where it should end");
  return objects;
}

std::vector<std::byte> encode_prototype(const Prototype& prototype) {
  TERRACAST_CHECK(!prototype.name.empty() && prototype.name.size() <= kMaxName,
                  "a prototype called \"{}\"", prototype.name);
  ByteWriter out;
  out.put_count(prototype.name.size());
  for (const char c : prototype.name) out.put(static_cast<std::uint8_t>(c));
  put_levels(out, prototype.levels);
  return sealed(kSealed, out.bytes());
}

Prototype decode_prototype(std::span<const std::byte> bytes, const std::string& file) {
  const std::vector<std::uint8_t> raw = unsealed(kSealed, bytes, file);
  ByteReader in(raw, file);
  Prototype prototype;
  prototype.name.resize(in.get_count(1));
  for (char& c : prototype.name) c = static_cast<char>(in.get<std::uint8_t>());
  prototype.levels = get_levels(in);
  if (!in.is_at_end()) in.refuse("it goes on where it should end");
  return prototype;
}

}  // namespace terracast::world
