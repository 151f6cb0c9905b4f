#pragma once

#include <limits>
#include <string>

#include "batch/dataset/ground_cells.h"
#include "capture/frame_reader.h"
#include "world/tile_store.h"

namespace terracast::batch {

/// Of which ground a world is: "earth" when any of its heights were measured, else its input hash.
std::string ground_identity(const world::WorldManifest& manifest);

struct GroundOptions {
  std::string ground = "earth";  ///< ground_identity()
  /// Ground that is farther from the camera, in a straight line, does not count.
  double within_m = std::numeric_limits<double>::infinity();
};

/// The ground that the images of a sequence show.
///
/// Seen are the hits of the rays through the pixels' centres, and what lies between those of pixels
/// that touch, corners included: the hull of each four, straight in latitude and longitude over at
/// most 10 km (there 2 m off a straight line, at 45 degrees). So no cell is missed however far apart
/// hits are, and ground counts too that is hidden between a ridge and what the next pixel shows
/// behind it. The half pixel at an image's border does not. Sky shows nothing, nor does the class
/// outside (the apron beyond the world's square).
///
/// returns    the same set for any number of threads
/// accuracy   holds every cell that this ground meets, and none farther than one cell from it:
///            GroundSeen tests
/// cost       0.2 us a pixel and thread, half of it to read the facts; 0.3 where hits lie farther
///            apart than cells
/// memory     one image's facts a thread
/// throws     as SequenceReader::read_camera; Config: within_m is not positive
GroundSeen ground_seen(const capture::SequenceReader& sequence, const GroundOptions& options);

}  // namespace terracast::batch
