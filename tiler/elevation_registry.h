#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "core/context.h"
#include "geo/geodesy.h"
#include "geo/geoid.h"
#include "tiler/height_field.h"
#include "tiler/kept_ground.h"
#include "tiler/world_options.h"

namespace terracast::tiler {

/// What a kind of elevation is made from.
struct ElevationInputs {
  const WorldOptions& options;
  const ElevationOptions& entry;  ///< of options.elevation: the first of the field's own
  const geo::WorldFrame& frame;
  geo::VerticalDatum datum;                 ///< what the field's heights shall be above
  std::shared_ptr<const geo::Geoid> geoid;  ///< null unless a source or the sea needs it
  const core::Context& context;
  std::span<const KeptLand> kept_lands = {};  ///< which need not be made again
};

/// A kind of elevation source.
struct ElevationKindInfo {
  std::string_view name;
  std::string_view summary;
  /// Makes the field of all entries of WorldOptions::elevation, the first of which is of this kind.
  std::unique_ptr<HeightField> (*make)(const ElevationInputs& inputs);
};

/// The table of kinds: fractal, paraboloid, plane, procedural, ramp, raster.
std::span<const ElevationKindInfo> elevation_kinds();

/// The datum of an entry; kinds that are not measured stand on the ellipsoid when none is stated.
/// throws   Io, Input: its grid cannot be found or read
geo::VerticalDatum datum_of(const ElevationOptions& options);

std::unique_ptr<HeightField> make_fractal(const ElevationInputs& inputs);
std::unique_ptr<HeightField> make_paraboloid(const ElevationInputs& inputs);
std::unique_ptr<HeightField> make_plane(const ElevationInputs& inputs);
std::unique_ptr<HeightField> make_procedural(const ElevationInputs& inputs);
std::unique_ptr<HeightField> make_ramp(const ElevationInputs& inputs);
std::unique_ptr<HeightField> make_raster(const ElevationInputs& inputs);

}  // namespace terracast::tiler
