#pragma once

#include <memory>

#include "core/log.h"
#include "tiler/instance_ids.h"
#include "tiler/layer.h"
#include "tiler/surface.h"
#include "tiler/vector_source.h"

namespace terracast::fuzz {

/// Of the world that features and rasters are read for.
inline constexpr double kOriginLat_deg = 42.5;
inline constexpr double kOriginLon_deg = 1.5;
inline constexpr double kSize_m = 4096.0;

/// What a layer is given of a small world on a plane.
class SmallWorld {
 public:
  SmallWorld();
  tiler::LayerInputs inputs() const;
  tiler::VectorFrame frame() const { return tiler::vector_frame(inputs()); }

 private:
  core::Log log_;
  std::shared_ptr<const tiler::WorldSurface> surface_;
  mutable tiler::InstanceIds ids_;
  core::Context context_;
};

}  // namespace terracast::fuzz
