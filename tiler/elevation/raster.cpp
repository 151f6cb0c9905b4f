#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "tiler/elevation_registry.h"
#include "tiler/layered_field.h"
#include "tiler/raster_field.h"
#include "tiler/raster_mosaic.h"
#include "tiler/void_filling.h"

// Measured terrain: one mosaic over the square; or mosaics of insets over it, and procedural land
// under it where outside = "procedural".
namespace terracast::tiler {
namespace {

/// How much each sample of a patch counts: 0 where it has none and beside that, 1 from `blend_m`
/// on.
Grid<float> share_of(const RasterMosaic& mosaic, double blend_m) {
  constexpr int kRim = 1;  // what lies beyond the patch has no heights either
  Grid<std::uint8_t> is_covered(mosaic.heights_m.width + 2 * kRim,
                                mosaic.heights_m.height + 2 * kRim, 0);
  for (int j = 0; j < mosaic.heights_m.height; ++j)
    for (int i = 0; i < mosaic.heights_m.width; ++i)
      is_covered(i + kRim, j + kRim) =
          mosaic.is_missing.values.empty() || mosaic.is_missing(i, j) == 0 ? 1 : 0;
  const Grid<float> distance_m = distance_to_others(is_covered, mosaic.sample_size_m);
  const double first_m = mosaic.sample_size_m.maxCoeff();
  Grid<float> share(mosaic.heights_m.width, mosaic.heights_m.height);
  for (int j = 0; j < share.height; ++j)
    for (int i = 0; i < share.width; ++i) {
      const double inward_m = static_cast<double>(distance_m(i + kRim, j + kRim)) - first_m;
      const double t = std::clamp(inward_m / blend_m, 0.0, 1.0);
      share(i, j) = static_cast<float>(t * t * (3.0 - 2.0 * t));
    }
  return share;
}

FieldLayer make_patch(const ElevationInputs& inputs, std::span<const ElevationOptions> entries,
                      double blend_m) {
  RasterMosaic mosaic = make_mosaic(inputs, {.entries = entries, .is_patch = true});
  FieldLayer layer;
  layer.share = share_of(mosaic, blend_m);
  if (*std::max_element(layer.share.values.begin(), layer.share.values.end()) < 1.0F)
    inputs.context.log.warn(
        "{}: nowhere as much as {:g} m from its border: its own heights count nowhere fully; make "
        "{} smaller",
        mosaic.sources.front().name, blend_m,
        entries.front().blend_m > 0.0 ? "blend_m" : "the distance");
  layer.field = make_raster_field(std::move(mosaic));
  return layer;
}

FieldLayer make_procedural_base(const ElevationInputs& inputs) {
  ElevationOptions entry;
  if (inputs.options.elevation.back().kind == "procedural") entry = inputs.options.elevation.back();
  if (!entry.vertical_datum.empty() && !(datum_of(entry) == inputs.datum))
    core::fail(core::ErrorKind::Config,
               "the procedural land that goes on behind rasters has their vertical datum ({}), and "
               "\"{}\" is stated; leave it out",
               inputs.datum.name, entry.vertical_datum);
  entry.kind = "procedural";
  return {.field = make_procedural({inputs.options, entry, inputs.frame, inputs.datum, inputs.geoid,
                                    inputs.context, inputs.kept_lands}),
          .share = {}};
}

}  // namespace

std::unique_ptr<HeightField> make_raster(const ElevationInputs& inputs) {
  const std::span<const ElevationOptions> all(inputs.options.elevation);
  const auto is_ground = [](const ElevationOptions& entry) { return entry.blend_m == 0.0; };
  const auto is_raster = [](const ElevationOptions& entry) { return entry.kind == "raster"; };
  const auto num_rasters =
      static_cast<std::size_t>(std::count_if(all.begin(), all.end(), is_raster));
  const auto num_insets =
      static_cast<std::size_t>(std::find_if(all.begin(), all.end(), is_ground) - all.begin());
  const auto ground = all.subspan(num_insets, num_rasters - num_insets);
  const bool goes_on = inputs.options.outside == "procedural";
  if (num_insets == 0 && !goes_on)
    return make_raster_field(make_mosaic(inputs, {.entries = ground}));

  std::vector<FieldLayer> layers;
  if (goes_on) {
    layers.push_back(make_procedural_base(inputs));
    // The land beyond is made to fit at its own samples; what they do not hold is blended away.
    layers.push_back(make_patch(inputs, ground, 2.0 * layers.front().field->spacing_m()));
  } else {
    layers.push_back(
        {.field = make_raster_field(make_mosaic(inputs, {.entries = ground})), .share = {}});
  }
  for (std::size_t i = num_insets; i-- > 0;)
    layers.push_back(make_patch(inputs, all.subspan(i, 1), all[i].blend_m));
  return make_layered_field(inputs.frame, inputs.options.size_m, std::move(layers),
                            goes_on ? inputs.options.outside_blend_m : 0.0);
}

}  // namespace terracast::tiler
