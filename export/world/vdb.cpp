#include <fmt/format.h>

#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "export/world/world_format.h"
#include "world/vdb/vdb_file.h"

// The volumes of a region (clouds, fog, smoke) as OpenVDB grids of their extinction per metre, in a frame that is
// east, north, up at the region's centre, m.

namespace terracast::world_export {
namespace {

void write_vdb(const WorldExportInputs& inputs) {
  const world::WorldManifest& manifest = inputs.store.manifest();
  const geo::WorldFrame frame(manifest.origin);
  const geo::Geodetic center = inputs.region.center();
  const geo::Rigid3d enu_world = enu_from_world(frame, center);
  std::vector<world::Volume> volumes(manifest.volumes.size());
  std::vector<world::VdbGrid> grids;
  for (std::size_t i = 0; i < manifest.volume_places.size(); ++i) {
    const world::VolumePlace& place = manifest.volume_places[i];
    if (!is_in_square(manifest, place.place_world.head<2>()) ||
        !inputs.region.contains(frame.geodetic_from_world(place.place_world)))
      continue;
    const auto row = static_cast<std::size_t>(place.volume);
    if (volumes[row].density.empty()) volumes[row] = inputs.store.load_volume(row);
    Eigen::Affine3d world_from_volume = Eigen::Affine3d::Identity();
    world_from_volume.linear() =
        frame.world_from_enu(place.place_world) *
        Eigen::AngleAxisd(place.heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
        place.scale;
    world_from_volume.translation() = place.place_world;
    Eigen::Affine3d enu_from_volume = Eigen::Affine3d::Identity();
    enu_from_volume.linear() = enu_world.rotation.toRotationMatrix() * world_from_volume.linear();
    enu_from_volume.translation() = enu_world * place.place_world;
    grids.push_back({.name = fmt::format("density_{}", i),
                     .volume = &volumes[row],
                     .factor = place.extinction_per_m,
                     .file_from_volume = enu_from_volume,
                     .notes = {{"terracast_frame", frame_text("x east, y north, z up", center)}}});
  }
  if (grids.empty())
    core::fail(core::ErrorKind::Input,
               "{}: no volume of the world's {} has its place in the region",
               inputs.store.folder().string(), manifest.volume_places.size());
  core::write_file(inputs.destination, world::encode_vdb(grids));
}

}  // namespace

WorldFormatInfo vdb_world_format() {
  return {"vdb", "Clouds and other volumes as OpenVDB grids of extinction per metre.", ".vdb",
          write_vdb};
}

}  // namespace terracast::world_export
