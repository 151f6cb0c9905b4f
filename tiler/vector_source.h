#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/schema.h"
#include "geo/geodesy.h"
#include "tiler/feature_tags.h"
#include "tiler/layer.h"

namespace terracast::tiler {

enum class FeatureKind : std::uint8_t { Point, Line, Area };

using PointsWorld = std::vector<Eigen::Vector2d>;

/// A feature on the ground: world x and y, m.
struct VectorFeature {
  /// By which its source knows it, the same in any order of the file (VectorOptions::number_field).
  std::uint64_t number = 0;
  FeatureKind kind = FeatureKind::Point;
  FeatureTags tags;
  /// Points: one line of one point for each. Lines: one line for each. Areas: the rings of each
  /// polygon, its outer one first, closed by their first point, which is not repeated; as the source
  /// has them: they may cross themselves and each other, and turn either way.
  std::vector<std::vector<PointsWorld>> parts_world;
};

/// The number of an OpenStreetMap element: its id, with its kind in bits 60 and 61.
enum class OsmKind : std::uint8_t { Node = 1, Way = 2, Relation = 3 };
constexpr std::uint64_t osm_number(OsmKind kind, std::uint64_t id) {
  return static_cast<std::uint64_t>(kind) << 60 | (id & ((std::uint64_t{1} << 60) - 1));
}

struct VectorOptions {
  std::vector<std::string> layers = {};  ///< of the file; empty: all
  bool points = true;
  bool lines = true;
  bool areas = true;
  /// Which features are wanted, by their tags; none: all.
  std::function<bool(const FeatureTags&)> wanted = {};
  /// Field of the features' numbers: whole numbers, or OpenStreetMap's as way/123. "fid": as the format
  /// numbers them. "": of OpenStreetMap files osm_number(), also when such ids stand in fields osm_id
  /// and osm_way_id; the format's number where the file keeps it (GeoPackage, SQLite, OpenFileGDB);
  /// otherwise, since it would be the row, a hash of the feature's places and tags.
  std::string number_field = {};
  double margin_m = 200.0;  ///< round the world's square: features that reach into it are read
};

/// Where the world lies.
struct VectorFrame {
  const geo::WorldFrame& frame;
  double size_m;  ///< of the world's square
  /// Ellipsoidal height of the ground, which a feature lies on: 100 m of it shift x and y by 0.4 m at
  /// 25 km from the origin. Must be safe for many threads.
  std::function<double(const geo::Geodetic& place)> ground_height_m;
};

/// The frame of a layer's world: the measured ground inside its square, the surface beyond.
VectorFrame vector_frame(const LayerInputs& inputs);

struct VectorData {
  std::vector<VectorFeature> features;  ///< by number; those of one number by kind and place
  std::string file_name;                ///< without folder
  std::string content_hash;             ///< of the file and all that belongs to it
  /// Said to the user: a ballpark transformation, …; empty: nothing.
  std::vector<std::string> warnings;
  /// What was read and left out, as LayerInfo::counts.
  std::vector<std::pair<std::string, std::int64_t>> counts;

  /// Those of `counts` that are not 0, without the numbers of features that were read.
  std::vector<std::pair<std::string, std::int64_t>> left_out() const;
};

/// Reads the features of any file of OGR's (.osm.pbf, GeoJSON, GeoPackage, Shapefile, …) that reach
/// over the world's square. Features are whole, also beyond the square, up to 10 degrees from its
/// middle, where they are cut. Edges are straight in the source's coordinates; long ones get points
/// between, 1 km apart at most near the square.
/// file     a .zip of one file, or /vsizip/FILE.zip/MEMBER, too
/// throws   Io: no such file; Input: cannot be read or is truncated, no CRS or an unknown one, no
///          such layer or field, nothing of it lies near the square (says where it lies)
/// cost     once the features in memory; 1 s for Andorra's 250 000 points
VectorData read_vectors(const core::Path& file, const VectorOptions& options,
                        const VectorFrame& frame);

}  // namespace terracast::tiler
