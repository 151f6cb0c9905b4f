#include "export/world/model_file.h"
#include "export/world/world_format.h"

namespace terracast::world_export {

WorldFormatInfo gltf_world_format() {
  return {"gltf", "glTF 2 (binary); x east, y up, -z north, about the region's centre.", ".glb",
          [](const WorldExportInputs& inputs) { write_region_model(inputs, "glb2"); }};
}

}  // namespace terracast::world_export
