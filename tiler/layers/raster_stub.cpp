#include "core/error.h"
#include "tiler/layer_registry.h"
namespace terracast::tiler {
std::unique_ptr<HeightField> make_raster(const ElevationInputs&) {
  core::fail(core::ErrorKind::Internal, "rasters are not built yet");
}
}  // namespace terracast::tiler
