#include "job/trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "capture/frame_reader.h"
#include "capture/labels.h"
#include "core/error.h"
#include "core/instance_id.h"
#include "core/random.h"
#include "core/registry.h"
#include "geo/camera_model.h"
#include "job/cover_origin.h"
#include "job/raster_cells.h"
#include "job/stages.h"
#include "labels/shown_objects.h"
#include "scene/ground/ground.h"
#include "scene/ground/marking.h"
#include "scene/scene.h"
#include "tiler/osm_element.h"
#include "tiler/raster_cell_number.h"
#include "world/lod.h"
#include "world/terrain_triangle.h"

namespace terracast::job {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;
using core::SemanticClass;

/// Rays down to a place start here, above all ground, and end here, below it.
constexpr double kStartHeight_m = 20000.0;
constexpr double kLength_m = 60000.0;

constexpr std::string_view kCoverNames[world::kNumCovers] = {
    "land",     "sea",  "outside", "forest",  "shrubs", "grass", "crops",
    "built-up", "bare", "snow",    "wetland", "lake",   "river", "seabed"};

/// None of a store that older versions made.
using Rasters = std::optional<world::WorldRasters>;

/// Where a ray met the world.
struct Met {
  world::SurfaceHit hit;
  world::SurfaceSample surface;
  world::TileId tile;
  Eigen::Vector3d point_world;
};

/// Casts a ray as its viewer sees the world: a viewer in water sees the bed, or the surface from below.
std::optional<Met> cast(const world::TileStore& store, std::vector<world::CutTile> cut,
                        const world::WorldRay& ray) {
  const scene::Scene scene(
      store, std::move(cut), std::span<const scene::MovingThing>(),
      {.tracing = {}, .conditions = {}, .utc_start = {}, .viewer_world = ray.origin_world});
  Met met;
  scene.at(0.0).trace({&ray, 1}, {}, {&met.hit, 1}, world::Coherence::Incoherent,
                      {&met.surface, 1});
  if (met.hit.is_sky()) return std::nullopt;
  met.tile = scene.viewed().cut()[met.hit.tile_index].id;
  met.point_world = ray.origin_world + met.hit.t * ray.direction_world;
  return met;
}

/// As rendered pixels have it.
SemanticClass class_of_ground(const world::TileStore& store, const Met& met) {
  const auto seed = static_cast<std::uint32_t>(core::mix_bits(store.manifest().seed));
  const scene::Ground ground(scene::climate_of(store, seed));
  scene::GroundPlaces places;
  for (int lane = 0; lane < scene::kLanes; ++lane)
    places.set(lane, met.point_world, met.hit.normal_world(), met.surface, 0.0);
  scene::GroundPacket packet;
  ground.set(places, packet);
  scene::Lanes<std::uint8_t> classes;
  ground.classify(packet, classes);
  return static_cast<SemanticClass>(classes[0]);
}

SemanticClass class_of(const world::TileStore& store, const Met& met) {
  if (!met.hit.is_ground()) return met.surface.finish.semantic_class;
  if (met.surface.paint.is_painted) return scene::class_of(met.surface.paint);
  return class_of_ground(store, met);
}

Json json_of_class(SemanticClass semantic_class) {
  const auto id = static_cast<std::size_t>(semantic_class);
  return Json::object()
      .set("name", core::semantic_class_names()[id])
      .set("id", static_cast<int>(id));
}

Json json_of_place(const geo::WorldFrame& frame, const Eigen::Vector3d& point_world) {
  const geo::Geodetic place = frame.geodetic_from_world(point_world);
  const auto undulation_m = egm96_undulation_m(place.lat_deg, place.lon_deg);
  return Json::object()
      .set("lat_deg", place.lat_deg)
      .set("lon_deg", place.lon_deg)
      .set("height_m", place.height_m)
      .set("altitude_msl_m", undulation_m ? Json(place.height_m - *undulation_m) : Json())
      .set("point_world", Json::array_of({point_world.x(), point_world.y(), point_world.z()}));
}

Json json_of_layer(const world::TileStore& store, std::size_t row) {
  const auto& layers = store.manifest().layers;
  if (row >= layers.size())
    fail(ErrorKind::Input, "{}: a tile names layer {}, and the manifest lists {}; tile it again",
         store.folder().string(), row, layers.size());
  const world::LayerInfo& layer = layers[row];
  return Json::object()
      .set("row", static_cast<int>(row))
      .set("name", layer.name)
      .set("kind", layer.kind)
      .set("source", layer.source)
      .set("licence", layer.licence)
      .set("accuracy", layer.accuracy);
}

/// Column and row of the cell that holds a place; null beyond the raster.
Json json_of_cell(const world::RasterInfo& raster, const geo::Geodetic& place) {
  const auto cell = cell_from_geodetic(raster, place.lat_deg, place.lon_deg);
  if (!cell) return {};
  return Json::object().set("column", cell->x()).set("row", cell->y());
}

/// Of one of several rasters; none is pushed where the place lies beyond it.
void push_cell(const world::RasterInfo& raster, const geo::Geodetic& place, Json& cells) {
  const auto cell = cell_from_geodetic(raster, place.lat_deg, place.lon_deg);
  if (cell)
    cells.push(std::move(
        Json::object().set("source", raster.name).set("column", cell->x()).set("row", cell->y())));
}

/// The element of OpenStreetMap that a feature of a layer is, where it is one.
std::optional<std::string> element_of(const world::TileStore& store, std::size_t layer,
                                      std::uint64_t feature) {
  for (const auto& [name, count] : store.manifest().layers.at(layer).counts)
    if (name == tiler::kOsmCount && count > 0) return tiler::osm_element(feature);
  return std::nullopt;
}

/// Whether the features of a layer are outlines made of cells of its raster.
bool is_of_cells(const world::TileStore& store, std::size_t layer) {
  const auto& counts = store.manifest().layers.at(layer).counts;
  return std::any_of(counts.begin(), counts.end(),
                     [](const auto& count) { return count.first == tiler::kCellCount; });
}

void add_feature(const world::TileStore& store, std::size_t layer, std::uint64_t feature,
                 Json& json) {
  json.set("layer", json_of_layer(store, layer)).set("feature", feature);
  if (const auto element = element_of(store, layer, feature)) json.set("element", *element);
  if (is_of_cells(store, layer)) {
    const Eigen::Vector2i cell = tiler::cell_of_number(feature);
    json.set("cell", Json::object().set("column", cell.x()).set("row", cell.y()));
  }
}

Json json_of_elevation(const world::TileStore& store, std::size_t row, const Rasters& rasters,
                       const geo::Geodetic& place) {
  const auto& sources = store.manifest().sources;
  if (row >= sources.size())
    fail(ErrorKind::Input, "{}: a tile names source {}, and the manifest lists {}; tile it again",
         store.folder().string(), row, sources.size());
  const world::SourceInfo& source = sources[row];
  Json json = Json::object();
  json.set("row", static_cast<int>(row))
      .set("source", source.name)
      .set("kind", source.kind)
      .set("horizontal_crs", source.horizontal_crs)
      .set("vertical_datum", source.vertical_datum)
      .set("spacing_m", source.spacing_m > 0.0 ? Json(source.spacing_m) : Json())
      .set("licence", source.licence)
      .set("accuracy", source.accuracy);
  if (source.kind == "raster")
    json.set("cell", rasters && rasters->sources[row] ? json_of_cell(*rasters->sources[row], place)
                                                      : Json());
  return json;
}

/// The sample of its tile whose cover and source the ground shows where it was met.
Eigen::Vector3d sample_shown_world(const Met& met) {
  const double spacing_m = met.tile.spacing_m();
  const Eigen::Vector2d corner =
      met.tile.corner_world() + spacing_m * Eigen::Vector2d(met.hit.cell_x, met.hit.cell_y);
  const Eigen::Vector2d within =
      ((met.point_world.head<2>() - corner) / spacing_m).cwiseMax(0.0).cwiseMin(1.0);
  const world::TrianglePlace place = world::place_on_triangle(
      met.hit.cell_x, met.hit.cell_y, met.hit.upper != 0, within.x(), within.y());
  const auto& [i, j] = place.nearest();
  const Eigen::Vector2d sample = met.tile.corner_world() + spacing_m * Eigen::Vector2d(i, j);
  return {sample.x(), sample.y(), met.point_world.z()};
}

Json json_of_cover(const world::TileStore& store, const Met& met, Rasters& rasters,
                   const geo::Geodetic& place) {
  const world::Cover cover = met.surface.cover;
  Json json = Json::object().set("name", kCoverNames[static_cast<std::size_t>(cover)]);
  const geo::Geodetic sample =
      geo::WorldFrame(store.manifest().origin).geodetic_from_world(sample_shown_world(met));
  Json layers = Json::array();
  for (const CoverOrigin& origin : origins_of_cover(store, rasters, cover, sample)) {
    Json layer = json_of_layer(store, origin.layer);
    if (rasters && !rasters->land_cover[origin.layer].empty()) {
      const auto& files = rasters->land_cover[origin.layer];
      Json cells = Json::array();
      for (std::size_t i = 0; i < files.size(); ++i)
        if (!origin.raster || *origin.raster == i) push_cell(files[i].raster, place, cells);
      layer.set("cells", std::move(cells));
    }
    layers.push(std::move(layer));
  }
  if (layers.size() > 0) json.set("layers", std::move(layers));
  return json;
}

/// The finest picture that knows a place; null where there is none.
Json json_of_imagery(const world::TileStore& store, const Eigen::Vector2d& place_world,
                     const Rasters& rasters, const geo::Geodetic& place) {
  const auto& all = store.manifest().imagery;
  for (std::size_t row = 0; row < all.size(); ++row) {
    const world::ImageryInfo& imagery = all[row];
    world::ImageryTileId id{.level = imagery.finest_level, .x = 0, .y = 0};
    const Eigen::Array2d pixel = (place_world.array() / id.pixel_m()).floor();
    const Eigen::Array2d tile = (pixel / world::kImageryTile_px).floor();
    id.x = static_cast<std::int32_t>(tile.x());
    id.y = static_cast<std::int32_t>(tile.y());
    const auto found = std::lower_bound(imagery.tiles.begin(), imagery.tiles.end(), id,
                                        [](const world::ImageryTileInfo& one,
                                           const world::ImageryTileId& at) { return one.id < at; });
    if (found == imagery.tiles.end() || found->id != id) continue;
    const core::Image8 image =
        store.load_imagery(row, static_cast<std::size_t>(found - imagery.tiles.begin()));
    const Eigen::Array2d within = pixel - world::kImageryTile_px * tile;
    const int x = static_cast<int>(within.x());
    const int y = world::kImageryTile_px - 1 - static_cast<int>(within.y());
    if (image.channels() == 4 && image(x, y, 3) == 0) continue;
    Json sources = Json::array();
    Json cells = Json::array();
    for (const int source : found->sources) {
      const auto file = static_cast<std::size_t>(source);
      sources.push(imagery.sources[file]);
      if (rasters) push_cell(rasters->imagery[row][file], place, cells);
    }
    return Json::object()
        .set("layer", json_of_layer(store, static_cast<std::size_t>(imagery.layer)))
        .set("sources", std::move(sources))
        .set("cells", rasters ? std::move(cells) : Json())
        .set("pixel_m", id.pixel_m())
        .set("color_srgb", Json::array_of({static_cast<double>(image(x, y, 0)),
                                           static_cast<double>(image(x, y, 1)),
                                           static_cast<double>(image(x, y, 2))}));
  }
  return {};
}

/// Whether pictures are drawn on a cover.
bool shows_imagery(world::Cover cover) {
  return !world::is_water(cover) && cover != world::Cover::Seabed && cover != world::Cover::Outside;
}

/// What follows the place: all of it from the world.
void add_source(const world::TileStore& store, const Met& met, Json& json) {
  const world::PaintSample& paint = met.surface.paint;
  if (!met.hit.is_ground()) {
    add_feature(store, met.surface.provenance.layer, met.surface.provenance.feature, json);
  } else {
    Rasters rasters = world::read_rasters(store);
    const geo::Geodetic place =
        geo::WorldFrame(store.manifest().origin).geodetic_from_world(met.point_world);
    if (paint.is_painted) add_feature(store, paint.coating.layer, paint.coating.feature, json);
    json.set("elevation", json_of_elevation(store, met.surface.source, rasters, place));
    if (!paint.is_painted) json.set("cover", json_of_cover(store, met, rasters, place));
    if (!paint.is_painted && shows_imagery(met.surface.cover))
      if (Json imagery = json_of_imagery(store, met.point_world.head<2>(), rasters, place);
          !imagery.is_null())
        json.set("imagery", std::move(imagery));
  }
  json.set("tile",
           Json::object().set("name", met.tile.name()).set("spacing_m", met.tile.spacing_m()));
}

const char* surface_name(const Met& met) {
  if (!met.hit.is_ground()) return "object";
  return met.surface.paint.is_painted ? "paint" : "ground";
}

Json trace_down(const world::TileStore& store, const world::WorldRay& ray) {
  // The far side of the Earth lies below the world.
  const bool is_above = ray.origin_world.z() > 0.0;
  const std::optional<Met> met =
      is_above ? cast(store, world::finest_cut(store), ray) : std::nullopt;
  const geo::WorldFrame frame(store.manifest().origin);
  if (!met) {
    const geo::Geodetic above = frame.geodetic_from_world(ray.origin_world);
    fail(ErrorKind::Input,
         "latitude {:.6f}, longitude {:.6f} lies outside the tiles of {}, which reach {:.0f} km "
         "from latitude {:.6f}, longitude {:.6f}",
         above.lat_deg, above.lon_deg, store.folder().string(),
         store.manifest().apron_radius_m / 1000.0, store.manifest().origin.lat_deg,
         store.manifest().origin.lon_deg);
  }
  Json json = Json::object();
  json.set("place", json_of_place(frame, met->point_world))
      .set("surface", surface_name(*met))
      .set("class", json_of_class(class_of(store, *met)))
      .set("instance_id", met->hit.is_ground()
                              ? 0
                              : static_cast<std::int64_t>(met->surface.provenance.instance_id));
  add_source(store, *met, json);
  return json;
}

capture::SequenceReader open_sequence(const CapturedPixel& pixel) {
  const auto folders = capture::list_sequences(pixel.capture);
  std::vector<std::string> names;
  for (const auto& folder : folders) {
    names.push_back(folder.filename().string());
    if (pixel.sequence == names.back() || (pixel.sequence.empty() && folders.size() == 1))
      return capture::SequenceReader::open(folder);
  }
  if (pixel.sequence.empty())
    fail(ErrorKind::Usage, "{}: holds {} sequences ({}); name one with --sequence",
         pixel.capture.string(), names.size(), fmt::join(names, ", "));
  fail(ErrorKind::Usage, "{}: {}", pixel.capture.string(),
       core::unknown_name_message("sequence", pixel.sequence, names));
}

int find_camera(const capture::SequenceInfo& info, const std::string& camera) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < info.cameras.size(); ++i) {
    names.push_back(info.cameras[i].rig + "/" + info.cameras[i].name);
    if (camera == names.back() || (camera.empty() && info.cameras.size() == 1))
      return static_cast<int>(i);
  }
  if (camera.empty())
    fail(ErrorKind::Usage, "{}: has {} cameras ({}); name one with --camera", info.name,
         names.size(), fmt::join(names, ", "));
  fail(ErrorKind::Usage, "{}: {}", info.name, core::unknown_name_message("camera", camera, names));
}

/// Of a layer or a source of heights; what the source does not state is said, too.
std::string terms_lines(const Json& source) {
  std::string text;
  for (const char* member : {"licence", "accuracy"}) {
    const std::string& stated = source.at(member).string();
    text += fmt::format("{:12}{}: {}\n", "", member, stated.empty() ? "not stated" : stated);
  }
  return text;
}

/// Of a raster's member `cell`, or of the members `cells` of several.
std::string cell_lines(const Json& raster) {
  const auto line = [](const Json& cell, const std::string& source) {
    return fmt::format("{:12}cell: column {}, row {}{} (counted from 0)\n", "",
                       cell.at("column").integer(), cell.at("row").integer(), source);
  };
  if (raster.has("cell") && raster.at("cell").is_null())
    return fmt::format(
        "{:12}cell: not known: beyond the raster's border, or the world is of an "
        "older version; tile it again\n",
        "");
  if (raster.has("cell")) return line(raster.at("cell"), "");
  std::string text;
  if (raster.has("cells") && raster.at("cells").is_array())
    for (std::size_t i = 0; i < raster.at("cells").size(); ++i)
      text +=
          line(raster.at("cells").at(i), " of " + raster.at("cells").at(i).at("source").string());
  return text;
}

std::string layer_lines(const Json& layer, const std::string& name) {
  const std::string text = fmt::format("{:12}{} ({}), source {}\n", name, layer.at("name").string(),
                                       layer.at("kind").string(), layer.at("source").string());
  return text + cell_lines(layer) + terms_lines(layer);
}

std::string feature_text(const Json& trace) {
  const std::string number = trace.at("feature").text();  // numbers have up to 64 bits
  if (trace.has("cell"))
    return fmt::format("{}: the outline that begins at column {}, row {} of its raster", number,
                       trace.at("cell").at("column").integer(),
                       trace.at("cell").at("row").integer());
  if (!trace.has("element")) return number;
  return fmt::format("{} of OpenStreetMap (number {})", trace.at("element").string(), number);
}

/// The body that a pixel shows of what moves.
Json json_of_body(const capture::SequenceInfo& info, std::uint32_t instance_id,
                  std::uint32_t primitive_id) {
  const capture::MovingBody* shown = capture::body_shown(info.moving, instance_id, primitive_id);
  if (shown == nullptr)
    fail(ErrorKind::Input, "{}: nothing that moves has the instance {}", info.name, instance_id);
  return Json::object().set("name", shown->name).set("thing", shown->thing);
}

}  // namespace

Json trace_place(const world::TileStore& store, double lat_deg, double lon_deg) {
  const geo::WorldFrame frame(store.manifest().origin);
  const Eigen::Vector3d start_world = frame.world_from_geodetic(
      {.lat_deg = lat_deg, .lon_deg = lon_deg, .height_m = kStartHeight_m});
  return trace_down(store, {.origin_world = start_world,
                            .direction_world = -frame.up_world(start_world),
                            .t_max = kLength_m});
}

Json trace_world_place(const world::TileStore& store, const Eigen::Vector2d& place_world) {
  return trace_down(store, {.origin_world = {place_world.x(), place_world.y(), kStartHeight_m},
                            .direction_world = -Eigen::Vector3d::UnitZ(),
                            .t_max = kLength_m});
}

Json trace_pixel(const world::TileStore& store, const CapturedPixel& pixel) {
  const capture::SequenceReader sequence = open_sequence(pixel);
  const capture::SequenceInfo& info = sequence.info();
  const int camera_index = find_camera(info, pixel.camera);
  const geo::CameraIntrinsics& intrinsics =
      info.cameras[static_cast<std::size_t>(camera_index)].intrinsics;
  if (pixel.frame < 0 || pixel.frame >= info.num_frames)
    fail(ErrorKind::Usage, "{}: has frames 0 to {}, and {} is asked for", info.name,
         info.num_frames - 1, pixel.frame);
  if (pixel.x < 0 || pixel.y < 0 || pixel.x >= intrinsics.width_px ||
      pixel.y >= intrinsics.height_px)
    fail(ErrorKind::Usage, "{}: its images have {} x {} pixels, and ({}, {}) is asked for",
         info.name, intrinsics.width_px, intrinsics.height_px, pixel.x, pixel.y);

  const capture::CameraFrame facts =
      sequence.read_camera(pixel.frame, camera_index, capture::SequenceReader::kFacts);
  const double range_m = facts.range_m(pixel.x, pixel.y);
  const auto semantic_class = static_cast<SemanticClass>(facts.semantic_id(pixel.x, pixel.y));
  const std::uint32_t instance_id = facts.instance_id(pixel.x, pixel.y);
  Json json = Json::object();
  if (!std::isfinite(range_m))
    return json.set("surface", std::isnan(range_m) ? "nothing" : "sky")
        .set("class", json_of_class(semantic_class))
        .set("instance_id", 0);

  const auto model = geo::make_camera(intrinsics);
  const capture::CameraView view = sequence.view(*model, pixel.frame, camera_index);
  const Eigen::Vector2d center = capture::pixel_center(pixel.x, pixel.y);
  json.set("place",
           json_of_place(geo::WorldFrame(info.origin), capture::point_world(view, center, range_m)))
      .set("range_m", range_m);
  if (core::is_moving_id(instance_id))
    return json.set("surface", "moving")
        .set("class", json_of_class(semantic_class))
        .set("instance_id", static_cast<std::int64_t>(instance_id))
        .set("moving", json_of_body(info, instance_id, facts.primitive_id(pixel.x, pixel.y)));
  const geo::Rigid3d world_from_camera = view.pose_of_line(center);
  const Eigen::Vector3d direction_world =
      world_from_camera.rotation * model->ray_from_pixel(center).normalized();
  const std::optional<Met> met =
      cast(store, labels::cut_of(store, info),
           {.origin_world = world_from_camera * model->origin_from_pixel(center),
            .direction_world = direction_world});
  // The capture holds the range as a float.
  constexpr double kFloatEpsilon = std::numeric_limits<float>::epsilon();
  const double tolerance_m = 1e-3 + 2.0 * kFloatEpsilon * range_m;
  const std::uint32_t met_instance =
      met && !met->hit.is_ground() ? met->surface.provenance.instance_id : 0;
  if (!met || std::abs(met->hit.t - range_m) > tolerance_m || met_instance != instance_id)
    fail(ErrorKind::Input,
         "{}: frame {}, pixel ({}, {}) has range {:.3f} m and instance {}, and its ray meets {} in "
         "{}; was the capture rendered from that world?",
         info.name, pixel.frame, pixel.x, pixel.y, range_m, instance_id,
         met ? fmt::format("instance {} at {:.3f} m", met_instance, met->hit.t) : "nothing",
         store.folder().string());
  json.set("surface", surface_name(*met))
      .set("class", json_of_class(semantic_class))
      .set("instance_id", static_cast<std::int64_t>(instance_id));
  add_source(store, *met, json);
  return json;
}

std::string trace_text(const Json& trace) {
  std::string text;
  const auto line = [&](const char* name, const std::string& value) {
    text += fmt::format("{:12}{}\n", name, value);
  };
  if (trace.has("place")) {
    const Json& place = trace.at("place");
    line("place", fmt::format("latitude {:.7f}, longitude {:.7f} (WGS84)",
                              place.at("lat_deg").number(), place.at("lon_deg").number()));
    line("height", fmt::format("{:.2f} m above the ellipsoid{}", place.at("height_m").number(),
                               place.at("altitude_msl_m").is_null()
                                   ? ""
                                   : fmt::format(", {:.2f} m above the geoid (EGM96)",
                                                 place.at("altitude_msl_m").number())));
    const std::vector<double> point = place.at("point_world").numbers();
    line("world", fmt::format("{:.3f}, {:.3f}, {:.3f}", point[0], point[1], point[2]));
  }
  if (trace.has("range_m")) line("range", fmt::format("{:.3f} m", trace.at("range_m").number()));
  line("surface", trace.at("surface").string());
  line("class", fmt::format("{} ({})", trace.at("class").at("name").string(),
                            trace.at("class").at("id").integer()));
  if (trace.at("instance_id").integer() != 0)
    line("instance", fmt::format("{}", trace.at("instance_id").integer()));
  if (trace.has("moving"))
    line("moving", fmt::format("{} ({})", trace.at("moving").at("name").string(),
                               trace.at("moving").at("thing").string()));
  if (trace.has("layer")) {
    text += layer_lines(trace.at("layer"), "layer");
    line("feature", feature_text(trace));
  }
  if (trace.has("elevation")) {
    const Json& elevation = trace.at("elevation");
    const std::string& kind = elevation.at("kind").string();
    const std::string& datum = elevation.at("vertical_datum").string();
    const Json& spacing_m = elevation.at("spacing_m");
    line("elevation",
         fmt::format(
             "{} ({}), above {}{}", elevation.at("source").string(), kind,
             datum.empty() ? "the ellipsoid" : datum,
             spacing_m.is_null() ? "" : fmt::format(", every {:.3g} m", spacing_m.number())));
    if (kind == "sea") line("", "its floor is made up: no source knows it");
    text += cell_lines(elevation) + terms_lines(elevation);
  }
  if (trace.has("cover")) {
    const Json& cover = trace.at("cover");
    line("cover", cover.at("name").string());
    if (cover.has("layers"))
      for (std::size_t i = 0; i < cover.at("layers").size(); ++i)
        text += layer_lines(cover.at("layers").at(i), i == 0 ? "  from" : "  or");
  }
  if (trace.has("imagery")) {
    const Json& imagery = trace.at("imagery");
    std::vector<std::string> sources;
    for (std::size_t i = 0; i < imagery.at("sources").size(); ++i)
      sources.push_back(imagery.at("sources").at(i).string());
    line("imagery", fmt::format("{}, pixels of {:g} m, sRGB {:g}", fmt::join(sources, ", "),
                                imagery.at("pixel_m").number(),
                                fmt::join(imagery.at("color_srgb").numbers(), " ")));
    text += cell_lines(imagery) + layer_lines(imagery.at("layer"), "  layer");
  }
  if (trace.has("tile"))
    line("tile", fmt::format("{}, samples every {:g} m", trace.at("tile").at("name").string(),
                             trace.at("tile").at("spacing_m").number()));
  return text;
}

}  // namespace terracast::job
