#include "tests/fuzz/targets.h"

#include <cpl_error.h>
#include <fmt/format.h>

#include <array>
#include <new>
#include <stdexcept>

#include "core/error.h"
#include "tiler/gdal_formats.h"

// Every reader, in alphabetical order: X(name) is `void fuzz_name(Bytes)` of one of the files *_readers.cpp, with valid
// inputs in seeds/name. A reader behind a checksum or a compression has a second line, whose inputs lie behind it.
#define TERRACAST_FUZZ_TARGETS(X) \
  X(capture_frame)                \
  X(capture_manifest)             \
  X(capture_scans)                \
  X(capture_sequence)             \
  X(capture_tracks)               \
  X(cloud_las)                    \
  X(cloud_pcd)                    \
  X(cloud_ply)                    \
  X(colmap_database)              \
  X(colmap_model)                 \
  X(color_raster)                 \
  X(cover_raster)                 \
  X(dataset_coco)                 \
  X(dataset_colmap)               \
  X(dataset_euroc)                \
  X(dataset_kitti)                \
  X(dataset_kitti_object)         \
  X(dataset_kitti_raw)            \
  X(dataset_mcap)                 \
  X(dataset_tartanair)            \
  X(dataset_tartanair_v1)         \
  X(dataset_terracast)            \
  X(dataset_tum)                  \
  X(exr)                          \
  X(features_geojson)             \
  X(features_gpkg)                \
  X(features_kml)                 \
  X(features_osm)                 \
  X(features_pbf)                 \
  X(features_shape)               \
  X(fixes_adsb)                   \
  X(fixes_csv)                    \
  X(fixes_euroc)                  \
  X(fixes_gpx)                    \
  X(fixes_jsbsim)                 \
  X(fixes_oxts)                   \
  X(fixes_sbet)                   \
  X(fixes_srt)                    \
  X(fixes_tum)                    \
  X(fixes_ulog)                   \
  X(geoid)                        \
  X(geojson_crs)                  \
  X(georegistration)              \
  X(json)                         \
  X(ledger)                       \
  X(legend)                       \
  X(lidar_instances)              \
  X(lidar_labels)                 \
  X(lidar_ply)                    \
  X(lidar_velodyne)               \
  X(mcap)                         \
  X(model_glb)                    \
  X(model_gltf)                   \
  X(model_obj)                    \
  X(model_ply)                    \
  X(nmea)                         \
  X(npy)                          \
  X(npy_table)                    \
  X(npz)                          \
  X(npz_arrays)                   \
  X(offset_grid)                  \
  X(osm_census)                   \
  X(pbf_census)                   \
  X(placements)                   \
  X(png)                          \
  X(png_pixels)                   \
  X(prototype)                    \
  X(prototype_shapes)             \
  X(raster_asc)                   \
  X(raster_tif)                   \
  X(raster_vrt)                   \
  X(rasters_of_world)             \
  X(result_cloud)                 \
  X(rig_carla)                    \
  X(rig_colmap)                   \
  X(rig_csv)                      \
  X(rig_kalibr)                   \
  X(rig_opencv)                   \
  X(rig_orb_slam)                 \
  X(rig_ouster)                   \
  X(rig_ros)                      \
  X(rig_toml)                     \
  X(rig_velodyne)                 \
  X(rig_vins)                     \
  X(rig_xlsx)                     \
  X(rig_xlsx_sheets)              \
  X(rinex_navigation)             \
  X(rinex_observations)           \
  X(tabulated)                    \
  X(terrain_tiles)                \
  X(tile)                         \
  X(tile_layers)                  \
  X(toml)                         \
  X(vdb_lengths)                  \
  X(volume)                       \
  X(volume_voxels)                \
  X(ways)                         \
  X(ways_parts)                   \
  X(world_manifest)

namespace terracast::fuzz {

#define TERRACAST_DECLARE(name) void fuzz_##name(Bytes input);
TERRACAST_FUZZ_TARGETS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const Target> targets() {
#define TERRACAST_ENTRY(name) Target{#name, fuzz_##name},
  static const std::array table = {TERRACAST_FUZZ_TARGETS(TERRACAST_ENTRY)};
#undef TERRACAST_ENTRY
  return table;
}

const Target* find_target(std::string_view name) {
  for (const Target& target : targets())
    if (target.name == name) return &target;
  return nullptr;
}

void prepare() {
  tiler::register_all_gdal();
  CPLPushErrorHandler(CPLQuietErrorHandler);
}

std::string run(const Target& target, Bytes input) {
  try {
    target.read(input);
    return {};
  } catch (const core::Error& error) {
    using core::ErrorKind;
    if (error.kind() == ErrorKind::Input || error.kind() == ErrorKind::Io ||
        error.kind() == ErrorKind::Config)
      return error.what();
    throw std::runtime_error(
        fmt::format("{}: an error of another kind than a file's: {}", target.name, error.what()));
  } catch (const std::bad_alloc&) {
    return "there is too little memory";
  } catch (const std::exception& error) {
    throw std::runtime_error(
        fmt::format("{}: an exception that is no core::Error: {}", target.name, error.what()));
  }
}

}  // namespace terracast::fuzz
