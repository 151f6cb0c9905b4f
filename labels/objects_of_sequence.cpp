#include "labels/objects_of_sequence.h"

#include <algorithm>
#include <set>

#include "core/instance_id.h"
#include "core/progress.h"
#include "labels/images.h"

namespace terracast::labels {
namespace {

/// The ids of all that an image shows, ascending.
std::set<std::uint32_t> ids_in(const capture::CameraFrame& facts) {
  std::set<std::uint32_t> ids;
  std::uint32_t last = 0;  // neighbours mostly show the same
  for (const std::uint32_t id : facts.instance_id.data()) {
    if (id != last && id != 0) ids.insert(id);
    last = id;
  }
  return ids;
}

/// The same of the whole sequence.
std::vector<std::uint32_t> ids_in(const capture::SequenceReader& sequence,
                                  const core::Context& context) {
  const std::size_t num_cameras = sequence.info().cameras.size();
  std::vector<std::set<std::uint32_t>> ids(static_cast<std::size_t>(num_images(sequence)));
  core::Progress progress(context, "images looked at", num_images(sequence));
  for_each_image(sequence, [&](int frame, int camera) {
    ids[static_cast<std::size_t>(frame) * num_cameras + static_cast<std::size_t>(camera)] =
        ids_in(sequence.read_camera(frame, camera, capture::SequenceReader::kFacts));
    progress.advance();
  });
  std::set<std::uint32_t> all;
  for (const std::set<std::uint32_t>& own : ids) all.insert(own.begin(), own.end());
  return {all.begin(), all.end()};
}

}  // namespace

std::vector<ShownObject> objects_of_sequence(const LabelInputs& inputs) {
  const std::vector<std::uint32_t> ids = ids_in(inputs.sequence, inputs.context);
  // Of what stands, then of what moves, whose ids are higher.
  const auto first_moving = std::lower_bound(ids.begin(), ids.end(), core::kFirstMovingId);
  std::vector<ShownObject> objects = find_objects(
      inputs.store, inputs.sequence.info(), inputs.sequence.frames(), {ids.begin(), first_moving});
  for (ShownObject& object : moving_objects(inputs.things, {first_moving, ids.end()}))
    objects.push_back(std::move(object));
  return objects;
}

}  // namespace terracast::labels
