#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tiler/crs_operation.h"
#include "tiler/gdal_support.h"
#include "tiler/osm_census.h"
#include "tiler/vector_parts.h"
#include "tiler/vector_source.h"

class OGRFeature;
class OGRGeometry;
class OGRLayer;

namespace terracast::tiler {

/// Reads one file of features, for read_vectors().
class VectorReader {
 public:
  /// Features are cut so far from the world's middle: the tangent frame folds back beyond the horizon.
  static constexpr double kFarthest_deg = 10.0;

  VectorReader(const core::Path& file, const VectorOptions& options, const VectorFrame& frame)
      : file_(file), options_(options), frame_(frame), origin_(frame.frame.origin()) {
    const double reach_m = 0.5 * frame.size_m + options.margin_m;
    square_m_.add(Eigen::Vector2d::Constant(-reach_m));
    square_m_.add(Eigen::Vector2d::Constant(reach_m));
    // The square in longitude and latitude, at the ground's heights.
    for (int i = 0; i <= 32; ++i)
      for (const Eigen::Vector2d& edge :
           {Eigen::Vector2d(-1, i / 16.0 - 1), Eigen::Vector2d(1, i / 16.0 - 1),
            Eigen::Vector2d(i / 16.0 - 1, -1), Eigen::Vector2d(i / 16.0 - 1, 1)})
        for (const double z_m : {-12000.0, 10000.0}) {
          const geo::Geodetic at = frame.frame.geodetic_from_world(
              {reach_m * edge.x(), reach_m * edge.y(), z_m - 0.5 * reach_m * reach_m / 6.4e6});
          square_deg_.add(Eigen::Vector2d(near_origin(at.lon_deg), at.lat_deg));
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
  struct Number {
    std::uint64_t value;
    bool is_osm;  ///< osm_number()
  };
  Number number_of(const OGRFeature& feature, const LayerRules& rules,
                   const FeatureTags& tags) const;
  Number unuploaded_number(const OGRFeature& feature, const std::string& text) const;
  bool was_deleted(const OGRFeature& feature, const LayerRules& rules) const;
  void take(const OGRFeature& feature, const LayerRules& rules);
  void read_osm(GDALDataset& dataset);
  void read_layers(GDALDataset& dataset);
  bool is_read(OGRLayer& layer, bool is_osm) const;
  void check_that_some_are_left() const;
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
  std::int64_t num_passed_over_ = 0;
  std::int64_t num_too_deep_ = 0;
  OsmCensus census_;  ///< of a file of OpenStreetMap
};

}  // namespace terracast::tiler
