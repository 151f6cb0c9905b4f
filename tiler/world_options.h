#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/schema.h"
#include "tiler/layer.h"

namespace terracast::tiler {

/// A decimal number that takes up the whole text (also "nan"); nothing for other text.
std::optional<double> number_from_text(const std::string& text);

/// A source of heights. Sources are used in the order of the config: where the first has no value
/// the next is asked; all are brought together before interpolation.
struct ElevationOptions {
  /// A name of the elevation registry: raster, procedural, plane, ramp, paraboloid, fractal.
  std::string kind = "raster";
  std::vector<core::Path> files;  ///< raster: any that GDAL opens; the first has priority
  /// ellipsoid, egm96, egm2008 or grid; must be stated for rasters
  std::string vertical_datum;
  core::Path datum_grid;  ///< vertical_datum = "grid": what makes the heights ellipsoidal
  /// heights, mapbox, terrarium: how samples stand for heights
  std::string encoding = "heights";
  /// declared (by the file; metres when it says nothing), m, ft, us_ft
  std::string unit = "declared";
  std::string nodata = "declared";  ///< what NoData::from_text() reads
  /// agreement, config: what counts where a file's own unit or vertical datum is another one
  std::string trust = "agreement";
  /// auto, none, below, nodata: which samples of a raster are sea
  std::string sea = "auto";
  double sea_min_km2 = 1.0;  ///< raster: a smaller area is a lake, and land
  double blend_m = 0.0;  ///< raster: an inset, which passes into what lies below over this distance
  std::string licence;
  std::string accuracy;
  /// procedural, fractal: between sea floor or valley and the highest ridge
  double relief_m = 1800.0;
  /// procedural: heights below are sea; above vertical_datum
  double sea_level_m = 0.0;
  bool has_coast = true;           ///< procedural: a part of the square lies under the sea
  std::string landform = "coast";  ///< procedural: coast, islands, plains, valleys
  std::int64_t lakes = 0;          ///< procedural: hollows dug into valleys
  double slope = 0.0;              ///< ramp
  double curvature_per_m = 0.0;    ///< paraboloid
  double height_m = 0.0;           ///< plane, ramp, paraboloid: at the origin, above vertical_datum

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("kind", kind,
              "What gives the heights: raster, procedural, plane, ramp, paraboloid or fractal.");
    visit.key("files", files,
              "Rasters in order of priority: any format of docs/tiler.md (in an archive as "
              "/vsizip/FILE.zip/MEMBER; a .zip of one file by its own name), or a folder of tiles "
              "z/x/y.png.");
    visit.key("vertical_datum", vertical_datum,
              "What the heights are above: ellipsoid, egm96, egm2008, or grid (datum_grid). Never "
              "guessed.");
    visit.key("datum_grid", datum_grid,
              "vertical_datum = \"grid\": a raster in latitude and longitude of the metres to be "
              "added to heights to make them ellipsoidal, such as a .gtx.");
    visit.key("encoding", encoding,
              "How samples stand for heights: heights (one band), or the colours of mapbox or "
              "terrarium terrain tiles.",
              core::one_of({"heights", "mapbox", "terrarium"}));
    visit.key(
        "unit", unit,
        "Unit of the heights; `declared` takes what the file says, metres when it says nothing.",
        core::one_of({"declared", "m", "ft", "us_ft"}));
    visit.key("nodata", nodata,
              "Values of samples without a height: declared (by the file), none, or numbers in "
              "quotes, such as \"-9999\" or \"declared, -32768\". NaN is one, whatever is stated.");
    visit.key(
        "trust", trust,
        "What counts where a file declares another vertical datum or unit than is stated here: "
        "agreement (it is an error, which names both) or config (what is stated here).",
        core::one_of({"agreement", "config"}));
    visit.key("sea", sea,
              "Which samples of rasters are sea: auto (large areas of exactly 0 above a geoid), "
              "below (all areas at or below 0: the floor is measured), nodata (those without a "
              "height), none.",
              core::one_of({"auto", "below", "nodata", "none"}));
    visit.key("sea_min_km2", sea_min_km2,
              "Least such area; smaller ones stay land. Lower it for a tidal river or a harbour.",
              core::between(0.0, 1e6));
    visit.key(
        "blend_m", blend_m,
        "Above 0: these rasters are an inset on a grid of their own; over this distance inside "
        "their border they pass into the sources behind them.",
        core::between(0.0, 50000.0));
    visit.key("licence", licence, "Terms under which the source may be used; kept with the data.");
    visit.key(
        "accuracy", accuracy,
        "How good the source says that its heights are, in its own words; kept with the data.");
    visit.key("relief_m", relief_m,
              "procedural, fractal: height between the lowest and the highest land.",
              core::between(0.0, 9000.0));
    visit.key("sea_level_m", sea_level_m, "procedural: land below this height is sea.",
              core::between(-500.0, 9000.0));
    visit.key(
        "has_coast", has_coast,
        "procedural: false leaves the coast out, there is no sea; land rises from sea_level_m.");
    visit.key("landform", landform,
              "procedural: coast (mountains behind a plain), islands (a sea with islands), plains "
              "(gentle land all over) or valleys (mountains all over, with broad valleys).",
              core::one_of({"coast", "islands", "plains", "valleys"}));
    visit.key("lakes", lakes, "procedural: how many hollows for lakes are dug into valleys.",
              core::between(0.0, 40.0));
    visit.key("slope", slope, "ramp: rise per metre towards the east.", core::between(-10.0, 10.0));
    visit.key("curvature_per_m", curvature_per_m,
              "paraboloid: height = curvature * distance^2 / 2.", core::between(-0.1, 0.1));
    visit.key("height_m", height_m, "plane, ramp, paraboloid: height at the origin.",
              core::between(-500.0, 9000.0));
  }
};

/// Config `[world]`.
struct WorldOptions {
  std::string name = "world";
  double origin_lat_deg = 0.0;
  double origin_lon_deg = 0.0;
  double size_m = 51200.0;  ///< side of the square, centred on the origin
  std::int64_t seed = 1;
  /// error, sea, extend, procedural: where sources cover less than the square
  std::string outside = "error";
  double outside_blend_m = 4000.0;  ///< over which measured land passes into procedural land
  double detail_roughness = 1.0;    ///< scales synthetic detail below the source's spacing; 0: none
  double aridity_index = -1.0;      ///< of all the land; below 0: not stated
  core::Path aridity_raster;        ///< of the land; empty: none
  std::vector<ElevationOptions> elevation;
  std::vector<LayerOptions> layers;  ///< `[[layer]]`

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("name", name, "Name of the world.");
    visit.key("origin_lat_deg", origin_lat_deg, "Latitude of the world's origin, WGS84.",
              core::required(core::between(-89.0, 89.0)));
    visit.key("origin_lon_deg", origin_lon_deg, "Longitude of the world's origin, WGS84.",
              core::required(core::between(-180.0, 360.0)));
    visit.key("size_m", size_m, "Side of the world's square, centred on the origin.",
              core::between(256.0, 200000.0));
    visit.key("seed", seed, "Seed of procedural terrain and synthetic detail.");
    visit.key(
        "outside", outside,
        "What lies where the sources do not reach inside the square, and beyond it: error (inside; "
        "the apron extends), sea, extend, or procedural (inside; as a last source of that kind "
        "says).",
        core::one_of({"error", "sea", "extend", "procedural"}));
    visit.key(
        "outside_blend_m", outside_blend_m,
        "outside = \"procedural\": over this distance from the measured land its heights pass "
        "into the procedural ones.",
        core::between(0.0, 50000.0));
    visit.key("detail_roughness", detail_roughness,
              "Scales the synthetic detail below the sources' spacing; 0: none.",
              core::between(0.0, 4.0));
    visit.key("aridity_index", aridity_index,
              "How dry the land is: a year's precipitation over its potential evapotranspiration. "
              "Below 0.03 hyper-arid, 0.2 arid, 0.5 semi-arid; above 0.65 humid. Below 0: not "
              "stated, and taken as humid.",
              core::between(-1.0, 20.0));
    visit.key("aridity_raster", aridity_raster,
              "A raster of aridity indices instead (one that holds 10000 times the index declares "
              "its scale).");
    visit.list("elevation", elevation, "Sources of heights, in order of priority.");
    visit.list("layer", layers,
               "What stands on the ground or covers it, each from a source or from the seed.");
  }
  /// Whether it says how dry its land is.
  bool states_aridity() const { return aridity_index >= 0.0 || !aridity_raster.empty(); }
  /// throws   Config: no source, a raster without files or datum, sources in an order that leaves
  ///          one unasked, a shape that rises too far over the square, aridity stated twice
  void validate() const;
};

}  // namespace terracast::tiler
