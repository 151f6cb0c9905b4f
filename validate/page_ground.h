#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/image.h"
#include "core/json.h"
#include "validate/ground_map.h"
#include "validate/page_images.h"

/// The ground as a dataset's own depth shows it: a relief seen from above, and a cloud of points.
namespace terracast::validate {

/// A picture of the ground from above, north up, local frame.
struct GroundPicture {
  core::Image8 image;  ///< 3 channels, or 4 with nothing where no pixel fell
  MapArea area;
};

/// The area that a sequence's cameras and footprints cover, with a margin; nothing without poses.
std::optional<MapArea> area_of(const Sequence& sequence,
                               const std::vector<const PageImage*>& images);

/// Depth carried to the ground and shaded: the mean height of a cell's pixels lit from the
/// north-west, tinted by their mean colour. Cells are as fine as there are pixels for.
std::optional<GroundPicture> relief_of(const std::vector<const PageImage*>& images,
                                       const Sequence& sequence, const MapArea& area);

/// At most `most` points of the images' depth with their colours, evenly over the pixels:
/// {"origin", "positions", "colors", "count"}, positions packed float32 about the origin, x y z
/// one after the other. Points beyond kFarDepths times their image's median depth are left out.
core::Json cloud_of(const std::vector<const PageImage*>& images, const Sequence& sequence,
                    std::size_t most);

}  // namespace terracast::validate
