#include "export/world/model_file.h"
#include "export/world/world_format.h"

namespace terracast::world_export {

WorldFormatInfo obj_world_format() {
  return {"obj", "Wavefront OBJ with materials; x east, y north, z up, about the region's centre.",
          ".obj", [](const WorldExportInputs& inputs) { write_region_model(inputs, "obj"); }};
}

}  // namespace terracast::world_export
